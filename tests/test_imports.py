"""What a configuration names by import path."""

import math
import subprocess
import sys
import textwrap

import pytest

from rl_core.identity import code_behind, imported


def test_what_stands_there_is_found():
    assert imported("thing", "math:floor") is math.floor
    assert imported("thing", "toy_networks:Net.forward").__qualname__ == "Net.forward"


@pytest.mark.parametrize("path", ["math", "math:", ":floor", "", "math:flour", "no_such:thing"])
def test_nothing_there_is_refused_by_name(path):
    with pytest.raises(ValueError, match=rf"^thing must be an import path .*, got {path!r}"):
        imported("thing", path)


@pytest.mark.parametrize("path", [3, None, math.floor])
def test_what_is_no_text_is_refused(path):
    with pytest.raises(TypeError, match=r"^thing must be an import path 'module:name', got "):
        imported("thing", path)


def test_main_is_not_found_by_workers():
    with pytest.raises(ValueError, match="put it into a module of its own"):
        imported("thing", "__main__:thing")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in ("nets_a", "nets_b", "nets_c"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("source", ["raise KeyError('odd')", "def broken(:", "1 / 0"])
def test_a_module_that_cannot_be_imported_is_named(folder, source):
    (folder / "nets_c.py").write_text(source)
    with pytest.raises(ValueError, match=r"^network must be an import path .* got 'nets_c:make'"):
        imported("network", "nets_c:make")


def test_code_is_that_of_the_module_and_of_what_it_imports(folder):
    (folder / "nets_a.py").write_text("import nets_b\n\ndef make(): ...\n")
    (folder / "nets_b.py").write_text("WIDTH = 3\n")
    first = code_behind("nets_a:make")
    (folder / "nets_b.py").write_text("# wider\nWIDTH = (3)\n")
    assert code_behind("nets_a:make") == first
    (folder / "nets_b.py").write_text("WIDTH = 4\n")
    second = code_behind("nets_a:make")
    assert second != first
    (folder / "nets_a.py").write_text(
        textwrap.dedent("""
        import nets_b

        def make(): return 1
        """)
    )
    assert code_behind("nets_a:make") not in (first, second)


def test_what_is_installed_is_named_not_read():
    program = """
import sys
from rl_core.identity import code_behind
assert code_behind("torch.nn:Linear") != code_behind("torch.nn.functional:relu")
assert "torch._inductor" not in sys.modules  # reading all of torch would have imported it
"""
    subprocess.run([sys.executable, "-c", program], check=True)
