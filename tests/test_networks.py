"""Networks against torch's autograd and optimisers, finite differences and arithmetic by hand."""

import random
from itertools import pairwise

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from rl_core import modules
from rl_core.kernels import networks

ARCHITECTURES = [(6, 10, 20, 3), (2, 10, 3), (3, 5), (1, 1, 1), (4, 16, 16, 16, 2)]
BATCHES = [1, 2, 31, 32, 33, 100, 512]


def drawn(sizes, n, seed=0):
    """Parameters with non-zero biases, inputs, and derivatives of a loss by the outputs."""
    rng = np.random.default_rng(seed)
    parameters = networks.xavier_uniform(sizes, rng)
    parameters += rng.normal(0, 0.1, parameters.size).astype(np.float32)
    inputs = rng.normal(size=(n, sizes[0])).astype(np.float32)
    return parameters, inputs, rng.normal(size=(n, sizes[-1])).astype(np.float32)


def gradient_of(sizes, parameters, inputs, output_gradient):
    n = networks.padded(len(inputs))
    units, deltas = np.zeros((2, sum(sizes), n), np.float32)
    units[: sizes[0], : len(inputs)] = inputs.T
    deltas[-sizes[-1] :, : len(inputs)] = output_gradient.T
    gradient = np.empty_like(parameters)
    networks.forward(np.array(sizes), parameters, units, n)
    networks.backward(np.array(sizes), parameters, units, deltas, gradient, n)
    return gradient


def plain_loss(sizes, parameters, inputs, output_gradient):
    """The loss whose derivatives by the outputs are given, in float64 and without the package."""
    h, start = np.asarray(inputs, float), 0
    for n_in, n_out in pairwise(sizes):
        weight = parameters[start : start + n_in * n_out].reshape(n_out, n_in)
        start += n_in * n_out
        z = h @ weight.T + parameters[start : start + n_out]
        start += n_out
        h = np.maximum(z, 0)
    return float((z * output_gradient).sum())


@pytest.mark.parametrize("sizes", ARCHITECTURES)
@pytest.mark.parametrize("n", BATCHES)
def test_outputs_are_torchs(sizes, n):
    parameters, inputs, _ = drawn(sizes, n)
    with torch.no_grad():
        expected = modules.perceptron(sizes, parameters)(torch.from_numpy(inputs)).numpy()
    found = networks.output(sizes, parameters, inputs)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("sizes", ARCHITECTURES)
@pytest.mark.parametrize("n", BATCHES)
def test_gradient_is_autograds(sizes, n):
    parameters, inputs, output_gradient = drawn(sizes, n)
    module = modules.perceptron(sizes, parameters)
    (module(torch.from_numpy(inputs)) * torch.from_numpy(output_gradient)).sum().backward()
    expected = np.concatenate([p.grad.numpy().ravel() for p in module.parameters()])
    found = gradient_of(sizes, parameters, inputs, output_gradient)
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-4 * np.sqrt(n))


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.lists(st.integers(1, 6), min_size=2, max_size=4), st.integers(1, 40), st.integers(0, 99))
def test_gradient_is_that_of_finite_differences(sizes, n, seed):
    parameters, inputs, output_gradient = drawn(sizes, n, seed)
    found = gradient_of(sizes, parameters, inputs, output_gradient)
    exact = parameters.astype(float)
    for i in range(parameters.size):
        below, above = exact.copy(), exact.copy()
        below[i] -= 1e-6
        above[i] += 1e-6
        differences = plain_loss(sizes, above, inputs, output_gradient) - plain_loss(
            sizes, below, inputs, output_gradient
        )
        assert found[i] == pytest.approx(differences / 2e-6, rel=2e-3, abs=2e-3)


@pytest.mark.parametrize("sizes", ARCHITECTURES)
def test_one_input_gives_the_bits_of_a_batch(sizes):
    parameters, inputs, _ = drawn(sizes, 100)
    batch = networks.output(sizes, parameters, inputs)
    units = np.empty(sum(sizes), np.float32)
    for x, expected in zip(inputs, batch, strict=True):
        units[: sizes[0]] = x
        networks.forward_one(np.array(sizes), parameters, units)
        np.testing.assert_array_equal(units[-sizes[-1] :], expected)


def test_initial_weights_are_xavier_uniform_and_biases_zero():
    sizes = (60, 100, 20)
    layers = networks.unpack(sizes, networks.xavier_uniform(sizes, np.random.default_rng(0)))
    for layer, fans in enumerate((160, 120)):
        weight = layers[f"layer{layer}.weight"]
        bound = np.sqrt(6 / fans)
        assert np.abs(weight).max() <= np.float32(bound)
        assert weight.std() == pytest.approx(bound / np.sqrt(3), rel=0.03)
        assert weight.mean() == pytest.approx(0, abs=0.02 * bound)
        assert not layers[f"layer{layer}.bias"].any()


def test_initial_weights_are_a_function_of_the_stream():
    first, again, other = (
        networks.xavier_uniform((4, 8, 2), np.random.default_rng(seed)) for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(first, again)
    weights = networks.trainable_mask((4, 8, 2), biases=False) == 1
    assert (first != other)[weights].all()


def test_unpacked_layers_compute_the_network_and_are_views():
    sizes, stack = (3, 4, 2), np.empty((5, 26), np.float32)
    rng = np.random.default_rng(0)
    stack[:] = rng.normal(size=stack.shape)
    layers = networks.unpack(sizes, stack)
    assert layers["layer0.weight"].shape == (5, 3, 4)
    x = rng.normal(size=(7, 3)).astype(np.float32)
    hidden = np.maximum(x @ layers["layer0.weight"] + layers["layer0.bias"][:, None], 0)
    outputs = hidden @ layers["layer1.weight"] + layers["layer1.bias"][:, None]
    for row, expected in zip(stack, outputs, strict=True):
        np.testing.assert_allclose(networks.output(sizes, row, x), expected, atol=1e-6)
    layers["layer1.bias"][2] = 7.0
    assert (stack[2, -2:] == 7.0).all()


@pytest.mark.parametrize("sizes", ARCHITECTURES)
def test_pack_undoes_unpack(sizes):
    parameters, _, _ = drawn(sizes, 1)
    found, vector = networks.pack(networks.unpack(sizes, parameters))
    assert found == sizes
    np.testing.assert_array_equal(vector, parameters)


@pytest.mark.parametrize(
    "layers", [{}, {"layer1.weight": np.ones((2, 2))}, {"layer0.weight": np.ones(3)}]
)
def test_pack_refuses_what_is_no_network(layers):
    with pytest.raises(ValueError, match=r"layer0\.weight"):
        networks.pack(layers)


def test_pack_refuses_layers_that_do_not_follow_each_other():
    layers = {"layer0.weight": np.ones((2, 3)), "layer1.weight": np.ones((4, 1))}
    with pytest.raises(ValueError, match=r"weights must each take .* got \[\(2, 3\), \(4, 1\)\]"):
        networks.pack(layers)


def test_adam_is_torchs_but_for_the_place_of_epsilon():
    rng = np.random.default_rng(0)
    parameters = rng.normal(size=50).astype(np.float32)
    tensor = torch.nn.Parameter(torch.from_numpy(parameters.copy()))
    optimiser = torch.optim.Adam([tensor], lr=0.01)
    first, second = np.zeros((2, 50), np.float32)
    for step in range(1, 101):
        gradient = rng.normal(size=50).astype(np.float32)
        networks.adam_step(parameters, gradient, first, second, step, 0.01)
        tensor.grad = torch.from_numpy(gradient)
        optimiser.step()
    np.testing.assert_allclose(parameters, tensor.detach().numpy(), rtol=1e-4, atol=1e-5)


def test_adam_by_hand():
    theta, first, second = 1.0, 0.0, 0.0
    parameters, m, v = np.ones(1, np.float32), *np.zeros((2, 1), np.float32)
    for t, g in enumerate((1e-8, -3e-8, 2e-8), start=1):  # of epsilon's size: its place is seen
        first, second = 0.9 * first + 0.1 * g, 0.999 * second + 0.001 * g * g
        rate = 0.5 * np.sqrt(1 - 0.999**t) / (1 - 0.9**t)
        theta -= rate * first / (np.sqrt(second) + 1e-8)
        networks.adam_step(parameters, np.array([g], np.float32), m, v, t, 0.5)
    assert parameters[0] == pytest.approx(theta, rel=1e-5)


def test_rmsprop_is_torchs_from_the_same_mean_square():
    rng = np.random.default_rng(0)
    parameters = rng.normal(size=50).astype(np.float32)
    tensor = torch.nn.Parameter(torch.from_numpy(parameters.copy()))
    optimiser = torch.optim.RMSprop([tensor], lr=0.01, alpha=0.9, eps=1e-10)
    mean_square = np.zeros(50, np.float32)
    for _ in range(100):
        gradient = rng.normal(size=50).astype(np.float32)
        networks.rmsprop_step(parameters, gradient, mean_square, 0.01)
        tensor.grad = torch.from_numpy(gradient)
        optimiser.step()
    np.testing.assert_allclose(parameters, tensor.detach().numpy(), rtol=1e-4, atol=1e-5)


def test_rmsprop_by_hand_from_tensorflows_mean_square_of_one():
    parameters, mean_square = np.zeros(1, np.float32), np.ones(1, np.float32)
    networks.rmsprop_step(parameters, np.array([2.0], np.float32), mean_square, 0.1)
    assert mean_square[0] == pytest.approx(0.9 + 0.1 * 4)
    assert parameters[0] == pytest.approx(-0.1 * 2 / np.sqrt(1.3))


def test_masked_parameters_stay_where_they_are():
    sizes = (4, 8, 2)
    parameters, inputs, output_gradient = drawn(sizes, 20)
    before = parameters.copy()
    first, second = np.zeros((2, parameters.size), np.float32)
    mask = networks.trainable_mask(sizes, biases=False)
    for step in range(1, 6):
        gradient = gradient_of(sizes, parameters, inputs, output_gradient) * mask
        networks.adam_step(parameters, gradient, first, second, step, 0.01)
    np.testing.assert_array_equal(parameters != before, mask == 1)
    assert networks.trainable_mask(sizes, biases=True).all()
    assert mask.sum() == 4 * 8 + 8 * 2


@pytest.mark.parametrize("n", [1, 2, 3, 7, 10, 30])
def test_a_network_is_the_same_in_any_stack(n):
    """Forty steps of Adam for a stack of networks, each with batches of lengths of its own."""
    sizes, steps = (6, 10, 20, 3), 40

    def train(row):
        rng = np.random.default_rng(row)
        parameters = networks.xavier_uniform(sizes, rng)
        moments = np.zeros((2, parameters.size), np.float32)
        for step in range(1, steps + 1):
            inputs = rng.normal(size=(rng.integers(1, 200), 6)).astype(np.float32)
            target = rng.normal(size=(len(inputs), 3)).astype(np.float32)
            gradient = gradient_of(sizes, parameters, inputs, target)
            networks.adam_step(parameters, gradient, *moments, step, 1e-2)
            yield parameters

    stack = [train(row) for row in range(n)]
    for _ in range(steps):
        together = np.stack([next(member) for member in stack])
    for row in {0, n // 2, n - 1}:
        *_, alone = train(row)
        np.testing.assert_array_equal(together[row], alone)


def test_torchs_and_numpys_generators_are_left_alone():
    before = torch.get_rng_state(), str(np.random.get_state()), random.getstate()  # noqa: NPY002
    modules.perceptron((3, 4, 2), np.zeros(26, np.float32))
    networks.xavier_uniform((3, 4, 2), np.random.default_rng(0))
    assert torch.equal(before[0], torch.get_rng_state())
    assert before[1:] == (str(np.random.get_state()), random.getstate())  # noqa: NPY002
