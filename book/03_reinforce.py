# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     notebook_metadata_filter: kernelspec,jupytext,mystnb
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # REINFORCE on Acrobot and MountainCar
#
# *Section 3.1 of the report: deep-learning-based discrete REINFORCE.*
#
# **Question.** In a world of continuous states no table fits. Can a small neural network learn the
# policy directly, from nothing but the rewards of whole episodes? And do the report's numbers, about
# 100 steps on Acrobot and 180 on MountainCar, stand up when the experiment is run not once but {glue:text}`seeds` times?

# %% tags=["hide-input"]
from pathlib import Path

import numpy as np
import pandas as pd
from myst_nb import glue

from drawings import look
from drawings import reinforce as drawings
from report import provenance
from report.captions import captioned
from report.claims import details, record, verdicts, what_it_would_take
from report.figure_data import offer
from report.seeds import premise
from rl_core.evaluation import as_learned, rollout
from rl_core.training import weights_of
from studies import reinforce as study

look.use_style()
RESULTS = Path("../results")
ORIGINAL = Path("data/original")

# %% [markdown]
# ## The two worlds
#
# **Acrobot** is a double pendulum that can only push at its elbow, left, right or not at all. It has
# to swing its tip above a line. It sees six numbers: sine and cosine of both angles, and both speeds.
# **MountainCar** is a car in a valley whose engine is too weak for the slope. It has to rock back and
# forth to reach the flag on the right. It sees two numbers, position and speed. Both pay −1 for every step
# until the goal is reached (Acrobot 0 for the last one). So the undiscounted return is the number of
# steps, with a minus sign.
#
# Gymnasium ends an episode after 500 steps (Acrobot) or 200 (MountainCar). The report did not, and
# neither do we here: an episode goes on until the goal is reached. That is why curves start in the
# thousands, and why a hopeless run would never end. As in 2018 an Acrobot episode is
# stopped after 5,000 steps, and then not learned from. And every seed has a budget of four million
# environment steps. Stopped episodes and exhausted budgets are counted below, not hidden.
#
# ## Method
#
# The network maps what the agent sees, $s$, to the probabilities $\pi(a \mid s, \boldsymbol\theta)$ of the three actions:
# two hidden layers of 10 and 20 rectified linear units, then a softmax. After an episode
# $s_0, a_0, r_1, s_1, \dots, s_T$ every action is weighed by the discounted sum of the rewards that followed it,
#
# $$v_t = \sum_{k=t}^{T-1} \gamma^{k-t} r_{k+1}, \qquad
# \boldsymbol\theta \leftarrow \boldsymbol\theta + \alpha \nabla_{\boldsymbol\theta}
# \frac{1}{|B|} \sum_{t \in B} v_t \ln \pi(a_t \mid s_t, \boldsymbol\theta).$$
#
# Actions followed by much reward become more likely, the others less. That is REINFORCE. Three
# details come on top, of which the report mentions two: Adam with step size 0.001 takes the
# place of the plain step, and each episode is used three times, in shuffled batches $B$ of 512 steps. The third it
# leaves out: its program normalised the returns of each episode to mean 0 and variance 1. Only this third one is put to a test below.
# The report's text uses $\gamma = 0.9$ "but for 0.99 better"; its figures were made with 0.99.

# %%
pd.DataFrame(
    [
        {
            "arm": arm.name,
            "environment": arm.env,
            "episodes": arm.episodes,
            "seeds": len(study.SEEDS),
        }
        for arm in study.arms()
    ]
)

# %%
results = study.learn(RESULTS / "store")
provenance.keep(results, RESULTS, chapter=3)
glue("seeds", len(study.SEEDS), display=False)
curves = study.Curves(results.table)

# %% [markdown]
# ## Acrobot

# %% tags=["hide-input"]
for number, name, file in ((10, "Acrobot", "acrobot"), (11, "MountainCar", "mountaincar")):
    original = pd.read_csv(ORIGINAL / f"figure_{number}_{file}_reinforce.csv")
    figure = drawings.learning_curve(curves, f"{name}, as reported", original)
    glue(f"fig-{number}", figure, display=False)
    offer(f"figure_{number}", curves.rows([f"{name}, as reported"]))
    around = original[(original["episode"] - study.REPORTED_AT[name]).abs() < 50]
    low, high = (float(around[edge].median()) for edge in ("low", "high"))
    ours = float(np.median(curves.at(f"{name}, as reported", study.REPORTED_AT[name])))
    premise(f"{name}: our median lies within the range of the published curve", low <= ours <= high)
    said = {"Acrobot": 100, "MountainCar": 180}[name]
    premise(f"{name}: the text's number lies at the lower edge, or below", said < (low + ours) / 2)
    for edge, value in (("low", low), ("high", high), ("ours", ours)):
        glue(f"{file}-{edge}", value, display=False)
    stopped = curves.stopped_well(f"{name}, as reported")
    glue(f"{file}-stopped-well", int(stopped.sum()), display=False)
    for variant in study.VARIANTS:
        count = int(curves.learned(f"{name}, {variant}").sum())
        glue(f"{file}-{variant.replace(' ', '-')}", count, display=False)

# %% [markdown]
# ```{glue:figure} fig-10
# :name: figure-10
# :alt: Learning curves of all seeds on Acrobot over the published curve; most fall from thousands of steps to about a hundred, some never leave the cap.
#
# Learning curve for Acrobot-v1 using REINFORCE. Each thin line is a seed (median of its last 100
# episodes), the strong line their median, the band its 95% interval; behind them the curve of
# 2018, which is not smoothed. Dotted: seeds that did not learn. Data: {download}`CSV <../results/figures/figure_10.csv>`.
# ```
#
# {glue:text}`acrobot-as-reported` of {glue:text}`seeds` seeds learn (at most 500 steps in the last 100 episodes). The others ran
# out of budget. They spend it on episodes that do not end within 5,000 steps; these are stopped and thrown away, so nothing is
# learned from them. A seed that gets out of this late may be cut off while doing well ({glue:text}`acrobot-stopped-well` of them were). The
# published curve is that of a seed that got out at once.
#
# ## MountainCar
#
# ```{glue:figure} fig-11
# :name: figure-11
# :alt: Learning curves of all seeds on MountainCar over the published curve, falling from tens of thousands of steps to a few hundred.
#
# Learning curve for MountainCar-v0 using REINFORCE, drawn as Figure 10. The first episodes take
# tens of thousands of steps: a random policy hardly ever gets out of the valley. Data: {download}`CSV <../results/figures/figure_11.csv>`.
# ```
#
# {glue:text}`mountaincar-as-reported` of {glue:text}`seeds` seeds learn. The others used up their budget in enormous early episodes and were
# stopped before the end, {glue:text}`mountaincar-stopped-well` of them while doing well.
#
# Are the numbers in the report's text those of its figures? Read off the published plots, Acrobot runs between
# {glue:text}`acrobot-low:.0f` and {glue:text}`acrobot-high:.0f` steps around episode 1,000 (the text says about 100), and MountainCar between
# {glue:text}`mountaincar-low:.0f` and {glue:text}`mountaincar-high:.0f` around episode 1,500 (the text says about 180). Our medians there, {glue:text}`acrobot-ours:.0f` and {glue:text}`mountaincar-ours:.0f`, lie within the ranges of
# the figures. It is the text that is too optimistic: its numbers lie at the lower edge of its own curve, or below it.
#
# ## What mattered
#
# The report says that $\gamma = 0.99$ beats 0.9, that Acrobot needs two hidden layers and MountainCar only one.
# It does not say that returns were normalised. Each of these is an arm of its own, with one change against
# the reported settings and {glue:text}`seeds` seeds. One hidden layer means 10 units.

# %% tags=["hide-input"] mystnb={"image": {"alt": "Median learning curves with bands on Acrobot for the reported settings, gamma 0.9, one hidden layer, and raw returns."}}
names = {
    "as reported": "as reported",
    "gamma 0.9": "γ = 0.9",
    "one hidden layer": "one hidden layer",
    "raw returns": "returns not normalised",
}
glue("lost", int(curves.lost("Acrobot, gamma 0.9").sum()), display=False)
offer("figure_s3_1", curves.rows([f"Acrobot, {variant}" for variant in names]))
drawings.variants(curves, "Acrobot", names)

# %% [markdown]
# :::{container} caption
# :name: figure-s3-1
# **Figure S3.1.** Acrobot: median over {glue:text}`seeds` seeds and its 95% interval for each arm. A seed out of budget counts
# as needing for ever; where more than half are, the line ends. With γ = 0.9, {glue:text}`lost` seeds came down to 500 steps and did not stay there.
# Data: {download}`CSV <../results/figures/figure_s3_1.csv>`.
# :::

# %% tags=["hide-input"] mystnb={"image": {"alt": "Median learning curves with bands on MountainCar for the reported settings, gamma 0.9, one hidden layer, and raw returns."}}
offer("figure_s3_2", curves.rows([f"MountainCar, {variant}" for variant in names]))
drawings.variants(curves, "MountainCar", names)

# %% [markdown]
# :::{container} caption
# :name: figure-s3-2
# **Figure S3.2.** MountainCar: the same. Data: {download}`CSV <../results/figures/figure_s3_2.csv>`.
# :::

# %% tags=["hide-input"]
milestones = study.milestones(results.table, curves)
milestones.to_csv(RESULTS / "reinforce_milestones.csv", index=False)
captioned(
    milestones,
    "Table 3.1. Steps an episode at the report's milestones (each seed's median over the last 100 "
    f"episodes; median over {len(study.SEEDS)} seeds [95% interval]; ∞: more than half of the seeds had stopped). "
    "Against as reported: steps more than the same seed needs there, median.",
)
count = curves.learned("MountainCar, gamma 0.9").sum()
premise("γ = 0.9 fails on MountainCar", count <= len(study.SEEDS) / 10)

# %% [markdown]
# The rows of Table 3.1 are offered as {download}`reinforce_milestones.csv <../results/reinforce_milestones.csv>`. Arms can be compared seed by seed: with
# the same seed they get the same starts, the same random numbers behind their actions and, if their networks are alike, the same first weights.
# The claims below compare a random seed of one arm with a random seed of the other instead, as was fixed beforehand; that needs
# no pairing, and takes seeds out of budget as they are.
#
# Why does $\gamma = 0.9$ fail on MountainCar? A reward of −1 on every step makes $v_t$ a function of the time left:
# $v_t = -(1 - \gamma^{T-t})/(1-\gamma)$. With $\gamma = 0.9$ this is −10 for every step but the last twenty or so.
# In an episode of thousands of steps, all actions but the last few look alike, and the update has nothing to tell
# them apart by. With 0.99 the last two hundred steps or so carry a signal, which is about as long as the way out of the valley.
#
# ## Before and after


# %% tags=["hide-input"]
def film(name, env_id, text):
    arm = f"{name}, as reported"
    config = next(a.config for a in study.arms() if a.name == arm)
    seed, arrays = study.median_seed(curves, arm), results.arrays(arm)
    trained, untrained = (weights_of(arrays, seed, moment) for moment in ("", "initial/"))
    after = rollout(env_id, as_learned(config, trained), np.random.default_rng(0), 1_000)
    before = rollout(
        env_id, as_learned(config, untrained), np.random.default_rng(0), len(after.rewards)
    )
    glue(f"{name}-seed", seed, display=False)
    return drawings.before_and_after(env_id, before, after, description=text)


film(
    "Acrobot",
    "Acrobot-v1",
    "Acrobot before and after learning: first it dangles, then it swings its tip over the line.",
)

# %% [markdown]
# :::{container} caption
# :name: film-s3-1
# **Film S3.1.** Acrobot before learning (left) and after (right), for as long as the trained agent needs. The seed is number
# {glue:text}`Acrobot-seed`, the one in the middle when all {glue:text}`seeds` are ordered by their steps at the end.
# :::

# %% tags=["hide-input"]
film(
    "MountainCar",
    "MountainCar-v0",
    "MountainCar before and after learning: first it jitters in the valley, then it rocks itself up to the flag.",
)

# %% [markdown]
# :::{container} caption
# :name: film-s3-2
# **Film S3.2.** MountainCar before learning (left) and after (right), seed {glue:text}`MountainCar-seed`,
# again the one in the middle.
# :::
#
# ## How long it took

# %% tags=["hide-input"]
captioned(
    study.wall_clock(results, {"Acrobot": 2, "MountainCar": 3}),
    "Table 3.2. Time for one run, in the report (minutes, its machine unknown) and now, on one core.",
    formats={"2018 (s)": "{:.0f}", "now (s, mean)": "{:.1f}", "now, all seeds (s)": "{:.0f}"},
)

# %% [markdown]
# ## Verdicts
#
# The criteria stand in `book/studies/reinforce.py` and were fixed before the runs with the seeds reported here. Three things were changed when the data were
# known: "above" now excludes its bound; a claim of which no part is met and one is missed now does not hold, where before it was "cannot tell"; and the
# first ratio of 3d is over all seeds, where it had left out those that used up their budget. "About" means within a quarter. Intervals are 95% bootstrap intervals over seeds.

# %%
findings = study.findings(curves)
record(findings, RESULTS, chapter="3")
captioned(verdicts(findings), "Table 3.3. The report's claims about REINFORCE.")

# %% tags=["hide-input"]
captioned(
    details(findings),
    "Table 3.4. Each criterion with its evidence.",
)

# %% tags=["remove-cell"]
_, _, _, three_d, three_e = findings
glue("layer-ratio", three_d.evidence[0].estimate, display=False)
glue("open", what_it_would_take(findings), display=False)
learned = {arm: int(curves.learned(arm).sum()) for arm in curves.raw}
premise("a second layer helps on MountainCar", three_d.answers[0] == "no")
premise("it makes no difference that can be shown on Acrobot", three_e.answers[0] == "open")
for name in study.ENVIRONMENTS:
    most = max(learned[f"{name}, raw returns"], learned[f"{name}, gamma 0.9"])
    premise("normalisation and discount decide", 2 * most < learned[f"{name}, one hidden layer"])

# %% [markdown]
# Where a criterion is "open", its interval holds the bound. If the estimates stayed what they are, it would take
# about so many seeds to tell: {glue:text}`open`. The second criterion of 3d asks for little: if the two arms did not differ at all, two layers would
# still be the slower ones in about half of the seeds, by chance.
#
# **What to take along.** Two settings decide, and the report leaves one of them out. Without normalised returns
# {glue:text}`acrobot-raw-returns` of {glue:text}`seeds` seeds learn Acrobot and {glue:text}`mountaincar-raw-returns` learn MountainCar. All rewards are negative, so every raw return says "less of this", and the
# longest, most hopeless episodes say it loudest. With the episode's mean taken off, the better half of the actions is
# encouraged. The other is the discount: with 0.9, {glue:text}`acrobot-gamma-0.9` and {glue:text}`mountaincar-gamma-0.9` of {glue:text}`seeds` seeds learn. A second layer helps on MountainCar, where
# the report thought it too much (without it {glue:text}`layer-ratio:.2f` times as many steps), and makes no difference that {glue:text}`seeds` seeds
# can show on Acrobot, where the report thought it needed. And a single published curve is the curve of one seed: it says that a method *can*
# work, not that it does.
