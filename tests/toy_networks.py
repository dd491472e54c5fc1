"""Networks by import path: good ones, and ones to be refused."""

import torch

WIDTH = 8


class Net(torch.nn.Module):
    """A network with names, and a buffer, of its own."""

    def __init__(self, n_inputs, n_outputs):
        super().__init__()
        self.body = torch.nn.Linear(n_inputs, WIDTH)
        self.head = torch.nn.Linear(WIDTH, n_outputs, bias=False)
        self.register_buffer("calls", torch.zeros((), dtype=torch.int64))

    def forward(self, x):
        """One hidden layer."""
        self.calls += 1
        return self.head(torch.tanh(self.body(x)))


def make(n_inputs, n_outputs):
    return Net(n_inputs, n_outputs)


def plain(n_inputs, n_outputs):
    """The perceptron of the report."""
    return torch.nn.Sequential(
        torch.nn.Linear(n_inputs, 10),
        torch.nn.ReLU(),
        torch.nn.Linear(10, 20),
        torch.nn.ReLU(),
        torch.nn.Linear(20, n_outputs),
    )


def with_dropout(n_inputs, n_outputs):
    return torch.nn.Sequential(Net(n_inputs, n_outputs), torch.nn.Dropout(0.2))


def linear_without_bias(n_inputs, n_outputs):
    return torch.nn.Linear(n_inputs, n_outputs, bias=False)


def one_too_many(n_inputs, n_outputs):
    return torch.nn.Linear(n_inputs, n_outputs + 1)


def other_inputs(n_inputs, n_outputs):
    return torch.nn.Linear(n_inputs + 1, n_outputs)


def squeezing(n_inputs, n_outputs):
    """Right for a batch, wrong for one input."""

    class Squeezing(torch.nn.Linear):
        def forward(self, x):
            return super().forward(x).squeeze(0)

    return Squeezing(n_inputs, n_outputs)


def normalising_batches(n_inputs, n_outputs):
    """Cannot take one input."""
    return torch.nn.Sequential(
        torch.nn.Linear(n_inputs, n_outputs), torch.nn.BatchNorm1d(n_outputs)
    )


def frozen(n_inputs, n_outputs):
    return torch.nn.Linear(n_inputs, n_outputs).requires_grad_(False)


def no_module(n_inputs, n_outputs):
    return "a network"


def of_one_argument(n_inputs):
    return torch.nn.Linear(n_inputs, 1)


def raising(n_inputs, n_outputs):
    raise ZeroDivisionError("out of neurons")


CONSTANT = 3
