"""Build the site into `_build`: `python build.py`, with fewer seeds if `SEEDS` is set.

`python build.py --only 03_reinforce ...` executes and builds a few pages alone.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import pictures
from announce import FULL, announce
from joblib import cpu_count
from stamp import run

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
    config = folder / "_config.yml"
    text = config.read_text(encoding="utf-8")
    # The notebooks are executed before, several at once, and hold their outputs then.
    executed = text.replace("execute_notebooks: force", 'execute_notebooks: "off"')
    config.write_text(executed, encoding="utf-8")
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


def stages(notebooks: Iterable[Path]) -> list[list[Path]]:
    """Notebooks that can be executed at once: the chapters, and one by one what reads of them all.

    Examples
    --------
    >>> names = ["intro", "02_learning", "a1_reproduce", "01_maze"]
    >>> [[path.name for path in stage] for stage in stages(Path(name) for name in names)]
    [['01_maze', '02_learning'], ['a1_reproduce'], ['intro']]
    """
    paths = sorted(notebooks)
    chapters = [path for path in paths if path.name[0].isdigit()]
    return [chapters, *([path] for path in paths if path not in chapters)]


def execute(notebook: Path) -> subprocess.CompletedProcess[str]:
    """Execute a notebook where it lies and write the outputs into it, as `jupyter execute` does."""
    program = "from nbclient.cli import main; main()"  # of this Python
    command = [sys.executable, "-c", program, "--inplace", "--kernel_name=python3", "--timeout=-1"]
    return subprocess.run([*command, str(notebook)], capture_output=True, text=True, check=False)


def execute_all(notebooks: Iterable[Path]) -> int:
    """Execute notebooks on all cores, and tell how far the whole is; return an exit code.

    After one that failed, or Ctrl-C, no other is begun; those at work end by themselves.
    """
    ordered, start, count = stages(notebooks), time.monotonic(), 0
    with ThreadPoolExecutor(cpu_count()) as pool:
        try:
            for stage in ordered:
                futures = {pool.submit(execute, path): path for path in stage}
                for future in as_completed(futures):
                    name, done = futures[future].name, future.result()
                    if done.returncode:
                        print(f"{name}:\n{done.stderr}", file=sys.stderr, flush=True)
                        return done.returncode
                    count += 1
                    passed, total = (time.monotonic() - start) / 60, sum(map(len, ordered))
                    print(f"--- {name}, {count} of {total}, after {passed:.1f} min", flush=True)
        finally:
            pool.shutdown(cancel_futures=True)
    return 0


def build(seeds: int, only: list[str]) -> int:
    """Train, execute and build; return an exit code.

    Always from nothing: an incremental build passes over warnings in pages that it does not read
    again. Pages built alone may have links that lead nowhere, so warnings are let pass there.
    """
    target = ROOT / "_build" / "chapter" if only else ROOT
    shutil.rmtree(target if only else ROOT / "_build", ignore_errors=True)
    source = copied(target / "_build" / "source", preview=seeds != FULL, only=only)
    notebooks = [source / "book" / f"{name}.ipynb" for name in only]
    train = ["python", "-m", "studies.everything"]
    page = ["jupyter-book", "build", str(source), "--path-output", str(target)]
    if not only:
        announce(seeds)
        notebooks = list((source / "book").glob("*.ipynb"))
        page += STRICT
    code = (not only and run(train, source / "book")) or execute_all(notebooks) or run(page)
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
