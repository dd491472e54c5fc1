"""What is trained in one go is what the chapters ask for."""

from types import SimpleNamespace

import pandas as pd
import pytest

from studies import (
    continuous,
    continuous_causes,
    dqn,
    dqn_again,
    evaluation,
    evaluation_fresh,
    everything,
    own,
    q_learning_fresh,
    reinforce,
)

ASKING = [
    (dqn, dqn.learn),
    (dqn_again, dqn_again.learn),
    (dqn_again, dqn_again.learn_near),
    (reinforce, reinforce.learn),
    (reinforce, reinforce.learn_afresh),
    (evaluation, evaluation.learn),
    (evaluation, evaluation.take_times),
    (evaluation_fresh, evaluation_fresh.learn),
    (continuous, continuous.learn),
    (continuous, continuous.learn_fresh),
    (continuous_causes, continuous_causes.learn),
    (own, own.learn),
]


def work(plans):
    """Each arm with each seed, whatever the arm is called."""
    return {
        (arm.algorithm_name, str(arm.env), repr(arm.config), arm.episodes, arm.snapshots, seed)
        for arms, seeds in plans
        for arm in arms
        for seed in seeds
    }


@pytest.fixture
def asked(monkeypatch):
    """What the chapters would run."""
    plans = []

    def record(arms, *, seeds, **_):
        plans.append((arms, seeds))
        return SimpleNamespace(provenance=pd.DataFrame())

    for study, learn in ASKING:
        monkeypatch.setattr(study, "run", record)
        learn("store")
    return plans


def test_nothing_that_chapters_3_to_7_ask_for_is_forgotten_or_too_much(asked):
    others = [plan for plan in everything.plans() if "_on_model" not in work([plan]).pop()[0]]
    assert work(others) == work(asked)


def test_chapter_2_finds_its_sweeps_and_the_seeds_that_choose():
    """What it judges in view of these it trains itself."""
    planned = work(everything.plans())
    assert work([(q_learning_fresh.PROBABILITIES.values(), q_learning_fresh.CHOOSING)]) < planned
    assert work([(q_learning_fresh.RISE_AND_HIGH, q_learning_fresh.MANY)]) < planned


def test_arms_with_the_same_seeds_follow_each_other():
    plans = everything.plans()
    found = everything.by_seeds(plans)
    assert work((arms, seeds) for seeds, arms in found.items()) == work(plans)
    assert len(found) < len(plans)
    for arms in found.values():
        assert len({arm.name for arm in arms}) == len(arms)
