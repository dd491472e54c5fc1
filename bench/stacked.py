"""Thirty seeds in torch as one: their networks stacked for `baddbmm`, their cars in lockstep.

This is how many seeds are trained at once without compiling anything: every operation is one call
for all seeds, so that the cost of the calls is shared. MountainCar is a few such operations more.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import torch

from rl_core.dqn import DQNConfig
from rl_core.reinforce import ReinforceConfig

NAME = "torch, stacked networks"
INPUTS, ACTIONS = 2, 3  # of MountainCar


class Networks:
    """Perceptrons of the same widths as stacks of matrices, with one fused Adam for all."""

    def __init__(self, count: int, widths: Sequence[int], learning_rate: float) -> None:
        shapes = list(pairwise(widths))
        self.weights = [
            (torch.randn(count, a, b) / math.sqrt(a)).requires_grad_() for a, b in shapes
        ]
        self.biases = [torch.zeros(count, 1, b, requires_grad=True) for _, b in shapes]
        self.parameters = [*self.weights, *self.biases]
        self.optimiser = torch.optim.Adam(self.parameters, lr=learning_rate, fused=True)

    def __call__(self, x: torch.Tensor) -> torch.Tensor:
        """From (networks, samples, inputs) to (networks, samples, outputs)."""
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = torch.baddbmm(bias, x if layer == 0 else x.relu(), weight)
        return x

    def step(self, loss: torch.Tensor) -> None:
        """One step of the optimiser; a sum over networks gives each its own gradient."""
        self.optimiser.zero_grad()
        loss.backward()
        self.optimiser.step()

    def copy(self, other: "Networks") -> None:
        """Take the weights of another stack."""
        with torch.no_grad():
            for mine, theirs in zip(self.parameters, other.parameters, strict=True):
                mine.copy_(theirs)


class Cars:
    """MountainCar's dynamics for many cars; the observations are the states."""

    def __init__(self, count: int) -> None:
        self.states = torch.empty(count, 2)
        self.reset(torch.ones(count, dtype=torch.bool))

    def reset(self, which: torch.Tensor) -> None:
        """Put some of the cars at a random place in the valley, at rest."""
        fresh = torch.stack([torch.rand(len(which)) * 0.2 - 0.6, torch.zeros(len(which))], dim=1)
        self.states = torch.where(which[:, None], fresh, self.states)

    def step(self, actions: torch.Tensor) -> torch.Tensor:
        """Move all cars; return which of them are at the goal."""
        place, speed = self.states.unbind(1)
        speed = speed + (actions - 1) * 0.001 - torch.cos(3 * place) * 0.0025
        speed = speed.clamp(-0.07, 0.07)
        place = (place + speed).clamp(-1.2, 0.6)
        speed = torch.where((place == -1.2) & (speed < 0), 0.0, speed)
        self.states = torch.stack([place, speed], dim=1)
        return (place >= 0.5) & (speed >= 0)


def learn(networks: Networks, states: torch.Tensor, actions: torch.Tensor, v: torch.Tensor) -> None:
    """One step on REINFORCE's loss, -mean(v log pi), of every network."""
    logs = torch.log_softmax(networks(states), -1).gather(-1, actions).squeeze(-1)
    networks.step(-(logs * v).sum() / v.shape[1])


def train_reinforce(seeds: int, config: ReinforceConfig, episodes: int, seed: int) -> int:
    """Train; return the environment steps. A car at the goal waits until the others stop."""
    torch.manual_seed(seed)
    networks = Networks(
        seeds, (INPUTS, *config.network.hidden, ACTIONS), learning_rate=config.learning_rate
    )
    env_steps = 0
    for _ in range(episodes):
        states, actions, under_way = _play(networks, Cars(seeds), config.max_episode_steps)
        env_steps += int(under_way.sum())
        steps = under_way.sum(1, keepdim=True)
        following = (steps - torch.arange(config.max_episode_steps)).clamp(min=0)  # each worth -1
        v = (config.gamma**following - 1) / (1 - config.gamma)
        v = (v - v.sum(1, keepdim=True) / steps) * under_way
        v = v / (v.square().sum(1, keepdim=True) / steps).sqrt()
        for _ in range(config.epochs):
            for batch in torch.randperm(v.shape[1]).split(config.batch_size):
                learn(networks, states[:, batch], actions[:, batch], v[:, batch])
    return env_steps


@torch.no_grad()
def _play(networks: Networks, cars: Cars, steps: int) -> tuple[torch.Tensor, ...]:
    """Play an episode each: states, actions and which cars were under way, by car and step."""
    count = len(cars.states)
    states, actions = torch.empty(count, steps, INPUTS), torch.empty(count, steps, 1).long()
    under_way, going = torch.empty(count, steps, dtype=torch.bool), torch.ones(count).bool()
    for t in range(steps):
        states[:, t], under_way[:, t] = cars.states, going
        noise = torch.rand(count, ACTIONS).log_().neg_()  # argmax of p / Exp(1) draws from p
        chosen = (networks(cars.states[:, None])[:, 0].exp() / noise).argmax(1)
        actions[:, t, 0] = chosen
        going = going & ~cars.step(chosen)
    return states, actions, under_way


class DQN:
    """DQN of many seeds: `run` plays so many steps of each, every one with an update."""

    def __init__(self, seeds: int, config: DQNConfig, seed: int) -> None:
        torch.manual_seed(seed)
        widths = (INPUTS, *config.network.hidden, ACTIONS)
        self.config, self.cars, self.steps = config, Cars(seeds), 0
        self.networks, self.fixed = (
            Networks(seeds, widths, learning_rate=config.learning_rate) for _ in range(2)
        )
        self.fixed.copy(self.networks)
        self.before, self.after = torch.zeros(2, seeds, config.memory_size, INPUTS)
        self.actions = torch.zeros(seeds, config.memory_size, dtype=torch.long)
        self.ends = torch.zeros(seeds, config.memory_size, dtype=torch.bool)
        self.ages, self.rows = torch.zeros(seeds), torch.arange(seeds)[:, None]

    def run(self, steps: int, *, learning: bool = True) -> None:
        """Play; the rewards are all -1, so they are not kept."""
        for _ in range(steps):
            self._play()
            if learning:
                self._update()

    @torch.no_grad()
    def _play(self) -> None:
        states, slot = self.cars.states, self.steps % self.config.memory_size
        best = self.networks(states[:, None])[:, 0].argmax(1)
        explores = torch.rand(len(best)) < self.config.epsilon
        chosen = torch.where(explores, torch.randint(ACTIONS, best.shape), best)
        end = self.cars.step(chosen)
        self.before[:, slot], self.after[:, slot] = states, self.cars.states
        self.actions[:, slot], self.ends[:, slot] = chosen, end
        self.steps, self.ages = self.steps + 1, self.ages + 1
        over = end | (self.ages >= self.config.max_episode_steps)
        self.cars.reset(over)
        self.ages[over] = 0

    def _update(self) -> None:
        kept = min(self.steps, self.config.memory_size)
        slots = torch.randint(kept, (len(self.rows), self.config.batch_size))
        s, s_next = self.before[self.rows, slots], self.after[self.rows, slots]
        with torch.no_grad():
            following = self.fixed(s_next).amax(-1)
            y = torch.where(self.ends[self.rows, slots], 0.0, following) * self.config.gamma - 1
        actions = self.actions[self.rows, slots]
        q = self.networks(s).gather(-1, actions[..., None]).squeeze(-1)
        self.networks.step((y - q).square().mean(1).sum())
        if self.steps % self.config.copy_every == 0:
            self.fixed.copy(self.networks)
