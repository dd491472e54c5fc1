"""What a user writes down of a policy, and how it is fitted to an environment."""

import dataclasses
import math

import numpy as np
import pytest
import toy_networks

from rl_core import policies
from rl_core.identity import describe
from rl_core.kernels import likelihood
from rl_core.policies import MLP, Categorical, Gaussian, Module, check_network, make_policy


def test_sizes_follow_from_the_spaces():
    assert make_policy(Categorical(), (10, 20), 6, 3, 0).sizes.tolist() == [6, 10, 20, 3]
    assert make_policy(Categorical(), (), 6, 3, 0).sizes.tolist() == [6, 3]
    assert make_policy(Gaussian(), (10, 20), 2, 0, 1).sizes.tolist() == [2, 10, 20, 2]
    three = Gaussian(constant_feature=True)
    assert make_policy(three, (10, 20), 2, 0, 1).sizes.tolist() == [3, 10, 20, 3]
    assert make_policy(three, (7,), 2, 0, 4).sizes.tolist() == [3, 7, 12]
    assert make_policy(Gaussian(mean="direct"), (7,), 2, 0, 4).sizes.tolist() == [2, 7, 4]


@pytest.mark.parametrize("learned", [True, False])
@pytest.mark.parametrize("biases", [True, False])
def test_what_learns_and_what_does_not(learned, biases):
    distribution = Gaussian(sigma=0.3, learn_sigma=learned)
    policy = make_policy(distribution, (5,), 2, 0, 2)
    named = likelihood.unpack(policy, policies.trainable(policy, distribution, biases))
    assert {name: float(part.mean()) for name, part in named.items()} == {
        "layer0.weight": 1.0,
        "layer1.weight": 1.0,
        "layer0.bias": float(biases),
        "layer1.bias": float(biases),
        "log_sigma": float(learned),
    }
    parameters = policies.initial_parameters(policy, distribution, np.random.default_rng(0))
    np.testing.assert_allclose(np.exp(parameters[-2:]), 0.3, rtol=1e-6)


# A network by its import path


def test_a_module_is_plain_data_with_the_code_behind_it():
    module = Module("toy_networks:make")
    assert module == Module("toy_networks:make")
    assert hash(module) == hash(Module("toy_networks:make"))
    described = describe(module)
    assert described["function"] == "toy_networks:make"
    assert described["code"] == module.code
    assert len(module.code) == 64
    assert "code" not in repr(module)


def test_an_edited_network_is_another_one(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    source = tmp_path / "edited_network.py"
    source.write_text("import torch\n\ndef make(n, m):\n    return torch.nn.Linear(n, m)\n")
    before = Module("edited_network:make")
    source.write_text(source.read_text().replace("n, m)\n", "n, m, bias=False)\n"))
    after = Module("edited_network:make")
    assert before.function == after.function
    assert before != after


@pytest.mark.parametrize(
    ("path", "kind", "message"),
    [
        ("toy_networks:nothing", ValueError, "an import path 'module:name', got 'toy_netw"),
        ("toy_networks", ValueError, "an import path 'module:name', got 'toy_netw"),
        ("no_such_module:make", ValueError, "an import path 'module:name', got 'no_such"),
        ("toy_networks:CONSTANT", ValueError, "callable, got 'toy_networks:CONSTANT'"),
        (toy_networks.make, TypeError, "an import path 'module:name', got <function make"),
    ],
)
def test_a_module_that_names_no_function_is_refused(path, kind, message):
    with pytest.raises(kind, match=f"^function must be {message}"):
        Module(path)


@pytest.mark.parametrize(
    ("network", "engine", "found"),
    [
        (MLP(), None, "compiled"),
        (MLP(), "torch", "torch"),
        (MLP(), "compiled", "compiled"),
        (Module("toy_networks:make"), None, "torch"),
        (Module("toy_networks:make"), "torch", "torch"),
    ],
)
def test_an_engine_for_a_network(network, engine, found):
    assert check_network(network, engine) == found


@pytest.mark.parametrize(
    ("network", "engine", "kind", "message"),
    [
        (MLP(), "jax", ValueError, "engine must be one of 'compiled', 'torch' or None, got 'jax'"),
        (MLP(), 1, TypeError, "engine must be one of 'compiled', 'torch' or None, got 1"),
        ((10, 20), None, TypeError, r"network must be MLP\(\.\.\.\) or Module\(.*, got \(10, 20\)"),
        (None, None, TypeError, r"network must be MLP\(\.\.\.\) or Module\(.*, got None"),
        (
            Module("toy_networks:make"),
            "compiled",
            ValueError,
            "engine must be 'torch' for a Module, got 'compiled'",
        ),
    ],
)
def test_another_engine_or_network_is_refused(network, engine, kind, message):
    with pytest.raises(kind, match=f"^{message}"):
        check_network(network, engine)


# Bad input


@pytest.mark.parametrize(
    ("hidden", "kind"),
    [
        ((10, 0), ValueError),
        ((-3,), ValueError),
        ((10.0,), TypeError),
        (10, TypeError),
        ("10", TypeError),
    ],
)
def test_widths_that_are_none_are_refused(hidden, kind):
    with pytest.raises(kind, match=r"^hidden must be .* got "):
        MLP(hidden)


def test_numpys_numbers_and_lists_are_pythons():
    assert MLP([np.int64(3)], np.True_) == MLP((3,), True)
    assert MLP(np.array([3, 4])).hidden == (3, 4)
    assert Gaussian(sigma=np.float32(0.5)) == Gaussian(sigma=0.5)
    assert math.isclose(
        dataclasses.asdict(Gaussian(sigma=np.float32(0.1)))["sigma"], 0.1, rel_tol=1e-7
    )


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.inf, np.nan])
def test_sigma_out_of_range_is_refused(sigma):
    with pytest.raises(ValueError, match=r"^sigma must be a finite number above 0, got "):
        Gaussian(sigma=sigma)


@pytest.mark.parametrize("sigma", ["wide", True, None])
def test_sigma_of_another_kind_is_refused(sigma):
    with pytest.raises(TypeError, match=r"^sigma must be a finite number above 0, got "):
        Gaussian(sigma=sigma)


def test_an_unknown_form_of_the_mean_is_refused():
    with pytest.raises(ValueError, match=r"^mean must be one of 'weights', 'direct', got 'median'"):
        Gaussian(mean="median")


@pytest.mark.parametrize("name", ["learn_sigma", "constant_feature"])
@pytest.mark.parametrize("value", [1, 0, None, "yes", 0.5])
def test_switches_that_are_no_bools_are_refused(name, value):
    with pytest.raises(TypeError, match=rf"^{name} must be a bool, got "):
        Gaussian(**{name: value})


@pytest.mark.parametrize(
    ("distribution", "actions"), [(Categorical(), (0, 1)), (Gaussian(), (3, 0))]
)
def test_a_distribution_over_other_actions_is_refused(distribution, actions):
    with pytest.raises(ValueError, match=r"^policy must be .* where actions are .*, got "):
        make_policy(distribution, (5,), 2, *actions)
