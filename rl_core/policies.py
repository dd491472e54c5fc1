"""What a user writes down of a policy: its network, and how outputs become actions.

- `MLP`: a plain perceptron, which also runs compiled; `Module`: any `torch.nn.Module`, by the
  import path of a function that makes it.
- `Categorical`: pi(k|s) = exp(y_k) / sum_j exp(y_j), with one output y_k an action.
- `Gaussian`: a_k ~ N(mu_k(s), sigma_k^2) for every component k of a continuous action.

Sources: R. S. Sutton and A. G. Barto, Reinforcement Learning: An Introduction (2018), sections 13.1
(soft-max in action preferences) and 13.7 (Gaussian policies).
"""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from rl_core.checks import fields, instance, integers, one_of, optional, positive, require, truth
from rl_core.identity import code_behind, imported
from rl_core.kernels.arrays import F32
from rl_core.kernels.likelihood import Policy
from rl_core.kernels.networks import trainable_mask, xavier_uniform

ENGINES = ("compiled", "torch")
"""What learns: machine code for a plain perceptron, or torch for any network."""


@dataclass(frozen=True)
class MLP:
    """A multilayer perceptron with rectified linear units.

    h_0 = s, h_{l+1} = max(W_l h_l + b_l, 0), and the last layer's output is not rectified. Weights
    begin Xavier-uniform, biases at zero.

    Attributes
    ----------
    hidden : tuple of int
        Widths of the hidden layers; () for a linear network.
    biases : bool
        Whether biases are learned; else they stay zero.

    Raises
    ------
    TypeError, ValueError
        For any other value.

    Examples
    --------
    >>> from rl_core.policies import MLP
    >>> MLP((10, 20)).biases
    True
    """

    hidden: tuple[int, ...] = (10, 20)
    biases: bool = True

    def __post_init__(self) -> None:
        fields(self, hidden=(integers, 1), biases=(truth,))


@dataclass(frozen=True)
class Module:
    """Any torch network, named by the function that makes it.

    Attributes
    ----------
    function : str
        Import path "module:name" of a function `(n_inputs, n_outputs) -> torch.nn.Module`, whose
        output for inputs of shape (batch, n_inputs) has the shape (batch, n_outputs).
    code : str
        Digest of the function's source and of what it imports, so that an edited network counts as
        another one.

    Raises
    ------
    TypeError, ValueError
        There is no such function.

    Examples
    --------
    >>> from rl_core.policies import Module
    >>> Module("torch.nn:Linear").function
    'torch.nn:Linear'
    """

    function: str
    code: str = field(init=False, repr=False)

    def __post_init__(self) -> None:
        found = imported("function", self.function)
        require(callable(found), "function", self.function, "callable")
        object.__setattr__(self, "code", code_behind(self.function))


Network = MLP | Module


@dataclass(frozen=True)
class Categorical:
    """Discrete actions: pi(k|s) = exp(y_k) / sum_j exp(y_j), where the network puts out y."""


@dataclass(frozen=True)
class Gaussian:
    """Continuous actions: a_k ~ N(mu_k(s), sigma_k^2), independently for every component k.

    Actions are neither squashed nor clipped here: the log-probability is that of the raw sample,
    and the environment does with it what it does. So the bounds of its action space are not used,
    and need not be finite.

    Attributes
    ----------
    mean : {"weights", "direct"}
        "weights": the network puts out one weight a state feature (for each component), and
        mu = weights . features, the form of the 2018 report. "direct": it puts out mu.
    sigma : float
        Standard deviation, or its start if it is learned. Above 0.
    learn_sigma : bool
        Whether log sigma_k is learned too, the same for all states.
    constant_feature : bool
        Whether the features, which the network sees and its weights multiply, are the
        observation and a constant 1, or the observation alone.

    Raises
    ------
    TypeError, ValueError
        For any other value.

    Examples
    --------
    >>> from rl_core.policies import Gaussian
    >>> Gaussian(mean="direct", sigma=0.5).learn_sigma
    False
    """

    mean: Literal["weights", "direct"] = "weights"
    sigma: float = 0.5
    learn_sigma: bool = False
    constant_feature: bool = False

    def __post_init__(self) -> None:
        switches = dict.fromkeys(("learn_sigma", "constant_feature"), (truth,))
        fields(self, mean=(one_of, ("weights", "direct")), sigma=(positive,), **switches)


def check_network(network: object, engine: object) -> Literal["compiled", "torch"]:
    """Return the engine for a network: the one asked for, if they go together.

    Raises
    ------
    TypeError, ValueError
        The network is neither an MLP nor a Module, the engine unknown, or asked to compile a
        Module.

    Examples
    --------
    >>> from rl_core.policies import MLP, Module, check_network
    >>> check_network(MLP(), None), check_network(Module("torch.nn:Linear"), None)
    ('compiled', 'torch')
    >>> check_network(Module("torch.nn:Linear"), "compiled")
    Traceback (most recent call last):
    ValueError: engine must be 'torch' for a Module, got 'compiled'
    """
    instance("network", network, Network, "MLP(...) or Module('module:function')")
    optional("engine", engine, one_of, ENGINES)
    plain = isinstance(network, MLP)
    require(plain or engine != "compiled", "engine", engine, "'torch' for a Module")
    return "torch" if engine == "torch" or not plain else "compiled"


def make_policy(
    distribution: Categorical | Gaussian,
    hidden: tuple[int, ...],
    n_observations: int,
    n_actions: int,
    action_dimensions: int,
) -> Policy:
    """Fit a policy to an environment.

    Parameters
    ----------
    distribution : Categorical or Gaussian
    hidden : tuple of int
        Widths of the hidden layers.
    n_observations : int
        Length of an observation.
    n_actions : int
        Number of discrete actions, 0 where actions are continuous.
    action_dimensions : int
        Length of a continuous action, 0 where actions are discrete.

    Raises
    ------
    ValueError
        If the distribution is not one over such actions.

    Examples
    --------
    >>> from rl_core.policies import Gaussian, make_policy
    >>> make_policy(Gaussian(constant_feature=True), (10, 20), 2, 0, 1).sizes
    array([ 3, 10, 20,  3])
    """
    discrete = n_actions > 0
    if isinstance(distribution, Categorical):
        require(discrete, "policy", distribution, "Gaussian(...) where actions are continuous")
        return Policy(np.array([n_observations, *hidden, n_actions]), False, False, False, 1)
    require(not discrete, "policy", distribution, "Categorical() where actions are discrete")
    weighted = distribution.mean == "weights"
    n_features = n_observations + distribution.constant_feature
    n_outputs = action_dimensions * (n_features if weighted else 1)
    form = True, weighted, distribution.constant_feature, action_dimensions
    return Policy(np.array([n_features, *hidden, n_outputs]), *form)


def initial_parameters(
    policy: Policy, distribution: Categorical | Gaussian, rng: np.random.Generator
) -> F32:
    """Draw the parameters to start from: Xavier-uniform weights, zero biases, log sigma as asked.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.policies import Gaussian, initial_parameters, make_policy
    >>> policy = make_policy(Gaussian(), (), 2, 0, 1)
    >>> initial_parameters(policy, Gaussian(sigma=1.0), np.random.default_rng(0))[6:]
    array([0.], dtype=float32)
    """
    network = xavier_uniform(policy.sizes.tolist(), rng)
    return np.concatenate([network, initial_log_sigma(policy, distribution)])


def initial_log_sigma(policy: Policy, distribution: Categorical | Gaussian) -> F32:
    """Return log sigma to start from, one a component of a Gaussian action.

    Examples
    --------
    >>> from rl_core.policies import Gaussian, initial_log_sigma, make_policy
    >>> initial_log_sigma(make_policy(Gaussian(), (), 2, 0, 1), Gaussian(sigma=1.0))
    array([0.], dtype=float32)
    """
    if not isinstance(distribution, Gaussian):
        return np.empty(0, np.float32)
    return np.full(policy.action_width, math.log(distribution.sigma), np.float32)


def trainable(policy: Policy, distribution: Categorical | Gaussian, biases: bool) -> F32:
    """Ones for the parameters that learn, zeros for those that stay as they are.

    Examples
    --------
    >>> from rl_core.policies import Gaussian, make_policy, trainable
    >>> policy = make_policy(Gaussian(), (), 2, 0, 1)
    >>> trainable(policy, Gaussian(), biases=False)
    array([1., 1., 1., 1., 0., 0., 0.], dtype=float32)
    """
    network = trainable_mask(policy.sizes.tolist(), biases)
    if not isinstance(distribution, Gaussian):
        return network
    return np.append(network, np.full(policy.action_width, distribution.learn_sigma, np.float32))
