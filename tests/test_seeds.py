"""The setting `SEEDS`: what it allows, and that it reaches the studies of all chapters."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from report.seeds import FULL, SEEDS, chosen, premise

ROOT = Path(__file__).parent.parent
STUDIES = sorted(path.stem for path in (ROOT / "book/studies").glob("[a-z]*.py"))


@pytest.mark.parametrize("count", [2, 3, FULL])
def test_the_first_so_many_seeds_are_chosen(count):
    assert list(chosen(str(count))) == list(range(count))


@pytest.mark.parametrize("text", ["", "0", "1", str(FULL + 1), "-3", "3.0", "three", "3 4", "²"])
def test_anything_else_is_refused_with_what_is_allowed(text):
    with pytest.raises(ValueError, match=f"whole number from 2 to {FULL}, got {text!r}"):
        chosen(text)


def module_in_a_new_process(code, **setting):
    environment = {name: value for name, value in os.environ.items() if name != "SEEDS"} | setting
    command = [sys.executable, "-c", code]
    return subprocess.run(
        command, cwd=ROOT / "book", env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize(
    ("setting", "expected"),
    [({}, "30 False"), ({"SEEDS": ""}, "30 False"), ({"SEEDS": "4"}, "4 True")],
)
def test_a_preview_is_what_has_fewer_seeds_than_the_book(setting, expected):
    code = "from report import seeds; print(len(seeds.SEEDS), seeds.PREVIEW)"
    assert module_in_a_new_process(code, **setting).stdout.strip() == expected


def test_a_bad_setting_stops_the_import():
    done = module_in_a_new_process("import report.seeds", SEEDS="many")
    assert done.returncode != 0
    assert "SEEDS must be a whole number from 2 to 30, got 'many'" in done.stderr


def test_every_study_uses_the_setting():
    """But for speed, models and proofs, without seeds, and causes, on those of chapter 5."""
    modules = {name: vars(importlib.import_module(f"studies.{name}")) for name in STUDIES}
    without = {study for study, names in modules.items() if names.get("SEEDS") is not SEEDS}
    no_seeds = {"acrobot_angles", "calibration", "certificate", "fastest", "performance"}
    no_seeds |= {"policy_maps", "potential", "q_learning_world", "curves", "rewards"}
    no_seeds |= {"by_sweeps", "dqn_numbers", "on_model", "random_mazes"}
    assert without == no_seeds | {"continuous_causes"}
    assert not any("SEEDS" in modules[name] for name in without)


def test_a_sentence_stands_on_its_premise():
    premise("true", True, preview=False)
    premise("false, but a first look", False, preview=True)
    with pytest.raises(AssertionError, match="do not bear out: false"):
        premise("false", False, preview=False)
    with pytest.raises(TypeError, match="sentence must be a str, got False"):
        premise(False, "a sentence", preview=False)
