"""One update of a Q-network: targets by hand, exact gradients, and the compiled against torch."""

import numpy as np
import pytest
import torch

from rl_core import modules
from rl_core.dqn import DQNConfig, TorchLearner
from rl_core.exploration import schedule_state
from rl_core.kernels import networks, q_update
from rl_core.kernels.q_update import COPIES, UPDATES, Settings, make_learner
from rl_core.kernels.replay import held, make_memory, sample, store


@pytest.fixture(autouse=True)
def _reproducible():
    with modules.reproducible():
        yield


def settings(**changes):
    defaults = {name: getattr(DQNConfig(), name) for name in Settings._fields[:7]}
    defaults |= {"adam": False, "through_end": False, "n_actions": 3, "gamma": 0.9}
    return Settings(**{**defaults, "copy_every": 10, "batch_size": 4, **changes})


def learner_of(sizes, way, seed=0, biases=True):
    parameters = networks.xavier_uniform(sizes, np.random.default_rng(seed))
    if biases:
        parameters += np.random.default_rng(1).normal(0, 0.1, parameters.size).astype(np.float32)
    return make_learner(sizes, parameters, way, schedule_state(0.1), biases=biases)


def both_learners(sizes, way, biases=True):
    """The compiled learner and torch's, from the same weights."""
    compiled = learner_of(sizes, way, biases=biases)
    network = modules.perceptron(sizes, compiled.parameters.copy(), biases)
    return compiled, TorchLearner(network, way, schedule_state(0.1))


def transition(rng, n):
    s, following = rng.normal(size=(2, n)).astype(np.float32)
    return s, int(rng.integers(3)), rng.normal(), following, rng.random() < 0.3


def filled(rng, capacity, count, n):
    memory = make_memory(capacity, n)
    for _ in range(count):
        store(memory, *transition(rng, n))
    return memory


def gradient_of(learner, memory):
    """The gradient as the optimiser gets it, as one vector, zero where nothing is learned."""
    if not isinstance(learner, TorchLearner):
        q_update.loss_gradient(learner, memory)
        return learner.gradient * learner.trainable
    learner.optimiser.zero_grad()
    learner.loss(memory).backward()
    parts = [torch.zeros_like(p) if p.grad is None else p.grad for p in parameters_of(learner)]
    return np.concatenate([part.numpy().ravel() for part in parts])


def parameters_of(learner):
    return list(learner.network.parameters())


def vector(parameters):
    return np.concatenate([p.detach().numpy().ravel() for p in parameters])


@pytest.mark.parametrize("through_end", [False, True])
def test_targets_by_hand_on_a_terminal_a_truncated_and_an_ordinary_transition(through_end):
    """With one linear layer Q(s', a) = s' W: the values of s' = (1, 2) are 1, 9 and -1."""
    _, theta = networks.pack({"layer0.weight": np.array([[1, -1, 3], [0, 5, -2]], np.float32)})
    way = settings(batch_size=3, through_end=through_end)
    learner = make_learner((2, 3), theta, way, schedule_state(0.1), biases=True)
    memory, following = make_memory(5, 2), np.array([1, 2], np.float32)
    for terminated in (True, False, False):  # a truncated step is stored as any other
        store(memory, np.ones(2, np.float32), 1, -1.0, following, terminated)
    learner.slots[:] = [0, 1, 2]
    loss = q_update.loss_gradient(learner, memory)
    known = zip(memory.rewards, memory.next_values, memory.ends, strict=True)
    found = [q_update.target(*seen, way.gamma, through_end) for seen in list(known)[:3]]
    ordinary = -1.0 + 0.9 * 9.0
    expected = [ordinary if through_end else -1.0, ordinary, ordinary]
    np.testing.assert_allclose(found, expected)
    assert loss == pytest.approx(np.mean((np.array(expected) - 4.0) ** 2))  # Q(s, 1) = -1 + 5


@pytest.mark.parametrize("batch_size", [1, 32, 37, 512])
def test_loss_and_gradient_are_torch_s(batch_size):
    rng, way = np.random.default_rng(3), settings(batch_size=batch_size)
    compiled, stated = both_learners((6, 10, 20, 3), way)
    memory = filled(rng, 60, 60, 6)
    compiled.fixed[:] += rng.normal(0, 0.1, compiled.fixed.size).astype(np.float32)
    with torch.no_grad():
        fixed = modules.perceptron((6, 10, 20, 3), compiled.fixed.copy())
        stated.fixed.load_state_dict(fixed.state_dict())
    sample(memory, rng.random(batch_size), compiled.slots)
    stated.slots[:] = compiled.slots
    loss = q_update.loss_gradient(compiled, memory)
    assert loss == pytest.approx(stated.loss(memory).item(), rel=1e-5)
    found, expected = gradient_of(compiled, memory), gradient_of(stated, memory)
    assert np.linalg.norm(found - expected) <= 1e-5 * np.linalg.norm(expected)


def test_the_gradient_is_the_loss_s_by_finite_differences():
    rng, way = np.random.default_rng(4), settings(batch_size=8)
    learner, memory = learner_of((2, 5, 3), way), filled(rng, 8, 8, 2)
    learner.slots[:] = np.arange(8)
    q_update.loss_gradient(learner, memory)
    gradient, theta = learner.gradient.copy(), learner.parameters.copy()
    for i in range(theta.size):
        losses = []
        for sign in (1, -1):
            learner.parameters[:] = theta
            learner.parameters[i] += sign * np.float32(1e-2)
            losses.append(q_update.loss_gradient(learner, memory))
        assert gradient[i] == pytest.approx((losses[0] - losses[1]) / 2e-2, abs=2e-2)


@pytest.mark.parametrize("biases", [True, False])
@pytest.mark.parametrize("through_end", [False, True])
@pytest.mark.parametrize("adam", [False, True], ids=["rmsprop", "adam"])
def test_fifty_updates_are_those_of_torch(adam, through_end, biases):
    """The memory of 12 wraps, so that a cached V would outlive its transition; torch has no cache.

    Each learns by itself. Gradients agree to 1e-5 of their norm and parameters to 1e-4.
    """
    rng = np.random.default_rng(5)
    way = settings(batch_size=64, copy_every=7, adam=adam, through_end=through_end)
    compiled, stated = both_learners((2, 10, 20, 3), way, biases)
    memory = filled(rng, 12, 5, 2)
    start = compiled.parameters.copy()
    for count in range(1, 51):
        store(memory, *transition(rng, 2))
        sample(memory, rng.random(64), compiled.slots)
        stated.slots[:] = compiled.slots
        found, expected = gradient_of(compiled, memory), gradient_of(stated, memory)
        assert np.linalg.norm(found - expected) <= 1e-5 * np.linalg.norm(expected), count
        assert q_update.update(compiled, memory)
        assert q_update.update(stated, memory)
        theta = vector(parameters_of(stated))
        np.testing.assert_allclose(compiled.parameters, theta, rtol=0, atol=1e-4)
        fixed = vector(stated.fixed.parameters())
        np.testing.assert_allclose(compiled.fixed, fixed, rtol=0, atol=1e-4)
    assert held(memory) == 12
    assert compiled.counts[:3].tolist() == stated.counts[:3].tolist()
    assert np.abs(compiled.parameters - start).max() > 0.02


@pytest.mark.parametrize("adam", [False, True], ids=["rmsprop", "adam"])
def test_constants_are_those_of_tensorflow_1_by_hand(adam):
    """One weight, one step and another of the gradient 2 (Q - y) with Q = w, y = 0."""
    way = settings(batch_size=1, adam=adam, learning_rate=0.1, n_actions=1, copy_every=100)
    learner = make_learner(
        (1, 1), np.array([3, 0], np.float32), way, schedule_state(0.1), biases=False
    )
    memory, s = make_memory(1, 1), np.ones(1, np.float32)
    store(memory, s, 0, 0.0, s, True)
    learner.slots[:] = 0
    w, m, v = 3.0, 0.0, 0.0 if adam else 1.0
    for t in (1, 2, 3):
        assert q_update.update(learner, memory)
        g = 2 * w
        if adam:
            m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g**2
            w -= 0.1 * np.sqrt(1 - 0.999**t) / (1 - 0.9**t) * m / (np.sqrt(v) + 1e-8)
        else:
            v = 0.9 * v + 0.1 * g**2
            w -= 0.1 * g / np.sqrt(v + 1e-10)
        assert learner.parameters[0] == pytest.approx(w, rel=1e-6)


def test_the_fixed_network_changes_only_at_copies():
    rng, way = np.random.default_rng(6), settings(batch_size=8, copy_every=5)
    learner, memory = learner_of((2, 4, 3), way), filled(rng, 20, 20, 2)
    kept, seen = learner.fixed.copy(), []
    for count in range(1, 21):
        sample(memory, rng.random(8), learner.slots)
        assert q_update.update(learner, memory)
        assert not np.array_equal(learner.parameters, kept)
        changed = not np.array_equal(learner.fixed, kept)
        assert changed == (count % 5 == 0)
        if changed:
            np.testing.assert_array_equal(learner.fixed, learner.parameters)
            seen.append(int(learner.counts[COPIES]))
        kept = learner.fixed.copy()
    assert seen == [1, 2, 3, 4]


@pytest.mark.parametrize("which", [0, 1], ids=["compiled", "torch"])
def test_a_loss_that_is_not_finite_changes_nothing(which):
    rng, way = np.random.default_rng(7), settings(batch_size=8)
    learner, memory = both_learners((2, 4, 3), way)[which], filled(rng, 20, 20, 2)
    memory.rewards[3] = 1e300
    learner.slots[:] = 3
    before = [p.detach().numpy().copy() for p in parameters_of(learner)] if which else []
    before = before or [learner.parameters.copy()]
    assert not q_update.update(learner, memory)
    after = parameters_of(learner) if which else [torch.from_numpy(learner.parameters)]
    for old, new in zip(before, after, strict=True):
        np.testing.assert_array_equal(old, new.detach().numpy())
    assert learner.counts[UPDATES] == 0


def test_values_are_the_same_from_either_learner():
    rng = np.random.default_rng(8)
    compiled, stated = both_learners((2, 10, 20, 3), settings())
    for s in rng.normal(size=(20, 2)).astype(np.float32):
        found, expected = q_update.q_values(compiled, s), q_update.q_values(stated, s)
        assert found.dtype == expected.dtype == np.float64
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)
