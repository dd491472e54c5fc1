"""Chapter 3: learning curves over those of 2018, and films of the agent before and after."""

from collections.abc import Mapping

import gymnasium as gym
import numpy as np
import pandas as pd
from matplotlib import font_manager
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont

from drawings.look import BLACK, BLUE, COLOURS, GREY, LINES, Film, label, median_band
from rl_core.evaluation import Rollout
from studies.reinforce import DRAWN, Curves

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


def before_and_after(env_id: str, before: Rollout, after: Rollout, description: str) -> Film:
    """Two episodes side by side: with the initial weights and with the trained ones."""
    left, right = (_frames(env_id, episode) for episode in (before, after))
    length = max(len(left), len(right))
    pictures = []
    for t in range(0, length + 30, 3):
        halves = [
            _titled(frames[min(t, len(frames) - 1)], f"{title}: step {min(t, len(frames) - 1)}")
            for frames, title in ((left, "before"), (right, "after"))
        ]
        pictures.append(np.concatenate(halves, axis=1))
    return Film(pictures, frames_per_second=15, description=description)


def _frames(env_id: str, episode: Rollout) -> list[np.ndarray]:
    """Play the episode's actions again in Gymnasium, at half size."""
    env = gym.make(env_id, render_mode="rgb_array", max_episode_steps=-1)
    env.reset(seed=episode.environment_seed)
    pictures = [env.render()]
    discrete = isinstance(env.action_space, gym.spaces.Discrete)
    for action in episode.actions:
        env.step(int(action[0]) if discrete else action)
        pictures.append(env.render())
    env.close()
    return [np.asarray(Image.fromarray(picture).reduce(2)) for picture in pictures]


def _titled(frame: np.ndarray, title: str) -> np.ndarray:
    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), 14)
    picture = Image.new("RGB", (frame.shape[1], frame.shape[0] + 24), "white")
    picture.paste(Image.fromarray(np.ascontiguousarray(frame)), (0, 24))
    ImageDraw.Draw(picture).text((6, 3), title, font=font, fill="black")
    return np.asarray(picture)
