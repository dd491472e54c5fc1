"""Environments are opened by name, and told apart by all that decides what they do."""

import sys
import textwrap

import gymnasium
import pytest

from rl_core.sources import _LOADED
from rl_core.worlds.names import Make, find, identity, make_environment

LAB = """
    import gymnasium
    from gymnasium.envs.classic_control import CartPoleEnv

    class Cart(CartPoleEnv):
        def __init__(self, length=0.5):
            super().__init__()
            self.length = length

    class Twice(gymnasium.RewardWrapper):
        def reward(self, reward):
            return 2 * reward

    constant = 3
    standing = Cart()
"""
ID = "NamesLab-v0"


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A module with an environment, registered."""
    path = tmp_path / "names_lab.py"
    path.write_text(textwrap.dedent(LAB))
    monkeypatch.syspath_prepend(tmp_path)
    gymnasium.register(ID, entry_point="names_lab:Cart")
    yield path
    gymnasium.registry.pop(ID, None)
    sys.modules.pop("names_lab", None)
    _LOADED.pop("names_lab", None)


@pytest.mark.parametrize(
    "change",
    [
        {"kwargs": {"length": 0.6}},
        {"max_episode_steps": 7},
        {"order_enforce": False},
        {"entry_point": "names_lab:Twice"},
        {
            "additional_wrappers": (
                gymnasium.envs.registration.WrapperSpec("Twice", "names_lab:Twice", {}),
            )
        },
    ],
)
def test_another_registration_is_another_environment(lab, change):
    before = identity(ID)
    assert identity(ID) == before
    gymnasium.registry.pop(ID)
    gymnasium.register(ID, **{"entry_point": "names_lab:Cart", **change})
    assert identity(ID) != before


def test_the_code_behind_the_entry_point_and_the_wrappers_counts(lab):
    wrapper = gymnasium.envs.registration.WrapperSpec("Twice", "names_lab:Twice", {})
    gymnasium.registry.pop(ID)
    gymnasium.register(ID, entry_point="rl_core.maze:Maze", additional_wrappers=(wrapper,))
    before = identity(ID), identity("names_lab:Cart")
    assert {"names_lab", "rl_core.maze"} <= set(before[0]["code"])
    lab.write_text(lab.read_text().replace("2 * reward", "3 * reward"))
    after = identity(ID), identity("names_lab:Cart")
    assert after[0] != before[0]
    assert after[1] != before[1]


def test_arguments_count_and_arrive(lab):
    made = Make(ID, {"length": 0.7})
    assert make_environment(made).unwrapped.length == 0.7
    assert identity(made) != identity(ID)
    assert identity(Make(ID)) == identity(ID)


def test_names_of_every_kind_are_opened(lab):
    for name in (ID, f"names_lab:{ID}", "names_lab:Cart", Make(f"names_lab:{ID}")):
        assert type(make_environment(name).unwrapped).__name__ == "Cart"
        assert identity(name)["code"].keys() == {"names_lab"}
    assert find("names_lab:constant") == 3
    assert find(ID) is find(f"names_lab:{ID}") is find(Make(ID)) is None


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("Pole-v7", ValueError, "env must be an id that Gymnasium knows, got 'Pole-v7': Env"),
        ("CartPole-v9", ValueError, "env must be an id that Gymnasium knows, .* version `v9`"),
        ("nowhere:Foo-v0", ValueError, "env must have a module .*: No module named 'nowhere'"),
        ("names_lab:Nothing", ValueError, "env must name what its module has, got 'names_lab:No"),
        ("names_lab:constant", TypeError, "env must be an import path .*, got 'names_lab:const"),
        ("names_lab:standing", TypeError, "env must be an import path .*, got 'names_lab:stand"),
        (Make(ID, {"size": 1}), ValueError, "env must be one that opens .* argument 'size'"),
        (3, TypeError, "env must be a Gymnasium id, a Make or an import path, got 3"),
    ],
)
def test_what_does_not_open_is_told_why(lab, name, error, message):
    with pytest.raises(error, match=message):
        make_environment(name)


def test_a_missing_dependency_is_named(lab, monkeypatch):
    """Gymnasium's LunarLander without Box2D, say."""
    lab.write_text("import gymnasium\nraise gymnasium.error.DependencyNotInstalled('no Box2D')")
    with pytest.raises(ValueError, match=f"env must be one that opens here, got '{ID}': no Box2D"):
        make_environment(ID)


def test_what_cannot_be_found_by_import_is_refused(lab):
    class Local(gymnasium.Env):
        pass

    for entry_point in (Local, lambda: None):
        gymnasium.registry.pop(ID)
        gymnasium.register(ID, entry_point=entry_point)
        with pytest.raises(TypeError, match=f"env '{ID}' must be registered .*file of its own"):
            identity(ID)
    gymnasium.registry.pop(ID)
    gymnasium.register(ID, entry_point="names_lab:Cart", kwargs={"length": Local()})
    with pytest.raises(TypeError, match=rf"env '{ID}'\['kwargs'\]\['length'\] must be made of"):
        identity(ID)
    with pytest.raises(ValueError, match="env must be an id that Gymnasium knows, got 'Pole-v7'"):
        identity("Pole-v7")


@pytest.mark.parametrize("arguments", [{1: 2}, {"a": {1}}, {"a": float("nan")}, {"a": (1, 2)}])
def test_arguments_are_json(arguments):
    with pytest.raises(ValueError, match="arguments must be a dict of values of JSON"):
        Make(ID, arguments)


def test_makes_are_values():
    assert hash(Make(ID, {"a": 1})) == hash(Make(ID, {"a": 1}))
    assert Make(ID, {"a": 1}) == Make(ID, {"a": 1}) != Make(ID)


def test_an_id_comes_before_what_a_module_has(lab):
    """An id may look like a name (no version), and none like an id is looked for in a module."""
    assert find("names_lab:Cart").__name__ == "Cart"
    gymnasium.register("Cart", entry_point="names_lab:Cart")
    try:
        assert find("names_lab:Cart") is None
    finally:
        gymnasium.registry.pop("Cart")
    assert find("names_lab:Cart-v9") is None
