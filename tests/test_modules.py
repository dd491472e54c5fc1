"""Networks in torch: the compiled perceptron's twin, any module by name, the optimisers of 2018."""

import random

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core import modules
from rl_core.kernels import networks
from rl_core.policies import MLP, Module


def made(name, n_inputs=3, n_outputs=2, seed=0):
    rng = np.random.default_rng(seed)
    return modules.make_module(Module(f"toy_networks:{name}"), n_inputs, n_outputs, rng)


# Perceptrons


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.lists(st.integers(1, 6), min_size=2, max_size=4), st.integers(1, 9), st.integers(0, 99))
def test_a_perceptron_is_the_compiled_one_and_shares_its_parameters(sizes, n, seed):
    rng = np.random.default_rng(seed)
    parameters = networks.xavier_uniform(sizes, rng)
    module = modules.perceptron(sizes, parameters)
    parameters += rng.normal(0, 0.1, parameters.size).astype(np.float32)  # seen by the module
    inputs = rng.normal(size=(n, sizes[0])).astype(np.float32)
    found = module(torch.from_numpy(inputs)).detach().numpy()
    np.testing.assert_allclose(
        found, networks.output(sizes, parameters, inputs), rtol=1e-4, atol=1e-5
    )
    with torch.no_grad():
        module[0].weight.fill_(7.0)
    assert (parameters[: sizes[0] * sizes[1]] == 7.0).all()


@pytest.mark.parametrize("biases", [True, False])
def test_an_mlp_is_made_with_the_compiled_ones_initial_weights(biases):
    module = modules.make_module(MLP((4,), biases), 3, 2, np.random.default_rng(5))
    expected = networks.xavier_uniform((3, 4, 2), np.random.default_rng(5))
    found = np.concatenate([p.detach().numpy().ravel() for p in module.parameters()])
    np.testing.assert_array_equal(found, expected)
    learns = [parameter.requires_grad for parameter in module.parameters()]
    assert learns == [True, biases, True, biases]


# Modules by name


def test_a_module_is_a_function_of_the_stream():
    first, again, other = (modules.as_arrays(made("make", seed=seed)) for seed in (0, 0, 1))
    for name, array in first.items():
        np.testing.assert_array_equal(array, again[name])
    assert not np.array_equal(first["body.weight"], other["body.weight"])


def test_trying_a_module_out_leaves_no_trace():
    assert modules.as_arrays(made("make"))["calls"] == 0


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "one_too_many",
            r"put out the shape \(batch, 2\), not \(1, 3\) .*, got toy_networks:one_too",
        ),
        (
            "other_inputs",
            r"take inputs of shape \(1, 3\) and not raise mat1.*, got toy_networks:other",
        ),
        ("squeezing", r"put out the shape \(batch, 2\), not \(2,\) .*, got toy_networks:squeezing"),
        (
            "normalising_batches",
            r"take inputs of shape \(1, 3\) and not raise Exp.*, got toy_net.*:no",
        ),
        ("frozen", "have parameters that learn, which Linear.* has not, got toy_networks:frozen"),
        ("no_module", "make a torch.nn.Module, not 'a network', got toy_networks:no_module"),
        ("of_one_argument", r"be a function \(n_inputs, n_outputs\), .* with \(3, 2\) raises: of"),
        ("raising", r"be a function .*, toy_networks:raising .* raises: out of neurons"),
    ],
)
def test_what_is_no_such_network_is_refused_by_name(name, message):
    with pytest.raises(ValueError, match=f"^network must {message}"):
        made(name)


def test_arrays_come_back_under_the_modules_own_names_and_load_again():
    source, target = made("make", seed=0), made("make", seed=1)
    source(torch.ones(1, 3))
    arrays = modules.as_arrays(source)
    assert {name: array.shape for name, array in arrays.items()} == {
        "calls": (),
        "body.weight": (8, 3),
        "body.bias": (8,),
        "head.weight": (2, 8),
    }
    x = torch.randn(5, 3, generator=torch.Generator().manual_seed(0))
    assert not torch.equal(source(x), target(x))
    modules.load_arrays(target, arrays)
    assert target.calls == 1
    assert torch.equal(source(x), target(x))
    with torch.no_grad():
        source.body.weight.zero_()
    assert arrays["body.weight"].any()  # a copy


@pytest.mark.parametrize(
    "change",
    [
        lambda arrays: arrays.pop("head.weight"),
        lambda arrays: arrays.update(more=np.zeros(1)),
        lambda arrays: arrays.update({"head.weight": np.zeros((2, 9))}),
    ],
)
def test_arrays_of_another_network_are_refused(change):
    arrays = modules.as_arrays(made("make"))
    change(arrays)
    with pytest.raises(ValueError, match=r"^arrays must be those of the module: "):
        modules.load_arrays(made("make"), arrays)


# Optimisers


@pytest.mark.parametrize("scale", [1.0, 1e-8])  # of epsilon's size: its place is seen
def test_adam_is_the_compiled_one(scale):
    rng = np.random.default_rng(0)
    parameters = rng.normal(size=50).astype(np.float32)
    theta = torch.nn.Parameter(torch.from_numpy(parameters.copy()))
    optimiser = modules.Adam([theta], lr=0.01)
    first, second = np.zeros((2, 50), np.float32)
    for step in range(1, 101):
        gradient = (scale * rng.normal(size=50)).astype(np.float32)
        networks.adam_step(parameters, gradient, first, second, step, 0.01)
        theta.grad = torch.from_numpy(gradient)
        optimiser.step()
    np.testing.assert_allclose(theta.detach().numpy(), parameters, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("scale", [1.0, 1e-5])
def test_rmsprop_is_the_compiled_one_from_a_mean_square_of_one(scale):
    rng = np.random.default_rng(0)
    parameters = rng.normal(size=50).astype(np.float32)
    theta = torch.nn.Parameter(torch.from_numpy(parameters.copy()))
    optimiser = modules.RMSProp([theta], lr=0.01)
    mean_square = np.ones(50, np.float32)
    for _ in range(100):
        gradient = (scale * rng.normal(size=50)).astype(np.float32)
        networks.rmsprop_step(parameters, gradient, mean_square, 0.01)
        theta.grad = torch.from_numpy(gradient)
        optimiser.step()
    np.testing.assert_allclose(theta.detach().numpy(), parameters, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("kind", [modules.Adam, modules.RMSProp])
def test_what_has_no_gradient_stays(kind):
    moving, still = (torch.nn.Parameter(torch.ones(2)) for _ in range(2))
    moving.grad = torch.ones(2)
    kind([moving, still], lr=0.1).step()
    assert (moving < 1).all()
    assert (still == 1).all()


# Global states


def test_global_random_states_and_settings_are_put_back():
    def states():
        numpys = str(np.random.get_state())  # noqa: NPY002
        threads = torch.get_num_threads(), torch.get_deterministic_debug_mode()
        return torch.get_rng_state().tolist(), numpys, random.getstate(), threads

    before = states()
    for name in ("make", "with_dropout"):
        made(name)
    modules.perceptron((3, 4, 2), np.zeros(26, np.float32))

    def use():
        with modules.reproducible(1):
            assert torch.get_num_threads() == 1
            assert torch.are_deterministic_algorithms_enabled()
            torch.rand(3)
            raise KeyError("whatever happens")

    with pytest.raises(KeyError):
        use()
    assert states() == before


def test_what_is_drawn_is_a_function_of_the_seed():
    draws = []
    for seed in (0, 0, 1):
        with modules.reproducible(seed):
            draws.append(torch.rand(3).tolist())
        torch.rand(1)
    assert draws[0] == draws[1] != draws[2]
