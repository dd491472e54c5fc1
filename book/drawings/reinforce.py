"""Chapter 3: learning curves over those of 2018, and films of single seeds."""

from collections.abc import Mapping

import gymnasium as gym
import numpy as np
import pandas as pd
from interactive import Widget, seed_curves
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from PIL import Image

from drawings.look import BLACK, BLUE, COLOURS, GREY, LINES, Film, label, median_band
from rl_core.evaluation import Agent, Rollout, as_learned, rollout
from rl_core.experiments import Results
from rl_core.training import weights_of
from studies import reinforce as study
from studies.reinforce import DRAWN, EPISODES, Curves
from studies.shared import shown_agents

LONGEST = 300  # steps of a film
EVERY = 4  # steps from one of its pictures to the next
LIMIT = {"Acrobot": 500, "MountainCar": 200}  # Gymnasium's own time limits, for orientation


def learning_curve(curves: Curves, arm: str, original: pd.DataFrame) -> Figure:
    """Steps an episode of every seed, their median with its interval, and the curve of 2018."""
    figure, axes = plt.subplots(figsize=(6.4, 4.4))
    axes.fill_between(
        *(original["episode"], original["low"], original["high"]),
        color="#c9b458",
        alpha=0.75,
        lw=0,
        label="2018 original, one run",
    )
    x, seeds = DRAWN, curves.smooth[arm][:, DRAWN - 1]
    learned = curves.learned(arm)
    for steps, good in zip(seeds, learned, strict=True):
        axes.plot(x, steps, color=GREY if good else BLACK, ls="-" if good else ":", lw=0.6)
        stop = np.flatnonzero(np.isfinite(steps))[-1:]
        if not good and len(stop) and stop[0] + 1 < len(x):
            axes.plot(x[stop], steps[stop], "x", color=BLACK, ms=5)
    axes.plot([], [], color=GREY, ls="-", lw=0.8, label=f"{learned.sum()} seeds that learned")
    if not learned.all():
        text = f"{(~learned).sum()} that did not (× out of budget)"
        axes.plot([], [], color=BLACK, ls=":", lw=0.8, label=text)
    text = f"median of all {len(seeds)} seeds, 95% interval"
    median_band(axes, x, seeds, colour=BLUE, line="-", text=text)
    axes.set_yscale("log")
    label(axes, x="episode", y="steps to the goal (log scale)")
    axes.legend(fontsize=9)
    plt.close(figure)
    return figure


def every_seed(curves: Curves, results: Results, name: str, original: pd.DataFrame) -> Widget:
    """The learning curve as a figure that answers, with films of single seeds below it."""
    arm = f"{name}, as reported"
    config, arrays = study.arm(name, "as reported").config, results.arrays(arm)
    agents = shown_agents(
        study.shown_seeds(curves, arm),
        lambda place, moment: as_learned(config, weights_of(arrays, place, moment)),
    )
    return seed_curves(
        *(curves.rows([arm]), study.fates(curves, results.table, arm), original),
        still=learning_curve(curves, arm, original),
        films=films(study.ENVIRONMENTS[name][0], agents),
        label=f"Learning curves of all seeds on {name} over the published curve.",
        points=len(DRAWN),
    )


def variants(curves: Curves, name: str, names: Mapping[str, str]) -> Figure:
    """Median and interval of each variant on one environment; its share of seeds that learned."""
    figure, axes = plt.subplots(figsize=(6.4, 4.4))
    for i, (variant, text) in enumerate(names.items()):
        arm = f"{name}, {variant}"
        learned = curves.learned(arm)
        share = f"{text} ({learned.sum()} of {len(learned)} learned)"
        steps = curves.smooth[arm][:, DRAWN - 1]
        median_band(axes, DRAWN, steps, colour=COLOURS[i], line=LINES[i], text=share)
    axes.axhline(LIMIT[name], color=GREY, lw=0.8, ls="-")
    note = f"Gymnasium's time limit, {LIMIT[name]}"
    axes.text(0, LIMIT[name], note, ha="left", va="bottom", fontsize=8)
    axes.set_yscale("log")
    label(axes, x="episode", y="steps to the goal (log scale)")
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def profiles(curves: Curves, variants: Mapping[str, str]) -> Figure:
    """The share of seeds that need at most so many steps at the end, for each variant."""
    figure, panels = plt.subplots(1, len(LIMIT), figsize=(6.4, 3.8), sharey=True)
    for axes, name in zip(panels, LIMIT, strict=True):
        for i, (variant, text) in enumerate(variants.items()):
            steps = np.sort(curves.at(f"{name}, {variant}", EPISODES))
            share = np.arange(1, len(steps) + 1) / len(steps)
            style = {"color": COLOURS[i], "ls": LINES[i], "drawstyle": "steps-post"}
            reached = np.isfinite(steps)
            axes.plot(
                steps[reached], share[reached], **style, label=text if name == "Acrobot" else None
            )
        axes.set(xscale="log", ylim=(0, 1))
        label(axes, x="steps to the goal (log scale)", y="", title=name)
    panels[0].set_ylabel("share of seeds with at most so many")
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    plt.close(figure)
    return figure


def films(
    env_id: str, agents: Mapping[str, tuple[int | None, Agent]]
) -> dict[str, tuple[int | None, Film]]:
    """An episode of each agent, as `interactive.seed_curves` takes them.

    Parameters
    ----------
    env_id : str
    agents : mapping of str to (int or None, Agent)
        By what is said of each; with the seed that has learned it, if it is to be found by that.
    """
    shelf = {}
    for text, (seed, agent) in agents.items():
        episode = rollout(env_id, agent, np.random.default_rng(0), LONGEST)
        steps = len(episode.rewards)
        end = f"at the goal after {steps} steps" if episode.terminated else f"{steps} steps"
        name = text if seed is None else f"{text}, seed {seed}"
        frames = _frames(env_id, episode, smaller=3)[::EVERY]
        said = f"{env_id}, {name}: {end}."
        shelf[f"{name}: {end}"] = seed, Film(frames, frames_per_second=12, description=said)
    return shelf


def _frames(env_id: str, episode: Rollout, smaller: int) -> list[np.ndarray]:
    """Play the episode's actions again in Gymnasium, so many times smaller."""
    env = gym.make(env_id, render_mode="rgb_array", max_episode_steps=-1)
    env.reset(seed=episode.environment_seed)
    pictures = [env.render()]
    discrete = isinstance(env.action_space, gym.spaces.Discrete)
    for action in episode.actions:
        env.step(int(action[0]) if discrete else action)
        pictures.append(env.render())
    env.close()
    return [np.asarray(Image.fromarray(picture).reduce(smaller)) for picture in pictures]
