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
# Three things make it cheap. Whole episodes are compiled: environment, network and the drawing of actions, with no Python
# in between. The learners are compiled too: networks this small spend their time not on arithmetic but on being called. And results are
# kept under a digest of all that made them, so nothing is computed twice.

# %% tags=["hide-input"]
from pathlib import Path

import pandas as pd
from myst_nb import glue

from drawings import look
from report.captions import captioned
from studies import performance as study

look.use_style()
FIGURES = Path("../results/figures")
FIGURES.mkdir(parents=True, exist_ok=True)
bench = pd.read_csv("data/bench.csv")
glue("machine", bench["machine"].iloc[0], display=False)
glue("date", bench["date"].iloc[0], display=False)

# %% [markdown]
# ## Beside others
#
# `make bench` measures ours and its rivals in turns, in one run on one machine, and with the same settings. Seconds depend on the
# machine and on who else uses it; their ratio much less. What is drawn here was measured on {glue:text}`date` on:
# {glue:text}`machine`.

# %% tags=["hide-input"] mystnb={"image": {"alt": "Horizontal bars on a logarithmic axis: for each comparison, how many times as long the rival takes as ours."}}
study.bench_figure(bench)

# %% [markdown]
# :::{container} caption
# :name: figure-b-1
# **Figure B.1.** How many times as long the rival takes (logarithmic). Left of the line at 1 ours would be slower.
# Data: {download}`CSV <data/bench.csv>`.
# :::

# %% tags=["hide-input"]
captioned(
    bench.drop(columns=["machine", "date", "note"]),
    "Table B.1. The same in numbers, and the memory.",
    formats=dict.fromkeys(["rival", "ours", "ratio"], "{:.4g}"),
)

# %% tags=["hide-input"]
captioned(bench[["benchmark", "against", "note"]], "Table B.2. How each was measured.")

# %% [markdown]
# ## How the cost grows
#
# This is measured whenever the page is built. REINFORCE trains on MountainCar, every episode stopped at 500 steps, so that
# each seed and each episode is the same work. Value iteration plans random mazes with three flags.

# %%
growth = [study.by_seeds(), study.by_episodes(), study.by_states()]

# %% tags=["hide-input"] mystnb={"image": {"alt": "Three line charts on logarithmic axes: seconds against seeds, episodes and states, each close to the dashed line of proportional growth."}}
for table in growth:
    table.to_csv(FIGURES / f"figure_b_2_{table.columns[0]}.csv", index=False)
    glue(f"growth-{table.columns[0]}", study.growth(table), display=False)
study.growth_figure(growth)

# %% [markdown]
# :::{container} caption
# :name: figure-b-2
# **Figure B.2.** Seconds of 50 episodes of REINFORCE against seeds, of one seed against episodes, and of value iteration
# against states. Dashed: growth in proportion. Data: {download}`seeds <../results/figures/figure_b_2_seeds.csv>`,
# {download}`episodes <../results/figures/figure_b_2_episodes.csv>`, {download}`states <../results/figures/figure_b_2_states.csv>`.
# :::
#
# The time grows with the number of seeds to the power of {glue:text}`growth-seeds:.2f`, with the number of episodes to the power of
# {glue:text}`growth-episodes:.2f`, and with the number of states to the power of {glue:text}`growth-states:.2f`; 1 is proportional. The few
# milliseconds that a run needs to begin show in the smallest ones.
