"""Which code a module stands for, and whether a process runs it."""

import importlib
import os
import sys
import textwrap

import pytest

from rl_core.sources import check_loaded, code

FILES = {
    "__init__.py": "",
    "learner.py": """
        from lab import networks            # a module by `from package import`
        from .deep.inner import helper      # relative, into a subpackage
        from rl_core.training import Run         # another followed package
        import numpy as np                  # not followed

        def learn():
            from lab.lazy import late       # within a function
            return late
    """,
    "networks.py": "import lab.activations as act\nWIDTH = 20\n",
    "activations.py": "from . import networks\n",  # a circle
    "lazy.py": "late = 1\n",
    "figures.py": "from lab import learner\n",  # imports the learner, not imported by it
    "deep/__init__.py": "from ..constants import PI\n",
    "deep/inner.py": "def helper(): ...\n",
    "constants.py": "PI = 3\n",
}
INVOLVED = {
    "lab", "lab.learner", "lab.networks", "lab.activations", "lab.lazy", "lab.deep",
    "lab.deep.inner", "lab.constants", "rl_core", "rl_core.training",
    "rl_core.checks", "rl_core.kernels", "rl_core.kernels.arrays",
}  # fmt: skip


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A package of several modules."""
    for name, source in FILES.items():
        path = tmp_path / "lab" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(textwrap.dedent(source))
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path / "lab"
    for name in [name for name in sys.modules if name.partition(".")[0] in ("lab", "lone")]:
        del sys.modules[name]


def test_the_imports_of_the_own_package_are_followed(lab):
    assert set(code(["lab.learner"])) == INVOLVED


@pytest.mark.parametrize("file", [name for name in FILES if name != "figures.py"])
def test_an_edit_to_a_module_involved_changes_the_code(lab, file):
    before = code(["lab.learner"])
    (lab / file).write_text((lab / file).read_text() + "\nNEW = 1\n")
    after = code(["lab.learner"])
    changed = {name for name in INVOLVED if before[name] != after[name]}
    parts = [part for part in ("lab/" + file[:-3]).split("/") if part != "__init__"]
    assert changed == {".".join(parts)}


def test_an_edit_to_another_module_does_not(lab):
    before = code(["lab.learner"])
    (lab / "figures.py").write_text("COLOUR = 'red'\n")
    assert code(["lab.learner"]) == before


def test_comments_and_formatting_do_not_count(lab):
    before = code(["lab.learner"])
    (lab / "networks.py").write_text("# wide\nimport lab.activations as act\n\n\nWIDTH = (20)\n")
    assert code(["lab.learner"]) == before
    (lab / "networks.py").write_text("import lab.activations as act\nWIDTH = 21\n")
    assert code(["lab.learner"]) != before


def test_a_new_import_is_followed(lab):
    (lab / "lazy.py").write_text("from lab.figures import learner\nlate = 1\n")
    importlib.invalidate_caches()
    assert set(code(["lab.learner"])) == INVOLVED | {"lab.figures"}


def test_a_module_without_package_is_followed_to_its_neighbours(lab):
    folder = lab.parent
    (folder / "lone.py").write_text("import neighbour, json\n")
    (folder / "neighbour.py").write_text("from lab import lazy\n")
    importlib.invalidate_caches()
    assert set(code(["lone"])) == {"lone", "neighbour", "lab", "lab.lazy"}


def test_figures_and_the_machinery_are_not_part_of_an_algorithm():
    involved = set(code(["rl_core.reinforce"]))
    assert {"rl_core.reinforce", "rl_core.training", "rl_core.kernels.compiled"} <= involved
    machinery = {"figures", "experiments", "store", "workers", "progress", "statistics"}
    assert not involved & {f"rl_core.{name}" for name in machinery}


def test_what_is_no_python_source_is_left_out():
    assert code(["math", "no_such_module"]) == {}


def test_the_process_must_run_what_is_on_disk(lab):
    """Whatever the times of the files are."""
    expected = code(["lab.learner"])
    check_loaded(expected)
    path = lab / "lazy.py"
    old = path.read_text()
    path.write_text("late = 2\n")
    os.utime(path, (0, 0))
    with pytest.raises(RuntimeError, match=r"lab.lazy was changed while the experiment ran"):
        check_loaded(expected)
    with pytest.raises(RuntimeError, match=r"lab.lazy was changed after this process loaded it"):
        check_loaded(code(["lab.learner"]))
    path.write_text(f"# as it was\n{old}")
    os.utime(path, (4e9, 4e9))
    check_loaded(code(["lab.learner"]))


def test_a_module_that_is_loaded_again_is_taken_as_it_then_is(lab):
    from lab import lazy

    (lab / "lazy.py").write_text("late = 'another value'\n")
    importlib.reload(lazy)
    check_loaded(code(["lab.learner"]))
    assert code(["lab.lazy"], loaded=True) == code(["lab.lazy"])
    (lab / "lazy.py").write_text("late = 3\n")
    assert code(["lab.lazy"], loaded=True) != code(["lab.lazy"])


def test_projects_are_followed_into_other_folders_and_installed_packages_are_not(
    lab, tmp_path, monkeypatch
):
    for folder, name in (("other", "other_project"), ("site-packages", "installed")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / f"{name}.py").write_text("A = 1\n")
        monkeypatch.syspath_prepend(tmp_path / folder)
    (lab / "lazy.py").write_text("import other_project, installed\nlate = 1\n")
    importlib.invalidate_caches()
    assert set(code(["lab.lazy"])) == {"lab", "lab.lazy", "other_project"}
    assert "installed" in code(["installed"])
