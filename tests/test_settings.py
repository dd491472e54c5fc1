"""Tables of settings show every setting, and nothing that is equal as different."""

from dataclasses import dataclass, field

import pytest

from report.settings import hyperparameters, table
from rl_core.experiments import Arm
from rl_core.policies import MLP, Gaussian
from rl_core.reinforce import ReinforceConfig, reinforce


def arm(name, env="Acrobot-v1", **changes):
    return Arm(name, reinforce, env, ReinforceConfig(**changes), episodes=10)


def test_only_what_differs_is_named():
    arms = [
        arm("plain"),
        arm("same", gamma=0.99, network=MLP((10, 20))),
        arm("one", network=MLP((10,)), epochs=1),
        arm("wide", network=MLP((10, 20), biases=False)),
        arm("gaussian", policy=Gaussian(sigma=0.5)),
    ]
    shown = table(arms, "plain").set_index("arm")["differs"]
    assert shown["plain"] == shown["same"] == ""
    assert shown["one"] == "network.hidden=(10,), epochs=1"
    assert shown["wide"] == "network.biases=False"
    assert shown["gaussian"].startswith("policy=Gaussian()")
    assert "policy.sigma=0.5" in shown["gaussian"]
    assert table(arms[1:], arms[0])["differs"].tolist() == shown.tolist()[1:]


def test_a_reported_arm_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="reported must be the name of an arm, got 'gone'"):
        table([arm("plain")], "gone")


def test_every_hyperparameter_is_there():
    shown = hyperparameters(ReinforceConfig(gamma=0.5)).set_index("hyperparameter")["value"]
    assert set(ReinforceConfig.__dataclass_fields__) <= set(shown.index)
    assert shown["gamma"] == "0.5"
    assert shown["network.hidden"] == "(10, 20)"
    assert shown["max_episode_steps"] == "None"


def test_functions_are_shown_by_name():
    @dataclass
    class WithFunction:
        act: object = field(default=len)

    assert hyperparameters(WithFunction())["value"].tolist() == ["len"]
    with pytest.raises(TypeError, match="config must be a dataclass's instance, got 3"):
        hyperparameters(3)
