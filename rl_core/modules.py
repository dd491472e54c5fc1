"""Networks in torch: the perceptron, any module by name, and the optimisers of 2018.

A module draws nothing from torch's global generator, and runs on one thread with deterministic
algorithms: the same seed gives the same bits.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from rl_core.imports import imported
from rl_core.kernels import networks
from rl_core.policies import MLP, Network


def perceptron(
    sizes: Sequence[int], parameters: NDArray[np.float32], biases: bool = True
) -> torch.nn.Sequential:
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
        The function returns no torch module, or one whose output has another shape.

    Examples
    --------
    >>> make_module(Module("torch.nn:Linear"), 2, 3, np.random.default_rng(0)).out_features
    3
    """
    if isinstance(network, MLP):
        sizes = (n_inputs, *network.hidden, n_outputs)
        return perceptron(sizes, networks.xavier_uniform(sizes, rng), network.biases)
    function = imported("network", network.function)
    with _seeded(int(rng.integers(2**63))):
        module = function(n_inputs, n_outputs)
        if not isinstance(module, torch.nn.Module):
            raise ValueError(
                f"network must make a torch.nn.Module, {network.function} made {module!r}"
            )
        try:
            with torch.no_grad():
                shape = tuple(module(torch.zeros(2, n_inputs)).shape)
        except (RuntimeError, TypeError, AttributeError, ValueError) as error:
            raise ValueError(
                f"network must take inputs of shape (batch, {n_inputs}), "
                f"{network.function} raises: {error}"
            ) from error
    if shape != (2, n_outputs):
        raise ValueError(
            f"network must put out the shape (batch, {n_outputs}), of {network.function} it is "
            f"{shape} for a batch of 2"
        )
    return module


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Seed torch's generator, from which modules draw their weights, and put it back."""
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(seed)
        yield


@contextmanager
def reproducible() -> Iterator[None]:
    """Run torch on one thread with deterministic algorithms; put both back afterwards."""
    threads, deterministic = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
        torch.use_deterministic_algorithms(deterministic)


def as_arrays(module: torch.nn.Module) -> dict[str, NDArray[Any]]:
    """Return a module's parameters and buffers by name, as copies.

    Examples
    --------
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
    >>> load_arrays(torch.nn.ReLU(), {})
    """
    try:
        module.load_state_dict({name: torch.tensor(array) for name, array in arrays.items()})
    except RuntimeError as error:
        raise ValueError(f"weights must be those of the network: {error}") from error


class Adam(torch.optim.Optimizer):
    """Adam with epsilon where TensorFlow 1 has it; see `rl_core.kernels.networks.adam_step`.

    Examples
    --------
    >>> theta = torch.nn.Parameter(torch.ones(1))
    >>> theta.grad = torch.tensor([5.0])
    >>> Adam([theta], lr=0.1).step()
    >>> round(float(theta), 6)
    0.9
    """

    def __init__(self, parameters: Any, lr: float) -> None:
        super().__init__(parameters, {"lr": lr})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Descend: theta <- theta - alpha_t m / (sqrt(v) + 1e-8)."""
        for theta, alpha, state in _with_gradient(self):
            m, v, t = (
                *(state.setdefault(key, torch.zeros_like(theta)) for key in "mv"),
                state.get("t", 0) + 1,
            )
            state["t"] = t
            m.mul_(0.9).add_(theta.grad, alpha=0.1)
            v.mul_(0.999).addcmul_(theta.grad, theta.grad, value=0.001)
            alpha_t = alpha * math.sqrt(1 - 0.999**t) / (1 - 0.9**t)
            theta.sub_(alpha_t * m / (v.sqrt() + 1e-8))


class RMSProp(torch.optim.Optimizer):
    """RMSProp with TensorFlow 1's constants; see `rl_core.kernels.networks.rmsprop_step`.

    Examples
    --------
    >>> theta = torch.nn.Parameter(torch.ones(1))
    >>> theta.grad = torch.tensor([1.0])
    >>> RMSProp([theta], lr=0.1).step()
    >>> round(float(theta), 6)
    0.9
    """

    def __init__(self, parameters: Any, lr: float) -> None:
        super().__init__(parameters, {"lr": lr})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # type: ignore[override]
        """Descend: theta <- theta - alpha g / sqrt(v + 1e-10), where v begins at 1."""
        for theta, alpha, state in _with_gradient(self):
            v = state.setdefault("v", torch.ones_like(theta))
            v.mul_(0.9).addcmul_(theta.grad, theta.grad, value=0.1)
            theta.sub_(alpha * theta.grad / (v + 1e-10).sqrt())


def _with_gradient(optimiser: torch.optim.Optimizer) -> Iterator[tuple[Any, float, dict[str, Any]]]:
    for group in optimiser.param_groups:
        for theta in group["params"]:
            if theta.grad is not None:
                yield theta, group["lr"], optimiser.state[theta]
