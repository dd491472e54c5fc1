"""Intervals, fractions and criteria against exact distributions and other formulas."""

import itertools
import math
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import stats

from rl_core.statistics import (
    bootstrap_interval,
    iqm,
    learned,
    probability_of_improvement,
    proportion_interval,
)

STATISTICS = [np.median, np.mean, iqm]
numbers = st.floats(-1e6, 1e6)
samples = hnp.arrays(np.float64, st.integers(1, 12), elements=numbers)
quick = settings(max_examples=40, deadline=None)


def generator(seed=0):
    return np.random.default_rng(seed)


# --- interquartile mean ---------------------------------------------------------------------------


def test_iqm_is_the_mean_of_the_middle_half():
    assert iqm([8.0, 1.0, 2.0, 900.0, 3.0, 4.0, 5.0, -80.0]) == pytest.approx((2 + 3 + 4 + 5) / 4)
    # 30 seeds: floor(30 / 4) = 7 go at either end
    values = generator().permutation(np.arange(30.0) ** 2)
    assert iqm(values) == pytest.approx(np.mean(np.arange(7, 23) ** 2))


def test_iqm_works_along_an_axis_and_lets_nan_through():
    values = generator().normal(size=(9, 4))
    values[3, 2] = np.nan
    result = iqm(values, axis=0)
    assert result.shape == (4,)
    assert np.isnan(result).tolist() == [False, False, True, False]
    np.testing.assert_allclose(iqm(values.T, axis=1), result)
    np.testing.assert_allclose(iqm(values), result)  # over the seeds, which are the rows
    assert result[0] == pytest.approx(np.sort(values[:, 0])[2:7].mean())


# --- bootstrap ------------------------------------------------------------------------------------


def every_draw(values, statistic):
    """All n^n equally likely draws: the distribution that the bootstrap samples from."""
    return np.array([statistic(np.array(d)) for d in itertools.product(values, repeat=len(values))])


@pytest.mark.parametrize("statistic", STATISTICS)
@pytest.mark.parametrize("values", [[3.0, -1.0, 10.0, 4.5], [2.0, 2.0, 7.0, 1.0, 30.0]])
def test_limits_are_quantiles_of_the_exact_bootstrap_distribution(statistic, values):
    exact = every_draw(values, statistic)
    level = 0.8
    interval = bootstrap_interval(values, statistic, rng=generator(), level=level, resamples=50_000)
    assert interval.estimate == pytest.approx(float(statistic(np.array(values))))
    for limit, quantile in ((interval.low, 0.1), (interval.high, 0.9)):
        # The limit occurs, and no more than the quantile's share lies on its far side (up to
        # the noise of 50,000 draws: 0.005 is three standard deviations).
        assert np.isclose(exact, limit).any()
        assert np.mean(exact < limit - 1e-9) <= quantile + 0.005
        assert np.mean(exact <= limit + 1e-9) >= quantile - 0.005


@pytest.mark.parametrize("statistic", STATISTICS)
def test_agrees_with_scipy(statistic):
    values = generator(3).exponential(100.0, size=30)
    ours = bootstrap_interval(values, statistic, rng=generator(1), resamples=40_000)
    theirs = stats.bootstrap(
        (values,), statistic, method="percentile", n_resamples=40_000, rng=generator(2)
    ).confidence_interval
    spread = theirs.high - theirs.low
    assert abs(ours.low - theirs.low) < 0.05 * spread
    assert abs(ours.high - theirs.high) < 0.05 * spread


@pytest.mark.parametrize("statistic", STATISTICS)
def test_every_draw_is_the_statistic_of_the_drawn_seeds(statistic):
    values = generator(5).normal(size=(7, 3))
    interval = bootstrap_interval(values, statistic, rng=generator(9), resamples=1)
    counts = generator(9).multinomial(7, np.full(7, 1 / 7), size=1)[0]
    drawn = statistic(np.repeat(values, counts, axis=0), axis=0)
    # With one draw it is one limit and the estimate, which the interval holds, the other.
    np.testing.assert_allclose(interval.low, np.minimum(drawn, interval.estimate), rtol=1e-12)
    np.testing.assert_allclose(interval.high, np.maximum(drawn, interval.estimate), rtol=1e-12)


def test_the_same_seeds_are_drawn_at_every_point():
    values = generator(1).normal(size=(30, 1))
    # 130 points, more than are treated at once; points that differ by a shift get shifted limits
    curves = values + np.arange(130.0)
    interval = bootstrap_interval(curves, rng=generator(2), resamples=500)
    np.testing.assert_allclose(interval.low - np.arange(130.0), interval.low[0], atol=1e-9)
    np.testing.assert_allclose(interval.high - np.arange(130.0), interval.high[0], atol=1e-9)
    alone = bootstrap_interval(values[:, 0], rng=generator(2), resamples=500)
    assert (alone.low, alone.high) == (interval.low[0], interval.high[0])


@pytest.mark.parametrize(("statistic", "least"), [(np.mean, 0.90), (np.median, 0.90), (iqm, 0.89)])
def test_covers_the_truth_as_often_as_promised(statistic, least):
    # All experiments at once: each is a point of its own with 30 fresh seeds, true value 0.
    experiments = generator(11).normal(size=(30, 1000))
    interval = bootstrap_interval(experiments, statistic, rng=generator(12), resamples=1000)
    covered = np.mean((interval.low <= 0) & (interval.high >= 0))
    # The percentile interval at n = 30 is known to be a little short; 0.98 catches one too long.
    assert least < covered < 0.98
    short = bootstrap_interval(experiments, statistic, rng=generator(12), level=0.5, resamples=1000)
    assert 0.44 < np.mean((short.low <= 0) & (short.high >= 0)) < 0.58


@quick
@given(samples, st.sampled_from(STATISTICS), st.integers(0, 100))
def test_interval_holds_the_estimate_within_the_data(values, statistic, seed):
    interval = bootstrap_interval(values, statistic, rng=generator(seed), level=0.99, resamples=200)
    slack = 1e-9 * (1 + np.abs(values).max())
    assert values.min() - slack <= interval.low <= interval.high <= values.max() + slack
    wider = bootstrap_interval(values, statistic, rng=generator(seed), level=0.999, resamples=200)
    assert wider.low <= interval.low
    assert wider.high >= interval.high


@quick
@given(samples, st.sampled_from(STATISTICS), st.integers(0, 100), st.integers(-3, 3))
def test_scaling_the_data_scales_the_interval(values, statistic, seed, exponent):
    scale = 2.0**exponent
    plain = bootstrap_interval(values, statistic, rng=generator(seed), resamples=100)
    scaled = bootstrap_interval(scale * values, statistic, rng=generator(seed), resamples=100)
    np.testing.assert_allclose(scaled, scale * np.array(plain), rtol=1e-9, atol=1e-9)


@quick
@given(samples, st.sampled_from(STATISTICS), st.integers(0, 100))
def test_negating_the_data_mirrors_the_interval(values, statistic, seed):
    plain = bootstrap_interval(values, statistic, rng=generator(seed), resamples=100)
    mirrored = bootstrap_interval(-values, statistic, rng=generator(seed), resamples=100)
    np.testing.assert_allclose(
        [-mirrored.estimate, -mirrored.high, -mirrored.low], plain, rtol=1e-9, atol=1e-9
    )


def test_same_generator_same_bits_and_the_global_state_is_untouched():
    values = generator().normal(size=30)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    assert bootstrap_interval(values, rng=generator(4)) == bootstrap_interval(
        values, rng=generator(4)
    )
    assert bootstrap_interval(values, rng=generator(4)) != bootstrap_interval(
        values, rng=generator(5)
    )
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_seeds_that_never_get_there_count_as_infinity():
    values = [100.0, 110.0, 120.0, 130.0, np.inf]
    interval = bootstrap_interval(values, rng=generator(), level=0.95)
    assert interval.estimate == 120
    assert 100 <= interval.low <= 110
    assert interval.high == np.inf  # three of five draws are the infinite seed often enough
    few = bootstrap_interval([*np.arange(29.0), np.inf], rng=generator())
    assert few.high < 29
    assert bootstrap_interval([*np.arange(29.0), np.inf], iqm, rng=generator()).high < 29
    assert bootstrap_interval([*np.arange(29.0), np.inf], np.mean, rng=generator()).high == np.inf
    lost = bootstrap_interval([np.inf, np.inf, 1.0], rng=generator())
    assert lost == (np.inf, 1.0, np.inf)


@pytest.mark.parametrize("statistic", STATISTICS)
def test_a_nan_is_not_left_out_silently(statistic):
    curves = generator().normal(size=(30, 3))
    curves[7, 1] = np.nan
    interval = bootstrap_interval(curves, statistic, rng=generator(), resamples=50)
    for part in interval:
        assert np.isnan(part).tolist() == [False, True, False]
    with pytest.raises(ValueError, match="values must be without NaN"):
        bootstrap_interval(curves[:, 1], statistic, rng=generator(), resamples=5)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"values": []}, ValueError, "values must be not empty"),
        ({"values": np.zeros((2, 2, 2))}, ValueError, r"values must be .*, got \(2, 2, 2\)"),
        ({"values": [[1.0], [1.0, 2.0]]}, ValueError, "values must be an array of numbers"),
        ({"values": 5.0}, ValueError, r"values must be .*, got \(\)"),
        ({"values": ["1", "2"]}, TypeError, "values must be an array of numbers"),
        ({"values": [1j, 2]}, TypeError, "values must be an array of numbers"),
        ({"values": [np.inf, -np.inf], "statistic": np.mean}, ValueError, "both signs"),
        ({"statistic": np.max}, ValueError, "statistic must be np.median.*got .*max"),
        ({"level": 1.0}, ValueError, "level must be .*, got 1.0"),
        ({"level": 95}, ValueError, "level must be .*, got 95"),
        ({"resamples": 0}, ValueError, "resamples must be .*, got 0"),
        ({"resamples": 10.0}, TypeError, "resamples must be .*, got 10.0"),
        ({"rng": 7}, TypeError, "rng must be .*, got 7"),
        ({"rng": np.random}, TypeError, "rng must be .*, got "),
    ],
)
def test_bootstrap_refuses(change, error, message):
    arguments = {"values": [1.0, 2.0], "statistic": np.median, "rng": generator()} | change
    with pytest.raises(error, match=message):
        bootstrap_interval(**arguments)


extremes = st.one_of(numbers, st.sampled_from([np.inf, -np.inf, 0.1, 1 / 3, 1e-300]))


@quick
@given(
    hnp.arrays(np.float64, st.integers(1, 12), elements=extremes),
    st.sampled_from(STATISTICS),
    st.sampled_from([1, 2, 200]),
)
def test_interval_holds_its_estimate_exactly(values, statistic, resamples):
    """Whatever the data are, infinities of both signs included, or it is refused by name."""
    arguments = {"statistic": statistic, "rng": generator(), "resamples": resamples}
    with np.errstate(invalid="ignore"):
        defined = not np.isnan(statistic(values) if statistic is not iqm else _middle(values))
    if defined:
        found = bootstrap_interval(values, **arguments)
        assert found.low <= found.estimate <= found.high
    else:
        with pytest.raises(ValueError, match="values must be without infinities of both signs"):
            bootstrap_interval(values, **arguments)


def _middle(values):
    cut = len(values) // 4
    return np.mean(np.sort(values)[cut : len(values) - cut])


@pytest.mark.parametrize("statistic", STATISTICS)
@pytest.mark.parametrize("value", [0.1, 1 / 3, 1e300, -7.3, np.inf, -np.inf])
@pytest.mark.parametrize("seeds", [1, 2, 3, 7, 30])
def test_of_equal_values_the_estimate_is_that_value(statistic, value, seeds):
    estimate, low, high = bootstrap_interval([value] * seeds, statistic, rng=generator())
    assert low <= estimate <= high
    for limit in (low, estimate, high):
        assert limit == pytest.approx(value, rel=1e-15)


def test_a_draw_between_both_infinities_reaches_as_far_as_either():
    """The median of -inf, 1, 2, inf is 1.5; of many draws the middle is an infinity, or none."""
    found = bootstrap_interval([-np.inf, 1.0, 2.0, np.inf], rng=generator())
    assert found == (1.5, -np.inf, np.inf)


@pytest.mark.parametrize(
    "kind", ["int8", "uint8", "int64", "float16", "float32", "longdouble", "object", "bool"]
)
def test_numbers_of_any_type_are_the_same_numbers(kind):
    plain = [1.0, 0.0, 1.0, 1.0, 0.0]
    given = np.array([Fraction(x) for x in plain] if kind == "object" else plain, kind)
    for statistic in STATISTICS:
        assert bootstrap_interval(given, statistic, rng=generator()) == bootstrap_interval(
            plain, statistic, rng=generator()
        )
        assert iqm(given) == iqm(plain)
    numbers_of_kind = (np.asarray(plain, kind).tolist(), pd.Series(plain).astype(kind))
    for arm in (given, *numbers_of_kind):
        assert bootstrap_interval(arm, np.mean, rng=generator()).estimate == pytest.approx(0.6)
    assert learned([given], np.float32(1), window=np.uint8(5)).tolist() == [True]


def test_fractions_take_integers_of_any_width():
    assert proportion_interval(np.uint8(27), np.int8(30)) == proportion_interval(27, 30)
    with pytest.raises(TypeError, match="successes must be an integer"):
        proportion_interval(True, 30)


# --- comparing arms -------------------------------------------------------------------------------


def test_probability_of_improvement_is_the_mann_whitney_statistic():
    a = generator(1).integers(0, 10, size=30).astype(float)
    b = generator(2).integers(2, 12, size=20).astype(float)
    estimate, low, high = probability_of_improvement(a, b, rng=generator())
    assert estimate == pytest.approx(stats.mannwhitneyu(b, a).statistic / (30 * 20))
    assert 0 <= low < estimate < high <= 1
    assert probability_of_improvement(b, a, rng=generator()).estimate == pytest.approx(1 - estimate)


def test_probability_of_improvement_resamples_the_seeds_of_both_arms():
    a, b = generator(1).normal(size=30), generator(2).normal(0.3, size=25)
    ours = probability_of_improvement(a, b, rng=generator(), resamples=20_000)

    def better(a, b, axis):
        return np.mean(a[..., :, None] < b[..., None, :], axis=(-2, -1))

    theirs = stats.bootstrap(
        (a, b), better, method="percentile", n_resamples=5000, rng=generator(), batch=200
    ).confidence_interval
    assert ours.low == pytest.approx(theirs.low, abs=0.015)
    assert ours.high == pytest.approx(theirs.high, abs=0.015)


def test_probability_of_improvement_takes_infinities_and_refuses_nan():
    assert probability_of_improvement([1.0, np.inf], [np.inf], rng=generator()).estimate == 0.75
    with pytest.raises(ValueError, match="b must be without NaN"):
        probability_of_improvement([1.0], [np.nan], rng=generator())
    with pytest.raises(ValueError, match="a must be not empty"):
        probability_of_improvement([], [1.0], rng=generator())


def test_arms_in_which_no_seed_gets_there_are_no_evidence_for_equality():
    nobody = np.full(30, np.inf)
    assert probability_of_improvement(nobody, nobody, rng=generator()) == (0.5, 0.0, 1.0)
    one = np.append(nobody[1:], 7.0)
    estimate, low, high = probability_of_improvement(one, nobody, rng=generator())
    assert 0.5 <= low < estimate < high < 1


# --- fractions ------------------------------------------------------------------------------------


@given(st.integers(1, 200), st.data(), st.sampled_from([0.8, 0.95, 0.99]))
def test_wilson_limits_solve_the_score_equation(trials, data, level):
    successes = data.draw(st.integers(0, trials))
    estimate, low, high = proportion_interval(successes, trials, level=level)
    assert estimate == successes / trials
    # Wilson (1927): (estimate - p)^2 = z^2 p (1 - p) / n, a quadratic in p
    z2 = stats.norm.ppf((1 + level) / 2) ** 2 / trials
    roots = np.roots([1 + z2, -(2 * estimate + z2), estimate**2])
    np.testing.assert_allclose([low, high], np.sort(roots.real), atol=1e-7)


def test_wilson_interval_covers_as_often_as_promised_at_thirty_seeds():
    # Exactly, by summing over all outcomes
    for p in np.linspace(0.05, 0.95, 19):
        intervals = [proportion_interval(k, 30) for k in range(31)]
        covered = [low <= p <= high for _, low, high in intervals]
        assert 0.91 < np.sum(stats.binom.pmf(np.arange(31), 30, p)[covered]) < 0.99


@pytest.mark.parametrize(
    ("successes", "trials", "level", "message"),
    [
        (5, 4, 0.95, "successes must be an integer from 0 to 4, got 5"),
        (-1, 4, 0.95, "successes must be an integer from 0 to 4, got -1"),
        (0, 0, 0.95, "trials must be an integer from 1, got 0"),
        (1, 2, 1.5, "level must be .*, got 1.5"),
    ],
)
def test_fractions_refuse(successes, trials, level, message):
    with pytest.raises(ValueError, match=message):
        proportion_interval(successes, trials, level=level)


def test_learned_looks_at_the_median_of_the_last_episodes():
    curves = np.full((5, 10), 500.0)
    curves[0, -4:] = 100  # all of the window
    curves[1, -3:] = [100, 900, 100]  # most of the window, and of 100 and 500 not half
    curves[2, :-4] = 100  # forgot
    curves[3, -4:] = [100, 100, 100, np.nan]  # stopped
    curves[4, -4:] = [np.inf, 100, 100, 100]
    assert learned(curves, 100, window=4).tolist() == [True, False, False, False, True]
    assert learned(curves[:, :6], 100, window=4).tolist() == [False, False, True, False, False]
    assert learned([[-np.inf, np.inf]], 100, window=2).tolist() == [False]  # no number at all


def test_learned_refuses():
    with pytest.raises(ValueError, match=r"window must be an integer from 1 to 4, got"):
        learned(np.zeros((2, 4)), 1.0, window=5)
    with pytest.raises(ValueError, match=r"curves must be .*, got \(4,\)"):
        learned(np.zeros(4), 1.0, window=5)
    with pytest.raises(ValueError, match="threshold must be without NaN"):
        learned(np.zeros((2, 8)), math.nan, window=1)


@pytest.mark.parametrize("seeds", [3, 7, 29, 30])
def test_certain_improvement_is_exactly_certain(seeds):
    rng = np.random.default_rng(0)
    found = probability_of_improvement(np.zeros(seeds), np.ones(seeds), rng=rng, resamples=500)
    assert found == (1.0, 1.0, 1.0)
