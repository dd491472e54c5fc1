"""Build the site into `_build`: `python build.py`, with fewer seeds if `SEEDS` is set.

`python build.py --only 03_reinforce ...` executes and builds a few pages alone.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pictures
from announce import FULL, announce

ROOT = Path(__file__).parents[2]
STRICT = ("--warningiserror", "--nitpick", "--keep-going")


def copied(folder: Path, *, preview: bool, only: list[str]) -> Path:
    """Copy the sources, perhaps only a few pages of them, beside a link to the results.

    The tables that a preview writes stay with it; what it runs is kept in the one store, where the
    book finds it again.
    """
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("_config.yml", "_toc.yml"):
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder)
    shutil.copytree(ROOT / "book", folder / "book")
    if only:
        root, *others = only
        chapters = ["chapters:"] * bool(others) + [f"  - file: book/{name}" for name in others]
        toc = "\n".join(["format: jb-book", f"root: book/{root}", *chapters])
        (folder / "_toc.yml").write_text(toc, encoding="utf-8")
    part = Path("results/store") if preview else Path("results")
    (ROOT / part).mkdir(parents=True, exist_ok=True)
    (folder / part).parent.mkdir(exist_ok=True)
    (folder / part).symlink_to(ROOT / part, target_is_directory=True)
    return folder


def run(command: list[str], notebooks: int) -> int:
    """Run a build, pass on what it says, and tell how far the whole book is; return its exit code.

    If interrupted, let it end by itself first.
    """
    begun, start = 0, time.monotonic()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, errors="replace") as process:
        assert process.stdout is not None
        try:
            for line in process.stdout:
                print(line, end="", flush=True)
                if "Executing notebook using" in line:
                    begun += 1
                    passed = (time.monotonic() - start) / 60
                    print(
                        f"--- notebook {begun} of {notebooks}, after {passed:.0f} min", flush=True
                    )
            return process.wait()
        except KeyboardInterrupt:  # the command got it too
            process.wait()
            raise


def build(seeds: int, only: list[str]) -> int:
    """Execute and build; return an exit code.

    Always from nothing: an incremental build passes over warnings in pages that it does not read
    again. Pages built alone may have links that lead nowhere, so warnings are let pass there.
    """
    source = target = ROOT
    if only:
        target = ROOT / "_build" / "chapter"
        shutil.rmtree(target, ignore_errors=True)
    else:
        announce(seeds)
        shutil.rmtree(ROOT / "_build", ignore_errors=True)
    if only or seeds != FULL:
        source = copied(target / "_build" / "source", preview=seeds != FULL, only=only)
    command = ["jupyter-book", "build", str(source), "--path-output", str(target)]
    notebooks = len(only) or len(list((source / "book").glob("*.ipynb")))
    code = run(command if only else [*command, *STRICT], notebooks)
    lost = [] if code else pictures.missing(source / "book", target / "_build" / "html" / "book")
    print("\n".join(lost), file=sys.stderr)
    if only and not code:
        print(f"The page is at file://{target}/_build/html/book/{only[0]}.html")
    return code or len(lost)


def main() -> int:
    """Read the command line and build."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=[], help="pages, such as 03_reinforce")
    only, seeds = parser.parse_args().only, int(os.environ.get("SEEDS") or FULL)
    try:
        return build(seeds, only)
    except KeyboardInterrupt:
        offer = "" if only or seeds != FULL else " A first look in minutes: make book SEEDS=3"
        print(f"Interrupted; what is finished is kept.{offer}", flush=True)
        return 130


if __name__ == "__main__":
    sys.exit(main())
