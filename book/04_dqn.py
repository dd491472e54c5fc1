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
# # Deep Q-networks, and why the original rewards failed
#
# *Section 3.2 of the report: deep Q networks.*
#
# **Question.** A network can also learn the value of each action, and act greedily on it. The report finds that
# this works "extremely fast" once the rewards are shaped, and that it is "extremely hard" with the original ones. It blames
# experience replay. Do its numbers stand up over many seeds? And was replay the cause?

# %% tags=["hide-input"]
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from myst_nb import glue

from drawings import dqn as drawings
from drawings import look
from report import provenance, settings
from report.captions import captioned
from report.claims import details, record, verdicts, what_it_would_take
from report.figure_data import offer, tidy
from report.listings import listing
from report.paste import paste
from report.seeds import premise
from rl_core.dqn import DQNConfig, dqn
from rl_core.evaluation import rollout
from rl_core.experiments import Arm, run
from rl_core.policies import MLP
from rl_core.training import weights_of
from rl_core.worlds.shaping import Shaping
from studies import dqn as study
from studies import dqn_again as again
from studies import dqn_numbers as numbers
from studies.curves import learning_curves
from studies.shared import of_values

look.use_style()
RESULTS = Path("../results")
ORIGINAL = Path("data/original")
glue("seeds", len(study.SEEDS), display=False)

# %% [markdown]
# ## Method
#
# The network maps a state to three values $Q(s, a; \boldsymbol\theta)$, one an action. The agent takes the action of
# largest value, or, with probability $\varepsilon$, any. Every step $(s, a, r, s')$ goes into a memory of the latest
# 3,000 (Acrobot) or 4,000 steps (MountainCar). After each step a batch $B$ is drawn from it, and the network is moved towards
#
# $$\begin{gathered} y = r + \gamma \max_{a'} Q(s', a'; \boldsymbol\theta^-), \\
# L(\boldsymbol\theta) = \frac{1}{|B|} \sum_{B} \bigl(y - Q(s, a; \boldsymbol\theta)\bigr)^2, \end{gathered}$$
#
# where $\boldsymbol\theta^-$ is a copy of the weights that is renewed every 300 updates only. The report has both, the memory (experience replay) and the copy (fixed Q-targets), from D. Silver's course
# (see the [references](references.md)). The lines that do it:

# %% tags=["hide-input"]
listing("rl_core.dqn:TorchLearner.loss", "The target and the loss.")

# %% tags=["hide-input"]
listing("rl_core.dqn:TorchLearner.update", "One update, and the copy.")

# %% tags=["hide-input"]
listing("rl_core.dqn:act", "The action.")

# %% [markdown]
# In the code `s_next` is $s'$, `self.network` is $Q(\cdot; \boldsymbol\theta)$ and `self.fixed` is $Q(\cdot; \boldsymbol\theta^-)$;
# `end` says which $s'$ are terminal. The thirty seeds run on a compiled twin of these lines; further down one seed runs on both.
#
# **What the network sees** is the whole state: Acrobot's two angles (as cosines and sines) and their speeds, or the car's position and velocity.
# The report suspects a "lack of state features" behind MountainCar: "we don't have full representation of the world". That is not so.
# Position, velocity and push determine the next position and velocity; nothing else is in the world.
#
# **The shaped rewards** are the report's: the height of Acrobot's tip, $-(\cos\theta_1 + \cos(\theta_1 + \theta_2))$,
# and the car's distance from $-0.5$, which is $|x + 0.5|$. The report calls $-0.5$ the mean of a Gaussian from which the start is drawn. The start is drawn
# uniformly, from $-0.6$ to $-0.4$; $-0.5$ is the middle of that. The bottom of the valley is nearby, at $-\pi/6 \approx -0.52$.
#
# **Three things the report leaves out.** The program kept **no terminal flag**: a target bootstraps through the end of an episode,
# as if the world went on behind the goal. The network has **no biases**. And **the exploration follows the goals**. In this book
# $\varepsilon$ is the probability of a random action. (The report's $\varepsilon$ is 1 minus that.) It starts at 0.9 and stays there until the first goal.
# After each episode that reached the goal it moves half-way to 0.1, and a little further at each copy of the network. So the report's advice, a schedule that exploits more
# "when the agent keeps progressing", is what its own program did here. (The notes on the program leave open from where the mid-point for the copies
# is taken; we take it after the move at the episode's end.)
#
# As in 2018 an episode is stopped after 5,000 steps (Acrobot) or 10,000 (MountainCar). The program left such
# episodes out of its curves; here they are drawn. The report says batches of 512; its program really used 32.
# Learning starts when the memory is full.
#
# The reported configuration for Acrobot, as code, is this. MountainCar's has a memory of 4,000, learns from step 4,000 on, and has its own shaping and stop.

# %%
reported = DQNConfig.report_2018(
    gamma=0.99,
    network=MLP((10, 20), biases=False),
    learning_rate=0.001,  # of RMSProp
    batch_size=512,
    memory_size=3_000,
    learning_starts=3_000,
    copy_every=300,
    shaping=Shaping("studies.rewards:tip_height"),
    bootstrap_through_end=True,  # no terminal flag
    max_episode_steps=5_000,
    max_env_steps=150_000,  # what a seed may use up in all
)
assert reported == study.reported("Acrobot")

# %% tags=["hide-input"]
captioned(
    settings.hyperparameters(reported).query("hyperparameter != 'shaping.code'"),
    "Table 4.1. Every setting of the reported arm on Acrobot.",
)

# %% tags=["hide-input"]
every = [*study.arms(), *again.arms()]
of_env = [
    settings.table([arm for arm in every if arm.name.startswith(name)], f"{name}, as reported")
    for name in study.ENV
]
unsaid = r"shaping.code=\w+(, |$)"  # a digest
captioned(
    pd.concat(of_env).replace({"differs": unsaid}, "", regex=True),
    f"Table 4.2. Every arm, and where it differs from the reported one of its environment. The last of each have seeds "
    f"{again.FRESH[0]} to {again.FRESH[-1]}, the others {study.SEEDS[0]} to {study.SEEDS[-1]}. Three on Acrobot "
    f"also run on {again.NEAR_A_BOUND[0]} to {again.NEAR_A_BOUND[-1]}.",
)

# %% [markdown]
# All arms are run with every seed, or read where they were run before:

# %%
results = study.learn(RESULTS / "store")
fresh = again.learn(RESULTS / "store")
near_a_bound = again.learn_near(RESULTS / "store")
made = pd.concat([one.provenance for one in (results, fresh, near_a_bound)])
provenance.keep(replace(results, provenance=made), RESULTS, chapter=4)
curves = study.Curves(results.table)
near = study.Curves(near_a_bound.table, again.NEAR_A_BOUND)
glue("near-seeds", f"{again.NEAR_A_BOUND[0]} to {again.NEAR_A_BOUND[-1]}", display=False)

# %% [markdown]
# ## The two curves of the report

# %% tags=["hide-input"]
for number, name, file in ((12, "Acrobot", "acrobot"), (13, "MountainCar", "mountaincar")):
    original = pd.read_csv(ORIGINAL / f"figure_{number}_{file}_dqn.csv")
    figure = drawings.every_seed(curves, results, name, original)
    glue(f"fig-{number}", figure, display=False)
    offer(f"figure_{number}", curves.table[f"{name}, as reported"])
    around = original[(original["episode"] - 20).abs() <= 5]
    for edge in ("low", "high"):
        glue(f"{file}-{edge}", float(around[edge].median()), display=False)
    for episode in study.MILESTONES:
        steps = float(np.median(curves.at(f"{name}, as reported", episode)))
        glue(f"{file}-at-{episode}", steps, display=False)
    glue(f"{file}-learned", int(curves.learned(f"{name}, as reported").sum()), display=False)

# %% [markdown]
# ```{glue:figure} fig-12
# :name: figure-12
# :alt: Learning curves of all seeds on Acrobot with DQN and shaped rewards over the published curve, falling within a few episodes from thousands of steps.
#
# Learning curve for Acrobot-v1 using DQN with the shaped reward. Each thin line is a seed, unsmoothed as the curve of
# 2018 behind them; the strong line is their median, the band its 95% interval; crosses are episodes stopped before the goal. Data: {download}`CSV <../results/figures/figure_12.csv>`.
# ```
#
# ```{glue:figure} fig-13
# :name: figure-13
# :alt: Learning curves of all seeds on MountainCar with DQN and shaped rewards over the published curve, falling within some ten episodes from ten thousand steps.
#
# Learning curve for MountainCar-v0 using DQN with the shaped reward, drawn as Figure 12. Data: {download}`CSV <../results/figures/figure_13.csv>`.
# ```
#
# The films below the figures are of single seeds: the best, the one in the middle, the worst that learned and the first that did not, by their steps at the end, as trained, one
# action in ten at random; and the one in the middle before learning, nine in ten at random.
#
# After 20 episodes the median seed takes {glue:text}`acrobot-at-20:.0f` steps on Acrobot (the text of the report says 80, its figure shows about
# {glue:text}`acrobot-low:.0f`) and {glue:text}`mountaincar-at-20:.0f` on MountainCar (text 140, figure about {glue:text}`mountaincar-low:.0f`); after 100 episodes
# {glue:text}`acrobot-at-100:.0f` and {glue:text}`mountaincar-at-100:.0f`. At the end {glue:text}`acrobot-learned` of {glue:text}`seeds` seeds need a median of at most 500 steps in their last 10 episodes on Acrobot, and {glue:text}`mountaincar-learned` on MountainCar.

# %% tags=["hide-input"]
milestones = study.milestones(curves)
milestones.to_csv(RESULTS / "dqn_milestones.csv", index=False)
captioned(
    milestones,
    "Table 4.3. Steps an episode at the report's milestone and later (each seed's median over the last 10 "
    f"episodes; median over {len(study.SEEDS)} seeds [95% interval]).",
)

# %% tags=["hide-input"]
findings = study.findings(curves, near)
about = study.about(findings, curves)
captioned(
    about,
    'Table 4.4. What hangs on the meaning of "about" in 3f and 3g: half the width of the window, as a share of the reported steps; the share of seeds inside '
    "it; and the verdict.",
    formats={"window": "{:.0%}", "low": "{:.0f}", "high": "{:.0f}", "share": "{:.0%}"},
)

# %% tags=["remove-cell"]
trained = study.as_trained(results)
paste(numbers.of_figure_13(curves, trained))
for sentence, holds in study.premises_of_figure_13(curves).items():
    premise(sentence, holds)
premise(
    "The last networks need their random actions on MountainCar.",
    np.isinf(trained["MountainCar, as reported"][0.1]).sum()
    < np.isinf(trained["MountainCar, as reported"][0.0]).sum(),
)

# %% [markdown]
# **Does it stay?** The report says "converge". On MountainCar {glue:text}`inside-20` of {glue:text}`seeds` seeds are within a quarter of 140 steps after 20 episodes, {glue:text}`inside-50` after
# 50 and {glue:text}`inside-100` after 100. The median goes from {glue:text}`car-20` to {glue:text}`car-50` and {glue:text}`car-100` steps. Seeds that need at most 500 steps
# fall from {glue:text}`car-good-20` to {glue:text}`car-good-100`. So the car reaches the level of the report, and some of it is lost again.
#
# **Does it need its random actions?** The last networks were tried in 20 new episodes of at most 1,000 steps each, once as trained, one action in ten at random, and once greedily.
# As trained the median seed takes {glue:text}`MountainCar at 0.1` steps on MountainCar, and {glue:text}`MountainCar lost at 0.1` seeds do not arrive in half of their episodes or more.
# Greedily it takes {glue:text}`MountainCar at 0.0`, and {glue:text}`MountainCar lost at 0.0` do not arrive. So some need a random push now and then. On Acrobot the steps are
# {glue:text}`Acrobot at 0.1` and {glue:text}`Acrobot at 0.0`, and {glue:text}`Acrobot lost at 0.1` and {glue:text}`Acrobot lost at 0.0` seeds do not arrive.
#
# ## One seed in torch
#
# The listings above are the statement; the seeds of this chapter run on its compiled twin. Here seed 0 of the reported arm on Acrobot runs on both.

# %%
both = study.engines("Acrobot", 0, RESULTS / "store")

# %% tags=["hide-input"] mystnb={"image": {"alt": "Steps an episode of seed 0 on Acrobot, learned by the compiled and by the torch learner, over all seeds as reported."}}
steps = {
    engine: learning_curves(rows, seeds=[0], episodes=study.EPISODES)
    for engine, rows in both.table.groupby("arm", sort=False)
}
offer("figure_s4_5", tidy(np.arange(1, study.EPISODES + 1), steps, value="steps", seeds=range(1)))
for engine, seconds in both.provenance.set_index("arm")["processor_seconds"].items():
    glue(f"{engine} seconds", f"{seconds:.1f}", display=False)
glue("same", study.same_at_first(steps["compiled"][0], steps["torch"][0]), display=False)
drawings.over_the_reported(
    curves, "Acrobot, as reported", {f"seed 0, {k}": v for k, v in steps.items()}
)

# %% [markdown]
# :::{container} caption
# :name: figure-s4-5
# **Figure S4.5.** Seed 0 on Acrobot with both learners, over all seeds. Data: {download}`CSV <../results/figures/figure_s4_5.csv>`.
# :::
#
# The compiled learner took {glue:text}`compiled seconds` s of the processor's time, torch {glue:text}`torch seconds` s. Both draw from the same random streams, and their tests hold
# them together update by update. Episodes from the first on with equal numbers of steps: {glue:text}`same`. Then they part. The two add the same numbers in another order, so that
# their sums differ in the last digit. Sooner or later two actions are so nearly worth the same that the last digit decides between them. From that step on the two see different states,
# and their curves are no more alike than those of two seeds.
#
# ## Change one thing
#
# This cell is for you: replace one setting, and see what three seeds make of it. Here it is the discount of 0.9, which the report gives first. Only what is new is run again.

# %%
changed = replace(reported, gamma=0.9)
arm = Arm("changed", dqn, "Acrobot-v1", changed, episodes=50)
tried = run([arm], seeds=range(3), store=RESULTS / "store")

# %% mystnb={"image": {"alt": "Steps an episode of three seeds on Acrobot with one setting changed, over all seeds as reported."}}
steps = learning_curves(tried.table, seeds=range(3), episodes=50)
offer("figure_s4_6", tidy(np.arange(1, 51), {"changed": steps}, value="steps", seeds=range(3)))
drawings.over_the_reported(curves, "Acrobot, as reported", {"changed, three seeds": steps})

# %% [markdown]
# :::{container} caption
# :name: figure-s4-6
# **Figure S4.6.** Three seeds with one setting changed, over all seeds as reported. Data: {download}`CSV <../results/figures/figure_s4_6.csv>`.
# :::

# %% [markdown]
# ## What the tricks are worth
#
# Is it replay that makes this work, or the fixed target, or the discount? Each is an arm with one change. From here on
# batches have 32 transitions, as in the program, and every seed of an environment has the same budget of environment steps, 25,000 for Acrobot and
# 45,000 for MountainCar. What we measure is what a goal costs at the end: the steps of the last quarter of the
# budget, divided by the goals reached in it. Stopped episodes count in it with all their steps. Without replay
# means: the memory holds the latest 32 steps and nothing else.

# %% tags=["hide-input"] mystnb={"image": {"alt": "Steps a goal over the budget on both environments for the shaped reward, gamma 0.9, no replay and no fixed target."}}
tricks = {
    "shaped": "shaped reward, all tricks",
    "shaped, gamma 0.9": "γ = 0.9",
    "shaped, no replay": "no replay",
    "shaped, no fixed target": "no fixed target",
}
offer("figure_s4_1", study.parts(curves, list(tricks)))
drawings.over_the_budget(curves, tricks)

# %% [markdown]
# :::{container} caption
# :name: figure-s4-1
# **Figure S4.1.** Shaped reward: steps a goal in each tenth of the budget, median over seeds and its 95% interval. Where most seeds
# reached no goal, the line is interrupted. Data: {download}`CSV <../results/figures/figure_s4_1.csv>`.
# :::

# %% tags=["hide-input"]
captioned(
    study.to_the_budget(curves, list(tricks)),
    "Table 4.5. Steps a goal in the last quarter of the budget (median over seeds [95% interval]; ∞: no goal), and "
    "how many seeds learn (at most 500 steps a goal; 95% interval of the share).",
)

# %% tags=["hide-input"] mystnb={"image": {"alt": "Share of seeds that need at most so many steps a goal, on both environments, for the shaped reward, gamma 0.9, no replay and no fixed target."}}
of_arm = {
    name: {text: curves.steps_a_goal(f"{name}, {arm}") for arm, text in tricks.items()}
    for name in study.ENV
}
random = {
    name: np.median(again.steps_a_goal(fresh, again.controls(name)[-1])) for name in study.ENV
}
offer(
    "figure_s4_7",
    pd.concat(
        {k: pd.DataFrame(v) for k, v in of_arm.items()}, names=["environment", "seed"]
    ).reset_index(),
)
drawings.profiles(of_arm, random)

# %% [markdown]
# :::{container} caption
# :name: figure-s4-7
# **Figure S4.7.** How many seeds get how far: the share of seeds that need at most so many steps a goal in the last quarter of the budget. The further left and up, the better.
# Grey: 500 steps, which counts as learned. Dotted: an agent that learns nothing and keeps each random action for ten steps. Data: {download}`CSV <../results/figures/figure_s4_7.csv>`.
# :::

# %% tags=["remove-cell"]
paste(numbers.of_tricks(curves, near, findings, tricks))
for sentence, holds in study.premises_of_tricks(curves).items():
    premise(sentence, holds)

# %% [markdown]
# **The discount (3i).** On MountainCar the discount of 0.9 is better, not that of 0.99. It teaches {glue:text}`MountainCar, shaped, gamma 0.9 count` of {glue:text}`seeds` seeds, at a median of
# {glue:text}`MountainCar, shaped, gamma 0.9 median` steps a goal; 0.99 teaches {glue:text}`MountainCar, shaped count`, at {glue:text}`MountainCar, shaped median`. The probability that a seed with 0.99 does better
# than one with 0.9 is {glue:text}`3i 3`. On Acrobot the first {glue:text}`seeds` seeds left it open, and with it the verdict. So seeds {glue:text}`near-seeds` decide there, and these alone.
# On them the probability is {glue:text}`3i 1`.
# Why should looking less far ahead help? This is a guess: time. A copy of the network is at best one round of value iteration, and each round leaves at most a share $\gamma$ of the error. The budget has
# room for {glue:text}`copies` copies. With 0.9 hardly anything is left after that ({glue:text}`left 0.9`). With 0.99 as much as {glue:text}`left 0.99` may be left.
# A bad step size could pass for a bad discount. The second round below gives 0.99 two other step sizes.
#
# Which discount is *faster* we measure in tenths of the budget until 200 steps a goal first suffice. That is a coarse clock. Draw one seed with each discount. In {glue:text}`ties Acrobot` of
# all such pairs on Acrobot, and in {glue:text}`ties MountainCar` on MountainCar, the two get there in the same tenth, or both never. Such a tie counts as a half, and pulls the probability towards one half.
#
# **Replay (3j)** helps on both: the probability that a seed with it does better is {glue:text}`3j 1` on Acrobot and {glue:text}`3j 2` on MountainCar, where without it {glue:text}`MountainCar, shaped, no replay count`
# seeds learn instead of {glue:text}`MountainCar, shaped count`.
#
# **The fixed target (3k)** matters most on MountainCar. Without it {glue:text}`MountainCar, shaped, no fixed target count` of {glue:text}`seeds` seeds learn, and the probability that it helps is
# {glue:text}`3k 2`. On Acrobot the interval of the first seeds ended so near to one half that seeds {glue:text}`near-seeds` decide there, too: {glue:text}`3k 1`.

# %% [markdown]
# ## Why the original rewards failed
#
# With the original reward, −1 a step, the report found it "extremely hard" to converge. Its explanation: replay tears the steps apart, all of them
# look alike, and so the agent is "unable to see the effect of reaching the goal". If that were the cause, nothing
# would help as long as the reward and the replay stay. There are rivals.
#
# - **The terminal flag.** Without it the last step, too, has the target $-1 + \gamma \max_{a'} Q(s', a')$. The constant
#   $Q = -1/(1-\gamma) = -100$ then solves every equation on MountainCar: $-1 + 0.99 \cdot (-100) = -100$. It does so whatever the actions do, so a network that has found it
#   learns nothing more about the way to the flag. Acrobot pays 0 instead of −1 on reaching its goal. There the last step has the target $0 + 0.99 \cdot (-100) = -99$, one more than all others: a weak signal, but one.
# - **Exploration.** Steps taken at random cancel out. A car that is pushed left and right by turns does not leave the valley, and where no
#   goal is reached there is nothing to learn. Mended in two ways at once. *Persistence*: a random action, once begun, is kept for ten steps.
#   *Schedule*: the probability $\varepsilon$ that such a run begins falls from 1 to 0.1 over half the budget, whether or not the goal is reached.
#   One run is ten steps long, so the share of random steps is larger than $\varepsilon$: $10\varepsilon / (10\varepsilon + 1 - \varepsilon)$. At the end it is
#   {glue:text}`random-share`. What a goal costs is measured with these steps in it.
# - **A memory too short** to hold a success until it is needed. Mended: the memory holds everything.
# - **No biases.** A network of rectified units without biases is homogeneous: doubling the state doubles the values,
#   $Q(\lambda s) = \lambda Q(s)$ for $\lambda > 0$, and $Q(0) = 0$. MountainCar's state has its zero at rest half-way up the slope to the flag.
#   Values near −100 everywhere but at the flag cannot be drawn by such a network. (Acrobot's state holds sines
#   and cosines and is never near zero.) Mended: biases are learned.
#
# Each is mended alone, then all but one, then all four. The reward is the original one in all of these arms, and replay is on.
# Two arms do without replay: one has nothing mended, the other the terminal flag, the exploration and the biases. (The second was added when the data of the others
# were known, and no criterion uses it.)

# %% tags=["hide-input"] mystnb={"image": {"alt": "Share of seeds that learn, with intervals, for each cause mended alone, all but one, all four, and without replay, on both environments."}}
variants = ["shaped", *study.causes(), study.NO_REPLAY_MENDED, "original, no replay"]
offer("figure_s4_2", study.shares(curves, variants))
drawings.shares(curves, variants)

# %% [markdown]
# :::{container} caption
# :name: figure-s4-2
# **Figure S4.2.** Share of seeds that learn (at most 500 steps a goal in the last quarter of the budget), with its 95% interval.
# "+" names what is mended with the original reward kept; "no replay": the memory holds the latest 32 steps only. Data: {download}`CSV <../results/figures/figure_s4_2.csv>`.
# :::

# %% tags=["hide-input"]
captioned(
    study.to_the_budget(curves, variants),
    "Table 4.6. What each change does to the failure, as Table 4.5.",
)

# %% tags=["hide-input"] mystnb={"image": {"alt": "Steps a goal over the budget on both environments for the shaped reward, the original one, and the original one with causes mended."}}
story = {
    "shaped": "shaped reward",
    "original": "original reward",
    "original, terminal flag": "original, terminal flag",
    "original, all but biases": "original, all but biases",
    "original, all four": "original, all four mended",
}
offer("figure_s4_3", study.parts(curves, list(story)))
drawings.over_the_budget(curves, story)

# %% [markdown]
# :::{container} caption
# :name: figure-s4-3
# **Figure S4.3.** Steps a goal in each tenth of the budget, drawn as Figure S4.1. Data: {download}`CSV <../results/figures/figure_s4_3.csv>`.
# :::

# %% tags=["remove-cell"]
paste(numbers.of_replay(curves, results, variants) | numbers.of_chance(fresh))
for sentence, holds in study.premises_of_replay(curves).items():
    premise(sentence, holds)

premise("500 steps are better than chance.", min(random.values()) > study.LEARNED)
car_arms = [arm.name for arm in study.arms() if arm.name.startswith("MountainCar, ")]
at_200 = [(curves.steps_a_goal(arm) <= 200).mean() for arm in car_arms if "reported" not in arm]
premise("At 200 steps hardly a seed is left on MountainCar.", max(at_200) <= 0.1)

# %% tags=["hide-input"]
goal_costs = {
    arm: curves.steps_a_goal(arm)
    for name in study.ENV
    for arm in (
        f"{name}, {variant}"
        for variant in ("shaped", "shaped, gamma 0.9", *study.causes(), study.NO_REPLAY_MENDED)
    )
} | {arm: again.steps_a_goal(fresh, arm) for name in study.ENV for arm in again.controls(name)}
captioned(
    study.thresholds(goal_costs),
    "Table 4.7. Seeds by what a goal costs them in the last quarter of the budget, at three thresholds, beside agents that act at random and learn nothing. "
    f"The random ones have seeds {again.FRESH[0]} to {again.FRESH[-1]}.",
)

# %% [markdown]
# **Is 500 steps a goal learned, or luck?** An agent that acts at random, but keeps each action for ten steps, needs {glue:text}`Acrobot-random-10` steps a goal on Acrobot and {glue:text}`MountainCar-random-10` on
# MountainCar (medians). One that draws a new action at every step needs {glue:text}`Acrobot-random-1` and {glue:text}`MountainCar-random-1`. So 500 steps a goal are better than chance, but not by much.
# Table 4.7 has the counts at stricter thresholds too. At 200 steps hardly a seed is left on MountainCar, whatever the reward. These costs have the random steps in them.
#
# **And without the random steps?** The greedy policies of the seeds with all four mended, in 20 episodes of at most 1,000 steps each, take {glue:text}`MountainCar-greedy` steps on MountainCar and {glue:text}`Acrobot-greedy` on Acrobot (median over
# seeds of each seed's median). {glue:text}`MountainCar-stuck` seeds on MountainCar and {glue:text}`Acrobot-stuck` on Acrobot do not arrive in half of their episodes or more: these need the random steps to get anywhere.
#
# ## A second round
#
# The first round left some sentences of this book to guess. They got criteria when the data above were known. Then the arms were run on seeds that
# nobody had seen, {glue:text}`fresh`. All are on MountainCar.
#
# - *No single change mends it*: would more time? Of the single changes biases alone taught any seed, so they got four times the budget. Ten times the budget was not run, nor four times with
#   the other changes: a seed of it costs as many steps as ten of the seeds above. So of those changes the sentence says no more than this: not within {glue:text}`car-budget` steps.
# - *Exploration* was mended in two ways at once. Each is taken away in turn.
# - *The discount*, or the step size? In claim 3i both discounts have the step size 0.001. So 0.99 got two others, one about three times smaller and one three times larger, and is held against 0.9 with 0.001.
# - *"Valid" shaping.* The report calls its shaped rewards an "intuitive, valid choice". A shaping is sure to leave the best policy what it was if it adds a difference of potentials,
#   $\gamma \Phi(s') - \Phi(s)$ (Ng, Harada and Russell, see the references). The report's is no such difference, and it is never negative. With a terminal flag, whoever reaches
#   the flag is paid no more. A worked case: to swing for ever at a mean distance of a half is worth $0.5 / (1 - 0.99) = 50$. To arrive is worth about 1. So the best policy does *not* arrive. Without the terminal flag this does not show,
#   as the program bootstraps on behind the goal. Both shapings are tried with all four causes mended, the flag with them: the report's, and $-1 + \gamma \Phi(s') - \Phi(s)$ with the report's
#   $\Phi(s) = |x + 0.5|$, and $\Phi = 0$ at the goal. (Our shaping functions see the next state only. The car's last position follows from it, $x = x' - v'$; this is off only where the car hits the wall. Acrobot's last state does not follow so simply.)

# %% tags=["hide-input"]
second = again.judged(fresh)
second.to_csv(RESULTS / "dqn_second_round.csv", index=False)
captioned(
    second.drop(columns="arm"),
    "Table 4.8. The second round: share of seeds [95% interval from low to high], and whether the criterion is met.",
    formats=dict.fromkeys(("share", "low", "high"), "{:.2f}"),
)

# %% tags=["hide-input"]
sized = again.step_sizes(fresh)
captioned(
    sized,
    "Table 4.13. The discount or the step size? MountainCar, shaped reward; seeds that learn with 0.99 and the step size named.",
)

# %% tags=["remove-cell"]
for text, arm in (("nearer", again.NEARER), *again.STEP_SIZES.items()):
    steps = again.steps_a_goal(fresh, arm)
    glue(f"learn {text}", int((steps <= study.LEARNED).sum()), display=False)
premise("0.9 is better with either step size", set(sized["met"]) == {"yes"})
few, many = sized["seeds that learn"]
before = (curves.steps_a_goal("MountainCar, shaped") <= study.LEARNED).sum()
premise("a larger step closes much of the gap", few < before < many)
glue("car-budget", f"{study.BUDGET['MountainCar']:,}", display=False)
glue("fresh", f"{again.FRESH[0]} to {again.FRESH[-1]}", display=False)
for arm, count in zip(second["arm"], second["seeds"], strict=True):
    glue(arm, count, display=False)
for sentence, holds in again.premises(second).items():
    premise(sentence, holds)

# %% [markdown]
# Of the five criteria of Table 4.8 the first is met. The others are open: their intervals hold the bound. What the seeds say all the same:
#
# **More time** does not do it. With biases alone and four times the budget, {glue:text}`MountainCar, original, biases, 4 times the budget` seeds learn.
#
# **The discount, or the step size.** With 0.9 and the step size 0.001, {glue:text}`learn nearer` of {glue:text}`seeds` seeds learn. With 0.99 it is {glue:text}`learn 0.0003` with the smaller step size, and
# {glue:text}`learn 0.003` with the larger (Table 4.13). So 0.9 does better than 0.99 with any of the step sizes tried, but a larger step closes much of the gap: a part of what claim 3i shows is the step size.
#
# **Exploration** is persistence more than schedule. When random actions are not kept, {glue:text}`MountainCar, original, all four without persistence` seeds learn. When $\varepsilon$ follows the goals as in 2018, but random actions are kept,
# {glue:text}`MountainCar, original, all four without the schedule` do. So it was not the schedule of 2018 that stood in the way most, but random steps that cancel out.
#
# **Shaping.** With the report's shaping and a terminal flag the greedy policies of {glue:text}`MountainCar, shaped, all four` seeds arrive; with the potentials, in all else the same, those of {glue:text}`MountainCar, potential, all four`. The intervals of the
# two shares do not meet. This is what the worked case says: an agent that knows where the world ends stays away from the end. So the report's choice is "valid" only together with its missing flag. A difference of potentials
# is safe with the flag. It was not needed here: with the original reward and all four mended, {glue:text}`MountainCar-arrive` of {glue:text}`seeds` seeds of the first round arrive.
#
# ## What the network has learned
#
# MountainCar's state has two numbers, so that its values can be drawn whole: on the left $\max_a Q(s, a)$, on the right the push
# the greedy policy gives, and over both the way of one episode. The seeds are those in the middle when all are
# ordered by what a goal costs them at the end.

# %% tags=["hide-input"] mystnb={"image": {"alt": "Value and greedy push over position and velocity of MountainCar, with a trajectory spiralling outwards to the flag, for the shaped and for the original reward."}}
policies = {}
for title, arm in (
    ("Shaped reward", "MountainCar, as reported"),
    ("Original, all mended", "MountainCar, original, all four"),
):
    place = study.middle(curves, arm)
    weights = weights_of(results.arrays(arm), place)
    policies[title] = (
        weights,
        rollout("MountainCar-v0", of_values(weights), np.random.default_rng(0), 1_000),
    )
offer("figure_s4_4", drawings.plane_table(policies))
drawings.state_plane(policies)

# %% [markdown]
# :::{container} caption
# :name: figure-s4-4
# **Figure S4.4.** MountainCar: values (left) and greedy push (right). The line is one greedy episode from its start (dot), at most 1,000 steps; dotted:
# the flag. Without biases (top) all lines of equal push run through the origin, as they must. Data: {download}`CSV <../results/figures/figure_s4_4.csv>`.
# :::
#
# ## How long it took

# %% tags=["hide-input"]
captioned(
    study.seconds(results),
    "Table 4.9. Time for one run, in the report (its machine unknown) and now, on one core.",
    formats={"2018 (s)": "{:.0f}", "now (s, mean)": "{:.1f}", "now, all seeds (s)": "{:.0f}"},
)

# %% [markdown]
# The 3 and 5 seconds of the report are for 20 episodes, ours are for 100, with batches of 512. Its program used batches of 32. Chapter 6 compares like work.
#
# ## Verdicts
#
# The criteria stand in `book/studies/dqn.py` and were fixed before the runs with the seeds shown. What was changed later is listed in the appendix. "About"
# means within a quarter. Intervals are 95% intervals over seeds.

# %%
record(findings, RESULTS, chapter="4", about=about)
captioned(verdicts(findings), "Table 4.10. The report's claims about DQN.")

# %% tags=["hide-input"]
captioned(details(findings), "Table 4.11. Each criterion with its evidence.")

# %% tags=["remove-cell"]
glue("open", what_it_would_take(findings), display=False)
for sentence, holds in study.premises(curves).items():
    premise(sentence, holds)

# %% [markdown]
# Where a criterion is "open", the interval holds the bound. If estimates stayed what they are, it would take about so many seeds to tell with a chance of 80%: {glue:text}`open`. (No number: the estimate
# is the bound itself, or the interval has no end.)
#
# **What to take along.** On MountainCar's original reward {glue:text}`MountainCar-original` of {glue:text}`seeds` seeds learn within the budget, and
# {glue:text}`MountainCar, original seen` ever see the flag. No single change mends that. With all four together {glue:text}`MountainCar-original, all four` seeds learn, and the reward is still −1 a step and replay is
# still on. That is more than the shaped reward teaches with the same batch and budget, {glue:text}`MountainCar-shaped`. Table 4.12 shows which of the four are needed.

# %% tags=["hide-input"]
captioned(
    study.mended_alone_or_not(curves),
    "Table 4.12. Seeds that learn on the original reward when a cause is mended alone, and when all causes but it are.",
)

# %% [markdown]
# Read it by its second columns. Where the learning stops when a change is taken away, that change is needed. On MountainCar these are the terminal flag, the exploration and the biases. Where
# it does not stop, the change is not needed once the others are made. That is the long memory.
#
# Acrobot is another case. There the original reward is not hopeless as it is: {glue:text}`Acrobot-original` of {glue:text}`seeds` seeds learn, and {glue:text}`Acrobot-original, all but terminal flag` learn without the
# terminal flag once the rest is mended. Random torques reach the line now and then, the last step's 0 leaves a signal behind, and the network's inputs are never near zero. Which of these three matters was not tried.
#
# **Was it replay?** The answer depends on what else is mended. Where nothing is, no more seeds learn without replay: {glue:text}`MountainCar-original, no replay` on MountainCar and {glue:text}`Acrobot-original, no replay` on Acrobot.
# But on MountainCar agents without replay *see* the flag more often: {glue:text}`MountainCar, original, no replay seen` seeds against {glue:text}`MountainCar, original seen` (Fisher's exact test: p = {glue:text}`fisher`),
# {glue:text}`MountainCar, original, no replay times` flags against {glue:text}`MountainCar, original times`. So there the report saw something.
# With the terminal flag, the exploration and the biases mended, and a reward as uniform as before, it is the other way round.
# {glue:text}`MountainCar-original, all but long memory` seeds learn MountainCar with the report's memory, and {glue:text}`MountainCar-original, all mended, no replay` without replay
# ({glue:text}`Acrobot-original, all but long memory` and {glue:text}`Acrobot-original, all mended, no replay` on Acrobot). So uniform rewards seen one step at a time do not stop the learning: the report's cause is not the one.
#
# **Why does the report's shaping help, then?** Not because replay then has something to see: it learns without, too. Shaping pays for every step away from the middle, so that the car swings out, and so finds the flag. And its values need
# neither the end of the episode nor biases: the shaped arms have neither. (The two reasons are guesses; no arm parts them.) It has a price. On MountainCar the return it adds up to ranks policies the wrong way round; on Acrobot it ranks them almost
# as the steps do. Chapter 6 measures both.


# %% [markdown]
# ## Exercises
#
# **1.** The report's settings wait for goals to lower epsilon. On CartPole every episode ends. Compare them with the defaults of `DQNConfig`: what is the best mean return of 20 episodes in a row, within the same budget of steps?

# %% tags=["hide-cell"]
from rl_core.dqn import DQNConfig, dqn

budget = {"max_env_steps": 8_000}
{
    name: dqn("CartPole-v1", config, episodes=8_000, seeds=[0])
    .table["return"]
    .rolling(20)
    .mean()
    .max()
    for name, config in (
        ("report", DQNConfig.report_2018(batch_size=32, **budget)),
        ("defaults", DQNConfig(**budget)),
    )
}

# %% [markdown]
# **2.** The target of a transition: compute it by hand for a reward of −1, a discount of 0.99 and next values of −3 and −2, for a step that ends at the goal and for one that was cut off.

# %% tags=["hide-cell"]
reward, gamma, following = -1.0, 0.99, (-3.0, -2.0)
{"goal": reward, "cut off": round(reward + gamma * max(following), 2)}
