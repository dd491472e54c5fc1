"""Experience replay: what is kept, what is drawn, and what of its cache is out of date."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from rl_core.kernels import replay
from rl_core.kernels.replay import NEVER, held, make_memory, sample, store


def filled(capacity, count):
    """A memory in which transition i has the reward i."""
    memory = make_memory(capacity, 2)
    for i in range(count):
        s = np.full(2, i, np.float32)
        store(memory, s, i % 3, float(i), s + 1, i % 5 == 0)
    return memory


@settings(deadline=None)
@given(st.integers(1, 12), st.integers(0, 40))
def test_the_newest_transitions_overwrite_the_oldest(capacity, count):
    memory = filled(capacity, count)
    n = held(memory)
    assert n == min(capacity, count)
    rewards = memory.rewards[:n]
    assert sorted(rewards) == list(range(count - n, count))
    np.testing.assert_array_equal(rewards % capacity, np.arange(n))
    np.testing.assert_array_equal(memory.observations[:n, 0], rewards)
    np.testing.assert_array_equal(memory.next_observations[:n, 1], rewards + 1)
    np.testing.assert_array_equal(memory.actions[:n], rewards.astype(int) % 3)
    np.testing.assert_array_equal(memory.ends[:n], rewards % 5 == 0)


def test_what_is_stored_is_copied():
    memory, s = make_memory(2, 2), np.ones(2, np.float32)
    store(memory, s, 0, 1.0, s, False)
    s[:] = 7
    assert (memory.observations[0] == 1).all()
    assert (memory.next_observations[0] == 1).all()


def test_a_new_transition_has_no_value_yet():
    memory = filled(3, 3)
    memory.stamps[:] = 4
    store(memory, np.zeros(2, np.float32), 0, 0.0, np.zeros(2, np.float32), False)
    assert memory.stamps.tolist() == [NEVER, 4, 4]


@pytest.mark.parametrize(("capacity", "count"), [(50, 20), (50, 50), (50, 73)])
def test_sampling_is_uniform_over_what_is_held_and_over_nothing_else(capacity, count):
    memory, slots = filled(capacity, count), np.empty(20_000, np.int64)
    sample(memory, np.random.default_rng(0).random(20_000), slots)
    rewards, counts = np.unique(memory.rewards[slots], return_counts=True)
    np.testing.assert_array_equal(rewards, np.arange(max(0, count - capacity), count))
    assert stats.chisquare(counts).pvalue > 1e-3


@settings(deadline=None)
@given(st.integers(1, 5000), st.floats(0, 1, exclude_max=True))
def test_every_uniform_leads_to_a_slot_that_is_held(count, u):
    memory, slots = make_memory(5000, 1), np.empty(2, np.int64)
    memory.stored[0] = count
    replay.sample(memory, np.array([u, np.nextafter(1, 0)]), slots)
    assert 0 <= slots[0] < count
    assert slots[1] == count - 1
