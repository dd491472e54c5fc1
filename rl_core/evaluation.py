"""How good a policy is: many fresh episodes, without learning, from the same starts for everyone.

An agent that was trained with some seed is tried out on streams that its training never saw. The
start states come from one of them, actions from another, so that all agents evaluated with a seed
face the same starts and can be compared pair by pair.

An agent is a network that puts out preferences for actions, or the mean of a continuous one. One
whose largest output is followed is no different kind: with probabilities proportional to
exp(Q / T), the largest value wins as T goes to 0 (Sutton and Barto, 2018, section 13.1). Neither is
one that acts at random: its preferences are equal. A table of action values is an agent too.
"""

import io
import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import pandas as pd
import torch
from gymnasium import spaces
from gymnasium.wrappers import TransformObservation
from numpy.typing import NDArray

from rl_core import modules
from rl_core.checks import floats, generator, instance, integer, require, truth
from rl_core.dqn import DQNConfig
from rl_core.identity import canonical_json, describe, restored
from rl_core.kernels import likelihood, networks
from rl_core.kernels.arrays import BYTE
from rl_core.kernels.likelihood import Actor, Policy
from rl_core.mdp import MDP
from rl_core.policies import MLP, Categorical, Gaussian, make_policy
from rl_core.q_learning import QLearningConfig
from rl_core.reinforce import ReinforceConfig
from rl_core.worlds import environments, episodes
from rl_core.worlds.discretise import Grid, action_levels, make_grid
from rl_core.worlds.environments import EnvironmentLike, GymnasiumWorld, World, task_of
from rl_core.worlds.episodes import AnyActor, ModuleActor, TableActor, Trajectory, play_episode
from rl_core.worlds.names import Make, find
from rl_core.worlds.twins import twin

SPAWN_KEY = (1_000,)
"""Names the streams of evaluation among a seed's; learners use small numbers."""

COLD = np.float32(2.0**40)
"""1 / T of a greedy policy. A power of two, so that it rounds nothing."""

COLUMNS = ("episode", "steps", "return", "terminated")
"""The columns of a table of evaluation, besides the measures."""

Weights = Mapping[str, NDArray[np.float32]]
"""The weights of one seed by name, as `rl_core.training.weights_of` takes them out of a run."""

Measure = Callable[[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64]], float]
"""Observations, actions and rewards of an episode to a number."""


Spaces = tuple[spaces.Space[Any], spaces.Space[Any]]
"""What is observed and what is done."""

FORMAT = "rl_core agent 2"


@dataclass(frozen=True)
class Agent:
    """Who acts: a policy with its parameters, and what it was made of.

    `rl_core.training.Run.agent` makes one of a seed that was trained, `load` of a file.

    Attributes
    ----------
    actor : Actor, ModuleActor or TableActor
        Turns noise into actions, see `rl_core.worlds.episodes.act`.
    config : dataclass or None
        Of the run that made it. What `save` keeps, like the next two.
    weights : mapping of str to array
        What was learned.
    spaces : tuple of gymnasium.spaces.Space, or None
        Of the observations and the actions. None: vectors, and numbers from 0 or vectors.
    env : str, Make, gymnasium.Env, callable or None
        What it was trained on.
    rng : numpy.random.Generator
        What `predict` and `film` draw from.
    """

    actor: AnyActor
    config: Any = None
    weights: Mapping[str, NDArray[Any]] = field(default_factory=dict, repr=False)
    spaces: Spaces | None = None
    env: Any = None
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0), repr=False)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[Any, Any]:
        """Return an action and the state, with the arguments of Stable-Baselines3's policies.

        Parameters
        ----------
        observation : array
            One observation, or a batch of them, as vectorised environments give.
        state, episode_start : object
            Of a policy with a memory. This has none: the state is given back as it came.
        deterministic : bool
            Whether to act by what `greedy` says, without noise.

        Returns
        -------
        action : numpy.integer or array
            Or a batch of them. A continuous action as drawn, as in training: not clipped to bounds.
        state : object

        Raises
        ------
        ValueError
            The observations have another shape.

        Examples
        --------
        >>> import numpy as np
        >>> from rl_core.dqn import DQNConfig
        >>> from rl_core.evaluation import as_learned
        >>> weights = {"layer0.weight": np.array([[1, 2]], np.float32)}
        >>> agent = as_learned(DQNConfig(epsilon=0), weights)
        >>> agent.predict(np.ones(1)), agent.predict(np.ones((2, 1)))[0]
        ((np.int64(1), None), array([1, 1]))
        """
        chosen = greedy(self) if truth("deterministic", deterministic) else self
        actor = episodes.with_own_scratch(chosen.actor)
        policy = actor.policy
        n_seen = int(policy.sizes[0]) - policy.constant_feature
        shape = (n_seen,) if self.spaces is None else self.spaces[0].shape
        try:
            seen = np.asarray(observation)
        except (RuntimeError, TypeError, ValueError):  # ragged, or what its own code raises
            seen = np.asarray(None)
        fits = seen.dtype.kind in "fiub" and shape in (seen.shape, seen.shape[1:])
        allowed = f"numbers of shape {shape}, or a batch of such"
        require(fits, "observation", f"{seen.dtype} of shape {seen.shape}", allowed)
        first = seen.reshape(-1, n_seen).astype(np.float32)
        if (seen if self.spaces is None else self.spaces[0]).dtype == np.uint8:
            first *= BYTE
        actions = np.empty((len(first), policy.action_width), np.float32)
        draw = self.rng.standard_normal if policy.gaussian else self.rng.random
        for one, action in zip(first, actions, strict=True):
            actor.noise[:] = draw(actor.noise.size)
            episodes.act(actor, one, actor.noise, action)
        native = _native(actions, policy, self.spaces)
        return (native[0] if seen.shape == shape else native), state

    def save(self, path: str | Path) -> None:
        """Write configuration and weights to one file: arrays and JSON, for `load`.

        Raises
        ------
        ValueError
            The agent is not of a run, so there is no configuration.
        OSError
            The file cannot be written.
        """
        path = instance("path", path, str | Path, "a str or Path")
        require(self.config is not None and self.spaces, "agent", self, "one of a run, to be saved")
        assert self.spaces is not None
        env = self.env if isinstance(self.env, str | Make) else None
        arrays: dict[str, Any] = {f"weights {name}": array for name, array in self.weights.items()}
        told: list[dict[str, Any]] = []
        for i, space in enumerate(self.spaces):
            if isinstance(space, spaces.Discrete):
                told.append({"n": int(space.n), "start": int(space.start)})
            elif isinstance(space, spaces.Box):
                told.append({"dtype": str(space.dtype)})
                arrays |= {f"{i} low": space.low, f"{i} high": space.high}
        about = {"format": FORMAT, "config": describe(self.config), "env": describe(env, "env")}
        about["spaces"] = told
        buffer = io.BytesIO()
        np.savez_compressed(buffer, about=np.array(canonical_json(about)), **arrays)
        Path(path).write_bytes(buffer.getvalue())

    def film(
        self,
        path: str | Path,
        *,
        env: EnvironmentLike | None = None,
        seed: int = 0,
        max_steps: int = 1_000,
        deterministic: bool = False,
    ) -> Path:
        """Play an episode in Gymnasium and write it as a film (mp4).

        Parameters
        ----------
        path : str or Path
        env : optional
            By default what the agent was trained on. It has to draw itself (`rgb_array`).
        seed : int
            Of the environment's `reset`.
        max_steps : int
            Where to stop an episode that has not ended.
        deterministic : bool
            As for `predict`.

        Raises
        ------
        ImportError
            The extra `render` is not installed.
        TypeError, ValueError
            The environment cannot be drawn, or an argument is not as described.
        OSError
            The film cannot be written.
        """
        try:
            import imageio_ffmpeg
        except ImportError as error:
            raise ImportError(
                "a film needs the extra 'render': pip install imageio-ffmpeg pygame"
            ) from error
        path = instance("path", path, str | Path, "a str or Path")
        seed, max_steps = integer("seed", seed), integer("max_steps", max_steps, 1)
        with closing(_drawn(self.env if env is None else env)) as world:
            observation, _ = world.reset(seed=seed)
            pictures: list[Any] = [world.render()]
            ended = False
            while not ended and len(pictures) <= max_steps:
                action, _ = self.predict(observation, deterministic=deterministic)
                observation, _, terminated, truncated, _ = world.step(action)
                pictures.append(world.render())
                ended = terminated or truncated
            height, width = (side - side % 2 for side in pictures[0].shape[:2])
            rate = world.metadata.get("render_fps", 30)
            writer = imageio_ffmpeg.write_frames(
                str(path), (width, height), fps=rate, macro_block_size=2
            )
            writer.send(None)
            for picture in pictures:
                writer.send(np.ascontiguousarray(picture[:height, :width]))
            writer.close()
        return Path(path)


def load(path: str | Path, rng: np.random.Generator | None = None) -> Agent:
    """Return the agent that `Agent.save` wrote to a file.

    Parameters
    ----------
    path : str or Path
    rng : numpy.random.Generator, optional
        What it draws from; by default one of seed 0.

    Raises
    ------
    OSError
        The file cannot be read.
    TypeError, ValueError
        The file is damaged or another, or names a class or network that is not to be found.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from rl_core.evaluation import load
    >>> from rl_core.reinforce import ReinforceConfig, reinforce
    >>> run = reinforce("CartPole-v1", ReinforceConfig(), episodes=1, seeds=[0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     run.agent(seed=0).save(Path(folder) / "agent.npz")
    ...     agent = load(Path(folder) / "agent.npz")
    >>> agent.config == ReinforceConfig()
    True
    """
    content = Path(instance("path", path, str | Path, "a str or Path")).read_bytes()
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            arrays = dict(file)
        about = json.loads(str(arrays["about"]))
        require(about["format"] == FORMAT, "format", about["format"], FORMAT)
        seen, done = (
            spaces.Discrete(told["n"], start=told["start"])
            if "n" in told
            else spaces.Box(arrays[f"{i} low"], arrays[f"{i} high"], dtype=told["dtype"])
            for i, told in enumerate(about["spaces"])
        )
        config, env = restored(about["config"]), restored(about["env"])
        kept = (name.partition("weights ") for name in arrays)
        weights = {name: arrays[start + name] for _, start, name in kept if start}
        agent = as_learned(config, weights, spaces=(seen, done), env=env)
    except Exception as error:  # whatever a damaged file makes of zipfile, numpy and json
        raise ValueError(
            f"path must be a file that Agent.save wrote, got {str(path)!r}: {error}"
        ) from error
    return agent if rng is None else replace(agent, rng=generator("rng", rng))


def spaces_of(env: Any) -> Spaces:
    """Return what is observed of an environment or model, and what is done in it.

    Examples
    --------
    >>> from rl_core.evaluation import spaces_of
    >>> spaces_of("FrozenLake-v1")
    (Discrete(16), Discrete(4))
    """
    if isinstance(env, MDP):
        return spaces.Discrete(env.n_states), spaces.Discrete(env.n_actions)
    if (task := task_of(env)) is not None:
        return task.observation_space, task.action_space
    made = environments.opened(env)
    if made is not env:
        made.close()
    return made.observation_space, made.action_space


def as_learned(
    config: Any,
    weights: Mapping[str, NDArray[Any]],
    *,
    spaces: Spaces | None = None,
    env: Any = None,
    rng: np.random.Generator | None = None,
) -> Agent:
    """Return the policy that was learned, as it acted in the end.

    That of REINFORCE is the stochastic policy itself. DQN's is epsilon-greedy with the last epsilon
    of its schedule, a random action lasting one step; that of a table with the epsilon of its
    trials (`QLearningConfig.evaluation`). The configuration of any other algorithm says it by a
    method `actor(weights, observation_space, action_space)`.

    Parameters
    ----------
    config : ReinforceConfig, DQNConfig, QLearningConfig, or one with a method `actor`
        Of the run that made the weights.
    weights : mapping of str to array
        Of one seed, as `rl_core.training.weights_of` gives them.
    spaces : tuple of gymnasium.spaces.Space, optional
        Of observations and actions (`spaces_of`); an MLP needs none.
    env, rng
        See `Agent`.

    Raises
    ------
    TypeError, ValueError
        `config` is none of these, or needs spaces, or the weights are not of its network or table,
        or without the `log_sigma` of a Gaussian.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.evaluation import as_learned
    >>> from rl_core.policies import MLP
    >>> from rl_core.reinforce import ReinforceConfig
    >>> weights = {"layer0.weight": np.zeros((2, 3), np.float32)}
    >>> as_learned(ReinforceConfig(network=MLP(())), weights).actor.policy.sizes
    array([2, 3])
    """
    known = isinstance(config, ReinforceConfig | DQNConfig | QLearningConfig)
    allowed = "a configuration of REINFORCE, DQN or Q-learning, or one with a method `actor`"
    instance("config", config, object if known or hasattr(config, "actor") else (), allowed)
    instance("weights", weights, Mapping, "a mapping of names to arrays")
    actor = _actor(config, weights, spaces)
    rng = np.random.default_rng(0) if rng is None else generator("rng", rng)
    return Agent(actor, config, weights, spaces, env, rng)


def _actor(config: Any, weights: Mapping[str, NDArray[Any]], found: Spaces | None) -> AnyActor:
    deep = isinstance(config, ReinforceConfig | DQNConfig)
    if deep and isinstance(config.network, MLP):
        return _perceptron_actor(config, weights)
    if found is None:
        raise ValueError(f"spaces must be given for {config}, got None")
    if isinstance(config, QLearningConfig):
        return _table_actor(config, weights, *found)
    if deep:
        return _module_actor(config, weights, *found)
    made: AnyActor = config.actor(weights, *found)
    return made


def _perceptron_actor(
    config: ReinforceConfig | DQNConfig, weights: Mapping[str, NDArray[Any]]
) -> AnyActor:
    sizes, parameters = networks.pack(weights)
    if isinstance(config, DQNConfig):
        actor = _cold(likelihood.make_actor(_categorical(*sizes), parameters))
        return actor._replace(epsilon=_last_epsilon(config))
    if not isinstance(config.policy, Gaussian):
        return likelihood.make_actor(_categorical(*sizes), parameters)
    given = "log_sigma" in weights
    require(given, "weights", sorted(weights), "with 'log_sigma', since the policy is Gaussian")
    log_sigma, weighted = weights["log_sigma"], config.policy.mean == "weights"
    form = True, weighted, config.policy.constant_feature, len(log_sigma)
    parameters = np.append(parameters, log_sigma).astype(np.float32)
    return likelihood.make_actor(Policy(np.array(sizes), *form), parameters)


def _module_actor(
    config: ReinforceConfig | DQNConfig, weights: Mapping[str, NDArray[Any]], seen: Any, done: Any
) -> AnyActor:
    distribution = Categorical() if isinstance(config, DQNConfig) else config.policy
    n_actions = int(getattr(done, "n", 0))
    n_components = 0 if n_actions else math.prod(done.shape or (1,))
    policy = make_policy(distribution, (), math.prod(seen.shape or (1,)), n_actions, n_components)
    n_in, n_out = policy.sizes.tolist()
    module = modules.make_module(config.network, n_in, n_out, np.random.default_rng(0))
    own = {name: array for name, array in weights.items() if name != "log_sigma"}
    modules.load_arrays(module, own)
    log_sigma = torch.tensor(weights.get("log_sigma", np.zeros(0, np.float32)))
    actor = ModuleActor(policy, module.eval(), log_sigma, np.empty(policy.action_width))
    if not isinstance(config, DQNConfig):
        return actor
    return actor._replace(scale=COLD, epsilon=_last_epsilon(config))


def _last_epsilon(config: DQNConfig) -> float:
    epsilon: Any = config.epsilon
    return float(getattr(epsilon, "end", epsilon))


def _table_actor(
    config: QLearningConfig, weights: Mapping[str, NDArray[Any]], seen: Any, done: Any
) -> TableActor:
    if isinstance(seen, spaces.Discrete):
        n, first = int(seen.n), float(seen.start) - 0.5
        require(n <= 2**24, "spaces", seen, "of at most 2**24 states, which float32 can count")
        grid = Grid(np.array([first]), np.array([first + n]), np.array([n]))
    else:
        require(config.bins, "bins", config.bins, f"given for observations of {seen}")
        assert config.bins is not None
        grid = make_grid(seen, config.bins)
    actions = action_levels(done, config.levels)
    Q = floats("Q", weights["Q"], (grid.n_cells, len(actions)), finite=False)
    policy = _categorical(len(grid.bins), len(actions), width=actions.shape[1])
    return TableActor(policy, grid, Q, actions, config.evaluation.epsilon, np.empty(2))


def _categorical(*sizes: int, width: int = 1) -> Policy:
    return Policy(np.array(sizes), False, False, False, width)


def greedy(agent: Agent) -> Agent:
    """Return the agent that does what another most likely does: argmax of pi, or mu.

    Discrete actions: preferences are divided by a temperature of 2^-40, and epsilon is 0. Of
    several equal outputs, one is drawn. Continuous actions: sigma is 0.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.evaluation import Agent, COLD, greedy
    >>> from rl_core.kernels import likelihood
    >>> from rl_core.kernels.likelihood import Policy
    >>> policy = Policy(np.array([1, 2]), False, False, False, 1)
    >>> agent = Agent(likelihood.make_actor(policy, np.array([1, 2, 0, 0], np.float32)))
    >>> greedy(agent).actor.parameters / COLD
    array([1., 2., 0., 0.], dtype=float32)
    """
    actor = instance("agent", agent, Agent, "an Agent").actor
    if isinstance(actor, ModuleActor):
        still = torch.full_like(actor.log_sigma, -math.inf)
        return replace(agent, actor=actor._replace(log_sigma=still, scale=COLD, epsilon=0.0))
    if isinstance(actor, Actor):
        actor = _cold(actor)
    return replace(agent, actor=actor._replace(epsilon=0.0))


def _cold(actor: Actor) -> Actor:
    policy, parameters = actor.policy, actor.parameters.copy()
    if policy.gaussian:
        parameters[parameters.size - policy.action_width :] = -np.inf
    else:
        inputs, outputs = policy.sizes[-2:]
        parameters[parameters.size - (inputs + 1) * outputs :] *= COLD
    return actor._replace(parameters=parameters)


def uniform(n_observations: int, n_actions: int) -> Agent:
    """Return the agent that draws one of several discrete actions with equal probabilities.

    Examples
    --------
    >>> from rl_core.evaluation import uniform
    >>> uniform(6, 3).actor.parameters.any()
    np.False_
    """
    n_observations = integer("n_observations", n_observations, 1)
    n_actions = integer("n_actions", n_actions, 1)
    zeros = np.zeros((n_observations + 1) * n_actions, np.float32)
    return Agent(likelihood.make_actor(_categorical(n_observations, n_actions), zeros))


def evaluation_streams(seed: int) -> tuple[int, np.random.Generator]:
    """Return what the environment is seeded with, and the stream of the policy.

    Examples
    --------
    >>> from rl_core.evaluation import evaluation_streams
    >>> evaluation_streams(0)[0] == evaluation_streams(1)[0]
    False
    """
    seed = integer("seed", seed)
    environment, policy = np.random.SeedSequence(seed, spawn_key=SPAWN_KEY).spawn(2)
    return int(environment.generate_state(1)[0]), np.random.default_rng(policy)


def evaluate(
    env: EnvironmentLike,
    agent: Agent,
    *,
    seed: int,
    episodes: int,
    max_steps: int,
    measures: Mapping[str, Measure] | None = None,
) -> pd.DataFrame:
    """Play episodes with a policy as it is.

    Parameters
    ----------
    env : str, gymnasium.Env or callable
        As for `rl_core.reinforce.reinforce`; the compiled tasks have no time limit of their own.
    agent : Agent
    seed : int
        The same seed gives the same starts to any agent, as long as the environment draws nothing
        after its `reset`.
    episodes : int
        How many.
    max_steps : int
        Where to stop an episode that has not ended.
    measures : mapping of str to callable, optional
        Further columns: `measure(observations, actions, rewards)` of the episode, with arrays of
        shape (T + 1, n_observations), (T, action_width) and (T,). Their names are not those of
        the other columns.

    Returns
    -------
    pandas.DataFrame
        One row an episode: `episode` (from 1), `steps`, `return` (undiscounted), `terminated`
        (false: stopped by `max_steps` or the environment's own time limit), and the measures.

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range, or the policy does not fit the environment.

    Examples
    --------
    >>> from rl_core.evaluation import evaluate, uniform
    >>> table = evaluate("MountainCar-v0", uniform(2, 3), seed=0, episodes=2, max_steps=50)
    >>> table["return"].tolist(), table["terminated"].tolist()
    ([-50.0, -50.0], [False, False])
    """
    environment_seed, rng = evaluation_streams(seed)
    episodes = integer("episodes", episodes, 1)
    measures = {} if measures is None else measures
    valid = isinstance(measures, Mapping) and all(callable(one) for one in measures.values())
    require(valid, "measures", measures, "a mapping of names to functions, or None")
    taken = sorted(set(measures) & set(COLUMNS))
    require(not taken, "measures", taken, f"under names other than {', '.join(COLUMNS)}")
    rows = []
    for found in _played(env, agent, environment_seed, rng, max_steps, episodes):
        seen, done, rewards, terminated = found
        row = {"steps": len(rewards), "return": rewards.sum(), "terminated": terminated}
        rows.append(row | {name: of(seen, done, rewards) for name, of in measures.items()})
    table = pd.DataFrame(rows)
    table.insert(0, "episode", np.arange(1, len(table) + 1))
    return table


def _played(
    env: EnvironmentLike,
    agent: Agent,
    environment_seed: int,
    rng: np.random.Generator,
    max_steps: int,
    episodes: int,
) -> Iterator[tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64], bool]]:
    """Play episodes; give observations, actions and rewards, which the next overwrites, and end."""
    max_steps = integer("max_steps", max_steps, 1)
    with closing(_opened(env, agent)) as world:
        world.seed(environment_seed)
        trajectory = Trajectory(world.n_observations, agent.actor.policy.action_width)
        for _ in range(episodes):
            steps, terminated = play_episode(world, agent.actor, rng, max_steps, trajectory)
            _, actions, rewards = trajectory.first(steps)
            yield trajectory.observations[: steps + 1], actions, rewards, terminated


def check_fit(agent: Agent, world: World) -> None:
    """Raise unless an agent takes the observations of a world and puts out its actions.

    Raises
    ------
    ValueError
        If the number of inputs, the kind or number of actions, or of parameters is another.

    Examples
    --------
    >>> from rl_core.evaluation import check_fit, uniform
    >>> from rl_core.worlds.environments import open_world
    >>> check_fit(uniform(2, 5), open_world("MountainCar-v0"))
    Traceback (most recent call last):
    ValueError: agent must be a categorical policy of 3 actions, got a categorical policy of 5
    """
    instance("agent", agent, Agent, "an Agent")
    instance("world", world, World, "a world that was opened")
    actor, policy = agent.actor, agent.actor.policy
    sizes, width = policy.sizes.tolist(), policy.action_width
    table = isinstance(actor, TableActor)
    inputs = world.n_observations + policy.constant_feature
    what = "a table over" if table else "a network of"
    require(sizes[0] == inputs, "agent", sizes, f"{what} {inputs} inputs")
    kind = f"a Gaussian policy of {width}"
    kind = kind if policy.gaussian else f"a categorical policy of {sizes[-1]}"
    if world.n_actions > 0:
        allowed = f"a categorical policy of {world.n_actions} actions"
        fits = not policy.gaussian and sizes[-1] == world.n_actions
    else:
        allowed = f"a Gaussian policy of {world.action_dimensions} components"
        fits = (policy.gaussian or table) and width == world.action_dimensions
    if not fits:
        raise ValueError(f"agent must be {allowed}, got {kind}")
    if isinstance(actor, Actor):
        shape = (networks.count_parameters(sizes) + policy.gaussian * width,)
        found = np.shape(actor.parameters)
        require(found == shape, "agent", found, f"a policy with parameters of shape {shape}")


def _opened(env: EnvironmentLike, agent: Agent) -> World:
    """Open a world for an agent that fits it; states that have a number are seen as that number."""
    instance("agent", agent, Agent, "an Agent")
    world: World
    if isinstance(agent.actor, TableActor) and isinstance(spaces_of(env)[0], spaces.Discrete):
        made, seen = environments.opened(env), spaces.Box(-np.inf, np.inf, (1,))
        numbers = TransformObservation(made, lambda state: np.array([state], np.float32), seen)
        world = GymnasiumWorld(numbers, owned=made is not env)
    else:
        world = environments.open_world(env)
    check_fit(agent, world)
    return world


def _native(actions: NDArray[np.float32], policy: Policy, found: Spaces | None) -> Any:
    """Return actions as their environment takes them."""
    done = None if found is None else found[1]
    if isinstance(done, spaces.Box):
        return actions.astype(done.dtype).reshape(-1, *done.shape)
    if policy.gaussian:
        return actions
    return actions[:, 0].astype(np.int64) + int(getattr(done, "start", 0))


def _drawn(env: Any) -> gymnasium.Env[Any, Any]:
    """Open an environment that draws itself, with the time limit that it is played with here."""
    found: Any = find(env) if isinstance(env, str) else env
    picture: dict[str, Any] = {"render_mode": "rgb_array"}
    if isinstance(env, str) and (task := twin(env)) is not None:
        picture["max_episode_steps"] = task.max_episode_steps or -1
    try:
        if found is None:
            found = gymnasium.make(env, **picture)
        elif isinstance(env, Make):
            found = gymnasium.make(env.id, **{**env.arguments, **picture})
        elif callable(found) and not isinstance(found, gymnasium.Env):
            with suppress(TypeError):  # it takes no such argument
                found = found(**picture)
            found = found() if callable(found) else found
    except (gymnasium.error.Error, TypeError, ValueError) as error:
        raise ValueError(f"env must be one that can be drawn, got {env!r}: {error}") from error
    draws = isinstance(found, gymnasium.Env) and found.render_mode == "rgb_array"
    require(draws, "env", env, "an environment of Gymnasium's with render_mode='rgb_array'")
    film: gymnasium.Env[Any, Any] = found
    return film


class Rollout(NamedTuple):
    """One episode, for a picture or an animation.

    Attributes
    ----------
    observations : float32 array of shape (T + 1, n_observations)
    actions : float32 array of shape (T, action_width)
        Indices of discrete actions, or continuous actions as drawn.
    rewards : float64 array of shape (T,)
    terminated : bool
        False if stopped at `max_steps`, or truncated by the environment.
    environment_seed : int
        `env.reset(seed=environment_seed)` and the actions play the episode again in Gymnasium.
    """

    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float64]
    terminated: bool
    environment_seed: int


def rollout(
    env: EnvironmentLike, agent: Agent, rng: np.random.Generator, max_steps: int
) -> Rollout:
    """Play one episode and keep all of it, for a picture or an animation.

    Parameters
    ----------
    env : str, Make, Task, gymnasium.Env or callable
        See `rl_core.worlds.environments.open_world`.
    agent : Agent
    rng : numpy.random.Generator
        Draws the environment's seed and the actions.
    max_steps : int
        Where to stop an episode that has not ended.

    Returns
    -------
    Rollout

    Raises
    ------
    ValueError, TypeError
        If an argument is out of range, the environment unknown, or the policy does not fit it.

    Examples
    --------
    >>> import numpy as np
    >>> from rl_core.evaluation import rollout, uniform
    >>> episode = rollout("MountainCar-v0", uniform(2, 3), np.random.default_rng(0), 100)
    >>> episode.observations.shape, episode.terminated
    ((101, 2), False)
    """
    rng = generator("rng", rng)
    environment_seed = int(rng.integers(2**32))
    (episode,) = _played(env, agent, environment_seed, rng, max_steps, 1)
    return Rollout(*episode, environment_seed)
