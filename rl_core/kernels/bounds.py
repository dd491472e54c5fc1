"""How far values can be from the optimal ones, and how long it takes to be nearer: contractions.

A sweep V → V' with the contraction factor γ leaves |V' - V*| ≤ γ / (1 - γ) |V' - V|, in the largest
entry. Two things are added to it: rows of probabilities may add up to 1 + 1e-9, as an `MDP` lets
them, so that the factor is γ (1 + 1e-9), and each backup is off by rounding.
"""

import math

from rl_core import checks

SUM_TOLERANCE = 1e-9
"""How far probabilities may add up to from 1."""

LARGEST_GAMMA = 1 - 1e-8
"""The largest discount for which there is a bound, whatever the rows of probabilities add up to."""

LARGEST_RETURN = 1e150
"""Returns up to this can be squared."""

CERTAIN, TRIED = 1_000_000, 100_000
"""If γ allows for more than a million sweeps, only 100,000 are tried: enough if episodes end."""


def discount(gamma: object) -> float:
    """Return the discount, checked to be one with which values can be bounded.

    Examples
    --------
    >>> from rl_core.kernels.bounds import discount
    >>> discount(1)
    Traceback (most recent call last):
    ValueError: gamma must be a number from 0 below 1, got 1
    """
    found = checks.number("gamma", gamma, 0, below=1)
    checks.require(found <= LARGEST_GAMMA, "gamma", gamma, "a number from 0 to 1 - 1e-8")
    return found


def check_returns(name: str, reward: float, gamma: float) -> None:
    """Raise a ValueError if the returns of rewards up to `reward` cannot be summed in float64."""
    largest = reward / (1 - gamma)
    checks.require(largest <= LARGEST_RETURN, name, largest, f"of returns up to {LARGEST_RETURN}")


def rounding_error(n_successors: int, magnitude: float) -> float:
    """Bound the rounding of one backup, with rewards and values up to `magnitude`.

    Each product, sum and quotient is off by ε/2 at most, relative to its size, with ε = 2⁻⁵²: 2 K
    of them for the reward, K + 2 for a value, and the quotient by 1 - γ l comes to one more. That
    is (3 K + 3) ε/2, rounded up to 2 (K + 1) ε.

    Examples
    --------
    >>> from rl_core.kernels.bounds import rounding_error
    >>> rounding_error(3, magnitude=1.0) == 8 * 2.0**-52
    True
    """
    return 2 * (n_successors + 1) * 2.0**-52 * magnitude


def error_bound(residual: float, gamma: float, rounding: float) -> float:
    """Bound |V' - V*| after a sweep that changed V by `residual`, in the largest entry.

    It is (γ residual + rounding) / (1 - γ), with room for sums above 1.

    Examples
    --------
    >>> from rl_core.kernels.bounds import error_bound
    >>> round(error_bound(residual=1e-5, gamma=0.9, rounding=0.0), 9)
    9e-05
    """
    factor = gamma * (1 + SUM_TOLERANCE)
    return (factor * residual + rounding) / (1 - factor)


def sweeps_allowed(change: float, target: float, gamma: float) -> int:
    """After how many sweeps a change contracted by γ is below `target`, or `TRIED` if too many.

    Examples
    --------
    >>> from rl_core.kernels.bounds import sweeps_allowed
    >>> sweeps_allowed(1.0, 1e-6, gamma=0.5), sweeps_allowed(1.0, 1e-6, gamma=1 - 1e-8)
    (21, 100000)
    """
    if gamma == 0 or change <= target:
        return 1
    needed = 1 + math.ceil((math.log(target) - math.log(change)) / math.log(gamma))
    return needed if needed <= CERTAIN else TRIED
