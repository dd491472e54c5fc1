"""Make something anew only if what it is made of has changed, by content and not by time.

`python stamp.py STAMP [--also TEXT] [--in PATH]... -- COMMAND ...` runs the command unless the file
STAMP holds the digest of all inputs. The digest is taken before: an edit during the run counts.
"""

import argparse
import hashlib
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

IGNORED = ("__pycache__", ".ipynb_checkpoints")


def files(paths: Iterable[Path]) -> Iterator[Path]:
    """The files that are named or lie below a folder that is named, in a fixed order."""
    for path in sorted(set(paths)):
        if path.is_dir():
            yield from files(below for below in path.iterdir() if below.name not in IGNORED)
        elif path.exists():
            yield path


def digest(paths: Iterable[Path], also: str = "") -> str:
    """Return the SHA-256 of names and contents, and of what else decides the result.

    Parameters
    ----------
    paths : iterable of Path
        Files and folders. One that is missing counts as missing.
    also : str
        Settings, versions.
    """
    total = hashlib.sha256(also.encode())
    for path in files(paths):
        content = hashlib.sha256(path.read_bytes()).digest()
        total.update(b"\0" + os.fsencode(path) + b"\0" + content)
    return total.hexdigest()


def run(command: list[str], folder: Path | None = None) -> int:
    """Run a command, perhaps in a folder, and return its exit code; Ctrl-C waits until it ends."""
    with subprocess.Popen(command, cwd=folder) as process:
        try:
            return process.wait()
        except KeyboardInterrupt:  # the command got it too
            process.wait()
            raise


def main(arguments: list[str]) -> int:
    """Run the command if it is due, and stamp what it made; return its exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stamp", type=Path)
    parser.add_argument("--also", default="")
    parser.add_argument("--in", dest="paths", type=Path, action="append", default=[])
    parser.add_argument("command", nargs="+")
    given = parser.parse_args(arguments)
    wanted = digest(given.paths, given.also)
    if given.stamp.exists() and given.stamp.read_text() == wanted:
        return 0
    given.stamp.unlink(missing_ok=True)
    try:
        code = run(given.command)
    except KeyboardInterrupt:
        return 130
    if code == 0:
        given.stamp.parent.mkdir(parents=True, exist_ok=True)
        given.stamp.write_text(wanted)
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
