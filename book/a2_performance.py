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
# # Performance
#
# **Question.** Thirty seeds of everything would be a luxury if they took thirty times as long. What do they take,
# compared with how such experiments are usually run? And how does the cost grow?
#
# Three things are done to make it cheap. Whole episodes are compiled: environment, network and the drawing of actions, with no Python
# in between. The learners are compiled too. And results are kept under a digest of all that made them, so nothing is computed twice.

# %% tags=["hide-input"]
import pandas as pd
from myst_nb import glue

from drawings import look
from drawings import performance as drawings
from report.captions import captioned
from report.seeds import premise
from studies import performance as study

look.use_style()
bench = pd.read_csv("data/bench.csv")
growth = pd.read_csv("data/growth.csv")
for name, table in {"bench": bench, "growth": growth}.items():
    glue(f"{name}-machine", table["machine"].iloc[0], display=False)
    glue(f"{name}-date", table["date"].iloc[0], display=False)
ratios = bench[bench["low"].notna()]
for verdict in drawings.MARKS:
    glue(f"n-{verdict.replace(' ', '-')}", int((ratios["verdict"] == verdict).sum()), display=False)
glue("n-ratios", len(ratios), display=False)
glue("n-turns", int(ratios["turns"].min()), display=False)

# %% [markdown]
# ## Beside others
#
# `make bench` measures ours and its rivals in turns, in one run on one machine, and with the same settings. Costs are processor time, so
# that what neighbours take is not counted, and a rival on several cores pays for each. A ratio is taken within a turn; shown are the
# median over at least {glue:text}`n-turns` turns and its 95% interval (bootstrap over turns). Ours counts as faster only where the whole interval lies
# above 1: in {glue:text}`n-faster` of {glue:text}`n-ratios` comparisons; in {glue:text}`n-slower` it is slower, in {glue:text}`n-cannot-tell`
# the measurement cannot tell. Measured on {glue:text}`bench-date` on: {glue:text}`bench-machine`.
#
# The rivals differ in kind. The usual loops and Stable-Baselines3 train one seed in Python. The vmapped DQN in JAX and the networks
# stacked in torch train all thirty at once, as ours do. Storm and QuantEcon.py are written for planning.

# %% tags=["hide-input"] mystnb={"image": {"alt": "For each comparison, how many times as long the rival takes as ours: a point and its interval on a logarithmic axis, with a line at 1."}}
drawings.ratios(ratios)

# %% [markdown]
# :::{container} caption
# :name: figure-b-1
# **Figure B.1.** How many times as long the rival takes (logarithmic), and its 95% interval. Left of the line at 1 ours is slower. Circles:
# ours is faster; squares: cannot tell; triangles: ours is slower. Data: {download}`CSV <data/bench.csv>`.
# :::

# %% tags=["hide-input"]
captioned(
    drawings.in_words(bench),
    "Table B.1. The same in numbers, and the memory. What is held against a limit has no interval.",
    formats=dict.fromkeys(["rival", "ours"], "{:.4g}"),
)

# %% tags=["hide-input"]
captioned(
    bench[["benchmark", "against", "unit", "turns", "note"]], "Table B.2. How each was measured."
)

# %% [markdown]
# ## How the cost grows
#
# Measured by the same command, in processor time but for Figure B.5, on {glue:text}`growth-date` on: {glue:text}`growth-machine`. REINFORCE trains on MountainCar, every
# episode stopped at 500 steps, so that each seed and each episode is the same work. Value iteration plans random mazes with three flags.

# %%
parts = dict(iter(growth.groupby("what")))
power = {what: study.power(parts[what]) for what in ("seeds", "episodes", "states")}
law = study.serial_share(parts["cores"])
of_a_state = study.each(parts["states"]) * 1e6
premise("A state takes longer in the largest maze.", of_a_state.iloc[-1] > of_a_state.min())

# %% tags=["hide-input"]
for what, value in power.items():
    glue(f"power-{what}", value, display=False)
for name, states in {"least": of_a_state.idxmin(), "last": of_a_state.index[-1]}.items():
    glue(f"states-{name}", f"{states:,}", display=False)
    glue(f"state-{name}", float(of_a_state[states]), display=False)
for name, share in {"share": law.share, "low": law.low, "high": law.high}.items():
    glue(f"serial-{name}", 100 * share, display=False)
for cores in (2, 16):
    glue(f"speed-up-{cores}", float(law.speed_up(cores)), display=False)
    glue(f"speed-up-{cores}-low", float(law.speed_up(cores, law.high)), display=False)
    glue(f"speed-up-{cores}-high", float(law.speed_up(cores, law.low)), display=False)

# %% tags=["hide-input"] mystnb={"image": {"alt": "Processor seconds of REINFORCE against the number of seeds, 1 to 32, on logarithmic axes, close to the dashed line of proportional growth."}}
drawings.growth(parts["seeds"], "seeds")

# %% [markdown]
# :::{container} caption
# :name: figure-b-2
# **Figure B.2.** Processor time of 50 episodes of REINFORCE on one core, against the number of seeds. Dots: turns; line: their median;
# dashed: growth in proportion. Data of Figures B.2 to B.5: {download}`CSV <data/growth.csv>`.
# :::
#
# The time grows with the number of seeds to the power of {glue:text}`power-seeds:.2f`; 1 is proportional.

# %% tags=["hide-input"] mystnb={"image": {"alt": "Processor seconds of one seed of REINFORCE against the number of episodes, 25 to 800, on logarithmic axes, close to the dashed line of proportional growth."}}
drawings.growth(parts["episodes"], "episodes")

# %% [markdown]
# :::{container} caption
# :name: figure-b-3
# **Figure B.3.** Processor time of one seed of REINFORCE on one core, against the number of episodes. Dots: turns; line: their median;
# dashed: growth in proportion. Data: {download}`CSV <data/growth.csv>`.
# :::
#
# With the number of episodes it grows to the power of {glue:text}`power-episodes:.2f`.

# %% tags=["hide-input"] mystnb={"image": {"alt": "Processor seconds of value iteration against the number of states, a thousand to ten million, on logarithmic axes, beside the dashed line of proportional growth."}}
drawings.growth(parts["states"], "states")

# %% [markdown]
# :::{container} caption
# :name: figure-b-4
# **Figure B.4.** Processor time of value iteration (γ = 0.99, error at most 10⁻⁶) on one core, against the number of states. Dots: turns; line: their
# median; dashed: growth in proportion. Data: {download}`CSV <data/growth.csv>`.
# :::
#
# With the number of states it grows to the power of {glue:text}`power-states:.2f`, but unevenly: a state takes least in the maze of {glue:text}`states-least`
# states, {glue:text}`state-least:.2f` µs, and {glue:text}`state-last:.2f` µs in the one of {glue:text}`states-last`. Two guesses: a small maze pays for what a call costs
# in any case, and of a large one less fits into the processor's caches. Table B.1 has the memory.

# %% tags=["hide-input"] mystnb={"image": {"alt": "Seconds of an experiment against cores, 1 to 64, on logarithmic axes: measured at one and two, a dotted computed curve with a band beyond, and the dashed line of proportional growth below."}}
drawings.cores(parts["cores"], law)

# %% [markdown]
# :::{container} caption
# :name: figure-b-5
# **Figure B.5.** What an experiment, 30 seeds of REINFORCE with 3,000 episodes each, takes by the clock against the cores it may use, the start
# of the workers included. Dots: measured on one and on two; dotted: computed from them by Amdahl's law, with the 95% interval of the serial share; dashed: growth in proportion. Data: {download}`CSV <data/growth.csv>`.
# :::
#
# Two cores are measured to be {glue:text}`speed-up-2:.2f` times as fast as one (95%: {glue:text}`speed-up-2-low:.2f` to
# {glue:text}`speed-up-2-high:.2f`). So by Amdahl's law {glue:text}`serial-share:.0f`% of the work on one core is serial (95%: {glue:text}`serial-low:.0f`% to {glue:text}`serial-high:.0f`%),
# the start of the workers included. Sixteen cores would then be {glue:text}`speed-up-16:.1f` times as fast ({glue:text}`speed-up-16-low:.1f` to
# {glue:text}`speed-up-16-high:.1f`). That is computed, not measured: cores that share memory or a power budget may do worse.
# Our guess is that some of what counts as serial here is two cores in each other's way. A longer
# experiment has a smaller serial share, as its workers start once.
#
# ## The whole
#
# `make timing` times the book and its tests on a clean clone, on a machine left to itself.

# %% tags=["hide-input"]
captioned(
    study.whole(pd.read_csv("data/timing.csv")),
    "Table B.3. What the whole takes. Waiting: the share of the cores' time in which they had nothing to do.",
    formats={"minutes": "{:.1f}", "processor minutes": "{:.1f}", "waiting": "{:.0%}"},
)
