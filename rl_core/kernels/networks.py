"""Small multilayer perceptrons, one per seed along the first axis, and their optimisers.

A network with layer widths `sizes = (n_0, ..., n_L)` computes, for l = 0, ..., L - 1,

    h_0 = x,    z_l = h_l W_l + b_l,    h_{l+1} = max(z_l, 0),    output = z_{L-1} (not rectified).

All its parameters live in one float32 vector; N networks are the rows of an (N, P) array, so that
copying a network is copying a row and an optimiser is a loop over a vector. `unpack` gives the
weights and biases by name.

Every function works on one row alone, in compiled loops with strict floating point. A network
therefore gets the same bits whether it is trained alone or beside others, with batches of whatever
lengths and any number of threads. `bench/reinforce.py` measures it beside torch; the tests hold
outputs, gradients and optimisers to torch (`rl_core.modules`).
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rl_core.checks import instance
from rl_core.kernels.arrays import F32, I64
from rl_core.kernels.compiled import compiled, uncounted

LANES = 32
"""Batches are computed in multiples of this many samples; `padded` says how many."""


def count_parameters(sizes: Sequence[int]) -> int:
    """Number P of parameters: the sum over layers of (n_l + 1) n_{l+1}.

    Examples
    --------
    >>> from rl_core.kernels.networks import count_parameters
    >>> count_parameters((6, 10, 20, 3))
    353
    """
    return sum((n_in + 1) * n_out for n_in, n_out in pairwise(sizes))


def xavier_uniform(sizes: Sequence[int], rng: np.random.Generator) -> F32:
    """Draw the initial parameters of one network.

    Weights of a layer with n_in inputs and n_out outputs are uniform on (-a, a) with
    a = sqrt(6 / (n_in + n_out)); biases are zero.

    Parameters
    ----------
    sizes : sequence of int
        Widths of the layers, input and output included.
    rng : numpy.random.Generator
        Stream of the network.

    Returns
    -------
    float32 array of shape (P,)

    References
    ----------
    X. Glorot and Y. Bengio (2010), Understanding the difficulty of training deep networks, eq. 16.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.networks import xavier_uniform
    >>> parameters = xavier_uniform((2, 4, 1), np.random.default_rng(0))
    >>> parameters.size, bool((abs(parameters[:8]) <= 1.0).all()), float(parameters[8])
    (17, True, 0.0)
    """
    parts = []
    for n_in, n_out in pairwise(sizes):
        bound = math.sqrt(6.0 / (n_in + n_out))
        parts.append(rng.uniform(-bound, bound, n_in * n_out))
        parts.append(np.zeros(n_out))
    return np.concatenate(parts).astype(np.float32)


def unpack(sizes: Sequence[int], parameters: F32) -> dict[str, F32]:
    """Name the weights and biases inside parameter vectors.

    Parameters
    ----------
    sizes : sequence of int
    parameters : float32 array of shape (..., P)
        One network, or networks stacked along the leading axes.

    Returns
    -------
    dict of str to float32 array
        `layer0.weight` of shape (..., n_0, n_1), `layer0.bias` of shape (..., n_1), and so on:
        views, so that writing to them writes to `parameters`.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.networks import unpack
    >>> unpack((2, 4, 1), np.zeros((30, 17), np.float32))["layer0.weight"].shape
    (30, 2, 4)
    """
    layers = {}
    start = 0
    for layer, (n_in, n_out) in enumerate(pairwise(sizes)):
        end = start + n_in * n_out
        weight = parameters[..., start:end].reshape(*parameters.shape[:-1], n_out, n_in)
        layers[f"layer{layer}.weight"] = np.swapaxes(weight, -1, -2)
        layers[f"layer{layer}.bias"] = parameters[..., end : end + n_out]
        start = end + n_out
    return layers


def pack(layers: Mapping[str, F32]) -> tuple[tuple[int, ...], F32]:
    """Undo `unpack` for one network: its sizes and parameters. Missing biases are zero.

    Raises
    ------
    ValueError
        If there is no `layer0.weight`, a weight has other than two axes, or a layer does not take
        what the one before it puts out.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.networks import pack
    >>> sizes, parameters = pack({"layer0.weight": np.ones((2, 3), np.float32)})
    >>> sizes, parameters.size
    ((2, 3), 9)
    """
    instance("weights", layers, Mapping, "a mapping of names to arrays")
    weights: list[F32] = []
    while (name := f"layer{len(weights)}.weight") in layers:
        weights.append(np.asarray(layers[name]))
    if not weights or any(weight.ndim != 2 for weight in weights):
        raise ValueError(
            "weights must hold 'layer0.weight', 'layer1.weight', ... of one network, each with two "
            f"axes, got { ({name: np.shape(array) for name, array in layers.items()}) }"
        )
    sizes = (weights[0].shape[0], *(weight.shape[1] for weight in weights))
    shapes = [weight.shape for weight in weights]
    if shapes != list(pairwise(sizes)):
        raise ValueError(f"weights must each take what the one before puts out, got {shapes}")
    parameters = np.zeros(count_parameters(sizes), np.float32)
    for name, view in unpack(sizes, parameters).items():
        if name in layers:
            view[...] = layers[name]
    return sizes, parameters


def trainable_mask(sizes: Sequence[int], biases: bool) -> F32:
    """Ones where a parameter learns, zeros where not: multiply a gradient by it.

    Examples
    --------
    >>> from rl_core.kernels.networks import trainable_mask
    >>> trainable_mask((1, 2), biases=False)
    array([1., 1., 0., 0.], dtype=float32)
    """
    mask = np.ones(count_parameters(sizes), np.float32)
    if not biases:
        for name, view in unpack(sizes, mask).items():
            if name.endswith("bias"):
                view[...] = 0.0
    return mask


def output(sizes: Sequence[int], parameters: F32, inputs: NDArray[np.floating]) -> F32:
    """Outputs of one network for many inputs.

    Parameters
    ----------
    sizes : sequence of int
    parameters : float32 array of shape (P,)
    inputs : array of shape (n, n_0)

    Returns
    -------
    float32 array of shape (n, n_L)

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.networks import output
    >>> output((2, 1), np.array([1, 2, 3], np.float32), np.array([[10, 1]]))
    array([[15.]], dtype=float32)
    """
    n = len(inputs)
    units = np.zeros((sum(sizes), padded(n)), np.float32)
    units[: sizes[0], :n] = np.asarray(inputs, np.float32).T
    forward(np.asarray(sizes), parameters, units, padded(n))
    return units[-sizes[-1] :, :n].T.copy()


@uncounted
def padded(n: int) -> int:
    """Smallest multiple of `LANES` that holds n samples: `padded(100)` is 128."""
    return (n + LANES - 1) // LANES * LANES


@uncounted
def forward_one(sizes: I64, parameters: F32, units: F32) -> None:
    """Compute all units for one input; the bits are those of `forward`.

    Parameters
    ----------
    sizes : int64 array of shape (L + 1,)
    parameters : float32 array of shape (P,)
    units : float32 array of shape (sum(sizes),)
        On entry the first n_0 entries hold the input; the rest is written, output last.
    """
    start, row = 0, 0
    last = sizes.size - 2
    for layer in range(last + 1):
        n_in, n_out = sizes[layer], sizes[layer + 1]
        x, h = units[row : row + n_in], units[row + n_in : row + n_in + n_out]
        bias = parameters[start + n_in * n_out : start + (n_in + 1) * n_out]
        floor = np.float32(0.0 if layer < last else -np.inf)
        for j in range(0, n_out, 4):  # four sums at a time, which wait for each other no longer
            j1, j2, j3 = min(j + 1, n_out - 1), min(j + 2, n_out - 1), min(j + 3, n_out - 1)
            w0, w1 = parameters[start + j * n_in :], parameters[start + j1 * n_in :]
            w2, w3 = parameters[start + j2 * n_in :], parameters[start + j3 * n_in :]
            z0, z1, z2, z3 = bias[j], bias[j1], bias[j2], bias[j3]
            for i in range(n_in):
                z0 += w0[i] * x[i]
                z1 += w1[i] * x[i]
                z2 += w2[i] * x[i]
                z3 += w3[i] * x[i]
            h[j], h[j1], h[j2], h[j3] = (
                max(z0, floor),
                max(z1, floor),
                max(z2, floor),
                max(z3, floor),
            )
        start += (n_in + 1) * n_out
        row += n_in


@uncounted
def _add_rows(total: F32, rows: F32, weights: F32, n: int) -> None:
    """Add weighted rows to a total one after the other, over n columns: total += w_i x_i.

    Four rows are taken for one reading and writing of the total; the order of the sums is kept.
    """
    i = 0
    while i + 4 <= len(rows):
        x0, x1, x2, x3 = rows[i], rows[i + 1], rows[i + 2], rows[i + 3]
        w0, w1, w2, w3 = weights[i], weights[i + 1], weights[i + 2], weights[i + 3]
        for k in range(n):
            total[k] = (((total[k] + w0 * x0[k]) + w1 * x1[k]) + w2 * x2[k]) + w3 * x3[k]
        i += 4
    while i < len(rows):
        x, w = rows[i], weights[i]
        for k in range(n):
            total[k] += w * x[k]
        i += 1


@uncounted
def forward(sizes: I64, parameters: F32, units: F32, n: int) -> None:
    """Compute all units for a batch of inputs.

    Parameters
    ----------
    sizes : int64 array of shape (L + 1,)
    parameters : float32 array of shape (P,)
    units : float32 array of shape (sum(sizes), capacity)
        One column a sample. On entry the first n_0 rows hold the inputs; the rest is written,
        outputs last.
    n : int
        Number of columns computed.
    """
    start, row = 0, 0
    last = sizes.size - 2
    for layer in range(last + 1):
        n_in, n_out = sizes[layer], sizes[layer + 1]
        bias = start + n_in * n_out
        for j in range(n_out):
            h = units[row + n_in + j]
            for k in range(n):
                h[k] = parameters[bias + j]
            weights = parameters[start + j * n_in : start + (j + 1) * n_in]
            _add_rows(h, units[row : row + n_in], weights, n)
            if layer < last:
                for k in range(n):
                    h[k] = max(h[k], np.float32(0.0))
        start = bias + n_out
        row += n_in


@uncounted
def _dot(x: F32, y: F32, sums: F32, n: int) -> np.float32:
    """Inner product of n entries, n a multiple of `LANES`.

    Eight far apart products are added at a time and four sums kept, in an order that is the same
    everywhere and that a compiler bound to strict floating point can still vectorise.
    """
    q = n // 8
    for k in range(q):
        sums[k] = (
            (x[k] * y[k] + x[k + q] * y[k + q])
            + (x[k + 2 * q] * y[k + 2 * q] + x[k + 3 * q] * y[k + 3 * q])
        ) + (
            (x[k + 4 * q] * y[k + 4 * q] + x[k + 5 * q] * y[k + 5 * q])
            + (x[k + 6 * q] * y[k + 6 * q] + x[k + 7 * q] * y[k + 7 * q])
        )
    a = b = c = d = np.float32(0.0)
    for k in range(0, q, 4):
        a += sums[k]
        b += sums[k + 1]
        c += sums[k + 2]
        d += sums[k + 3]
    return (a + b) + (c + d)


@compiled
def backward(sizes: I64, parameters: F32, units: F32, deltas: F32, gradient: F32, n: int) -> None:
    """Backpropagate: the gradient of a loss that is a sum over the samples of a batch.

    Parameters
    ----------
    sizes : int64 array of shape (L + 1,)
    parameters : float32 array of shape (P,)
    units : float32 array of shape (sum(sizes), capacity)
        As `forward` left them.
    deltas : float32 array of shape (sum(sizes), capacity)
        On entry the last n_L rows hold the derivatives of the loss with respect to the outputs,
        zero for samples that only fill up the batch; the rest is written.
    gradient : float32 array of shape (at least P,)
        The first P entries are written.
    n : int
        Number of columns, a multiple of `LANES`.
    """
    ones, sums = np.ones(n, np.float32), np.empty(n, np.float32)
    start, row = 0, 0
    for layer in range(sizes.size - 1):
        start += (sizes[layer] + 1) * sizes[layer + 1]
        row += sizes[layer]
    for layer in range(sizes.size - 2, -1, -1):
        n_in, n_out = sizes[layer], sizes[layer + 1]
        start -= (n_in + 1) * n_out
        row -= n_in
        for j in range(n_out):
            delta = deltas[row + n_in + j]
            for i in range(n_in):
                gradient[start + j * n_in + i] = _dot(units[row + i], delta, sums, n)
            gradient[start + n_in * n_out + j] = _dot(ones, delta, sums, n)
        if layer == 0:
            return
        for i in range(n_in):
            delta_in, h = deltas[row + i], units[row + i]
            for k in range(n):
                delta_in[k] = np.float32(0.0)
            weights = parameters[start + i : start + n_in * n_out : n_in]
            _add_rows(delta_in, deltas[row + n_in : row + n_in + n_out], weights, n)
            for k in range(n):
                delta_in[k] = delta_in[k] if h[k] > np.float32(0.0) else np.float32(0.0)


@uncounted
def adam_step(
    parameters: F32, gradient: F32, first: F32, second: F32, count: int, learning_rate: float
) -> None:
    """Take one descent step of Adam on one network, in place.

        m <- beta1 m + (1 - beta1) g,    v <- beta2 v + (1 - beta2) g^2,
        theta <- theta - alpha_t m / (sqrt(v) + epsilon),
        alpha_t = alpha sqrt(1 - beta2^t) / (1 - beta1^t)

    with the paper's constants beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8.
    This is the order of operations proposed before section 2.1 of the paper and used by TensorFlow,
    which the 2018 program ran on; torch adds its epsilon after the correction by 1 - beta2^t.

    Parameters
    ----------
    parameters, gradient : float32 arrays of shape (P,)
    first, second : float32 arrays of shape (P,)
        The moments m and v of this network, zero before its first step.
    count : int
        Number t of this step, from 1.
    learning_rate : float
        alpha.

    References
    ----------
    D. P. Kingma and J. Ba (2015), Adam: a method for stochastic optimization, algorithm 1.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.networks import adam_step
    >>> theta, m, v = np.ones(1, np.float32), np.zeros(1, np.float32), np.zeros(1, np.float32)
    >>> adam_step(theta, np.array([5.0], np.float32), m, v, 1, 0.1)
    >>> round(float(theta[0]), 6)
    0.9
    """
    step_size = np.float32(learning_rate * math.sqrt(1.0 - 0.999**count) / (1.0 - 0.9**count))
    keep1, new1 = np.float32(0.9), np.float32(0.1)
    keep2, new2 = np.float32(0.999), np.float32(0.001)
    small = np.float32(1e-8)
    for i in range(parameters.size):
        first[i] = keep1 * first[i] + new1 * gradient[i]
        second[i] = keep2 * second[i] + new2 * (gradient[i] * gradient[i])
        parameters[i] -= step_size * first[i] / (np.sqrt(second[i]) + small)


@uncounted
def rmsprop_step(parameters: F32, gradient: F32, mean_square: F32, learning_rate: float) -> None:
    """Take one descent step of RMSProp on one network, in place.

        v <- decay v + (1 - decay) g^2,    theta <- theta - alpha g / sqrt(v + epsilon)

    with decay = 0.9 and epsilon = 1e-10: the constants, and the place of epsilon, of TensorFlow 1,
    which the 2018 program ran on. torch has decay 0.99 and its epsilon outside the root.

    Parameters
    ----------
    parameters, gradient : float32 arrays of shape (P,)
    mean_square : float32 array of shape (P,)
        v of this network; before its first step ones in TensorFlow 1, zeros in torch.
    learning_rate : float
        alpha.

    References
    ----------
    T. Tieleman and G. Hinton (2012), Neural networks for machine learning, lecture 6.5.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.kernels.networks import rmsprop_step
    >>> theta, v = np.ones(1, np.float32), np.full(1, 25.0, np.float32)
    >>> rmsprop_step(theta, np.array([5.0], np.float32), v, 0.1)
    >>> round(float(theta[0]), 6)
    0.9
    """
    alpha, small = np.float32(learning_rate), np.float32(1e-10)
    keep, new = np.float32(0.9), np.float32(0.1)
    for i in range(parameters.size):
        mean_square[i] = keep * mean_square[i] + new * (gradient[i] * gradient[i])
        parameters[i] -= alpha * gradient[i] / np.sqrt(mean_square[i] + small)
