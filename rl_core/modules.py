"""Networks in torch: the perceptron, any module by name, and the optimisers of 2018.

torch's own generator is seeded for them and put back, and they run on one thread with deterministic
algorithms: the same seed gives the same bits.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from copy import deepcopy
from itertools import pairwise
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray

from rl_core.checks import instance
from rl_core.identity import imported
from rl_core.kernels import networks
from rl_core.kernels.arrays import F32, Arrays
from rl_core.policies import MLP, Network
from rl_core.training import Run, Training, train_seeds
from rl_core.worlds.environments import EnvironmentLike, one_seed_of, open_world


def perceptron(sizes: Sequence[int], parameters: F32, biases: bool = True) -> torch.nn.Sequential:
    """Build a perceptron over a parameter vector, whose memory it shares.

    Linear layers alternate with rectified linear units.

    Parameters
    ----------
    sizes : sequence of int
        Widths of the layers, input and output included.
    parameters : float32 array of shape (P,)
        As `rl_core.kernels.networks` lays them out. A step of an optimiser changes them.
    biases : bool
        Whether the biases learn.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.modules import perceptron
    >>> perceptron((2, 4, 1), np.zeros(17, np.float32))[0].in_features
    2
    """
    vector = torch.from_numpy(parameters)
    layers: list[torch.nn.Module] = []
    start = 0
    for n_in, n_out in pairwise(sizes):
        # On the device "meta" nothing is drawn from torch's global generator.
        linear = torch.nn.Linear(n_in, n_out, device="meta")
        end = start + n_in * n_out
        linear.weight = torch.nn.Parameter(vector[start:end].view(n_out, n_in))
        linear.bias = torch.nn.Parameter(vector[end : end + n_out], requires_grad=biases)
        layers += [linear, torch.nn.ReLU()]
        start = end + n_out
    return torch.nn.Sequential(*layers[:-1])


def make_module(
    network: Network, n_inputs: int, n_outputs: int, rng: np.random.Generator
) -> torch.nn.Module:
    """Make a network with its initial weights.

    Parameters
    ----------
    network : MLP or Module
    n_inputs, n_outputs : int
    rng : numpy.random.Generator
        Stream of the network. torch's own generator is seeded from it for the function of a
        `Module`, and put back afterwards.

    Raises
    ------
    ValueError
        The function returns no torch module, or one without anything to learn, or one whose output
        has another shape.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.modules import make_module
    >>> from rl_core.policies import Module
    >>> make_module(Module("torch.nn:Linear"), 2, 3, np.random.default_rng(0)).out_features
    3
    """
    if isinstance(network, MLP):
        sizes = (n_inputs, *network.hidden, n_outputs)
        return perceptron(sizes, networks.xavier_uniform(sizes, rng), network.biases)
    function = imported("network", network.function)
    with _seeded(int(rng.integers(2**63))):
        try:
            module = function(n_inputs, n_outputs)
        except Exception as error:  # it is the user's code
            raise ValueError(
                f"network must be a function (n_inputs, n_outputs), {network.function} with "
                f"({n_inputs}, {n_outputs}) raises: {error}"
            ) from error
        complaint = _complaint(module, n_inputs, n_outputs)
    if complaint:
        raise ValueError(f"network must {complaint}, got {network.function}")
    return cast(torch.nn.Module, module)


def _complaint(module: object, n_inputs: int, n_outputs: int) -> str:
    """Say what a network must do and does not, if there is anything."""
    if not isinstance(module, torch.nn.Module):
        return f"make a torch.nn.Module, not {module!r}"
    if not any(parameter.requires_grad for parameter in module.parameters()):
        return f"have parameters that learn, which {module!r} has not"
    for batch in (1, 2):  # to act, and to learn
        try:  # a copy, since a call may change what a module remembers of its inputs
            with torch.no_grad():
                shape = tuple(deepcopy(module)(torch.zeros(batch, n_inputs)).shape)
        except Exception as error:  # it is the user's code
            return f"take inputs of shape ({batch}, {n_inputs}) and not raise {error}"
        if shape != (batch, n_outputs):
            return f"put out the shape (batch, {n_outputs}), not {shape} for a batch of {batch}"
    return ""


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Seed torch's own generator, and put it back."""
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(seed)
        yield


@contextmanager
def reproducible(seed: int = 0) -> Iterator[None]:
    """Run torch on one thread with deterministic algorithms; put all back afterwards.

    What a module draws when it is called (dropout) comes from torch's own generator, which begins
    with `seed`.
    """
    threads, mode = torch.get_num_threads(), torch.get_deterministic_debug_mode()
    torch.set_num_threads(1)
    # Unlike `use_deterministic_algorithms` it does not import torch's compiler, for seconds.
    torch.set_deterministic_debug_mode("error")
    try:
        with _seeded(seed):
            yield
    finally:
        torch.set_num_threads(threads)
        torch.set_deterministic_debug_mode(mode)


def train_networks(
    train: Callable[..., None], env: EnvironmentLike, config: object, seeds: Any, **arguments: Any
) -> Run:
    """Train a network a seed, each in a world of its own, with torch made `reproducible`.

    Parameters
    ----------
    train : callable
        Trains a seed: `train(world, config, training)`.
    env, config : object
    seeds : iterable of int
        Several only if a world can be opened for each.
    **arguments : object
        Episodes, snapshots and progress, see `rl_core.training.train_seeds`.
    """

    def train_one(training: Training) -> None:
        with closing(open_world(env)) as world, reproducible(training.seed):
            train(world, config, training)

    seeds = one_seed_of(env, seeds)
    return train_seeds(train_one, seeds=seeds, env=env, config=config, **arguments)


def as_arrays(module: torch.nn.Module) -> Arrays:
    """Return a module's parameters and buffers by name, as copies.

    Examples
    --------
    >>> import torch
    >>> from rl_core.modules import as_arrays
    >>> as_arrays(torch.nn.ReLU())
    {}
    """
    return {name: tensor.detach().numpy().copy() for name, tensor in module.state_dict().items()}


def load_arrays(module: torch.nn.Module, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write parameters and buffers, by name, into a module.

    Raises
    ------
    ValueError
        Names or shapes are not the module's.

    Examples
    --------
    >>> import torch
    >>> from rl_core.modules import load_arrays
    >>> load_arrays(torch.nn.ReLU(), {})
    """
    instance("module", module, torch.nn.Module, "a torch.nn.Module")
    instance("arrays", arrays, Mapping, "a mapping of names to arrays")
    try:
        module.load_state_dict({name: torch.tensor(array) for name, array in arrays.items()})
    except (AttributeError, RuntimeError, TypeError, ValueError) as error:
        raise ValueError(f"arrays must be those of the module: {error}") from error


class _Optimiser(torch.optim.Optimizer):
    """The loop over the parameters; the rule for one of them is `descend`."""

    def __init__(self, parameters: Any, lr: float) -> None:
        super().__init__(parameters, {"lr": lr})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Descend in all parameters that have a gradient."""
        for group in self.param_groups:
            for theta in group["params"]:
                if theta.grad is not None:
                    self.descend(theta, theta.grad, group["lr"], self.state[theta])

    def descend(self, theta: Any, gradient: Any, alpha: float, state: dict[str, Any]) -> None:
        """Change a parameter in place."""
        raise NotImplementedError


class Adam(_Optimiser):
    """Adam with epsilon where TensorFlow 1 has it; see `rl_core.kernels.networks.adam_step`.

    Examples
    --------
    >>> import torch
    >>> from rl_core.modules import Adam
    >>> theta = torch.nn.Parameter(torch.ones(1))
    >>> theta.grad = torch.tensor([5.0])
    >>> Adam([theta], lr=0.1).step()
    >>> round(theta.item(), 6)
    0.9
    """

    def descend(self, theta: Any, gradient: Any, alpha: float, state: dict[str, Any]) -> None:
        """Descend: theta <- theta - alpha_t m / (sqrt(v) + 1e-8)."""
        m, v = (state.setdefault(key, torch.zeros_like(theta)) for key in "mv")
        t = state["t"] = state.get("t", 0) + 1
        m.mul_(0.9).add_(gradient, alpha=0.1)
        v.mul_(0.999).addcmul_(gradient, gradient, value=0.001)
        alpha_t = alpha * math.sqrt(1 - 0.999**t) / (1 - 0.9**t)
        theta.sub_(alpha_t * m / (v.sqrt() + 1e-8))


class RMSProp(_Optimiser):
    """RMSProp with TensorFlow 1's constants; see `rl_core.kernels.networks.rmsprop_step`.

    Examples
    --------
    >>> import torch
    >>> from rl_core.modules import RMSProp
    >>> theta = torch.nn.Parameter(torch.ones(1))
    >>> theta.grad = torch.tensor([1.0])
    >>> RMSProp([theta], lr=0.1).step()
    >>> round(theta.item(), 6)
    0.9
    """

    def descend(self, theta: Any, gradient: Any, alpha: float, state: dict[str, Any]) -> None:
        """Descend: theta <- theta - alpha g / sqrt(v + 1e-10), where v begins at 1."""
        v = state.setdefault("v", torch.ones_like(theta))
        v.mul_(0.9).addcmul_(gradient, gradient, value=0.1)
        theta.sub_(alpha * gradient / (v + 1e-10).sqrt())
