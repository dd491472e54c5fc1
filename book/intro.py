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
# # Reinforcement learning, thirty seeds at a time
#
# In 2018 a student report in a robotics course (University of Pennsylvania, ESE 650) took four small worlds, a
# grid maze, Acrobot, MountainCar and MountainCarContinuous, and solved them with the classical
# methods of reinforcement learning. Each curve in it is one run. Some of its remarks are
# observations, some are guesses. This book does the same experiments again, in the open: every figure and table is
# made by the code printed beside it, every curve stands on {glue:text}`seeds` seeds with intervals, the curves of 2018
# are drawn behind ours, and runs that fail are counted, not dropped.
#
# ## What held up

# %% tags=["remove-input"]
from pathlib import Path

import pandas as pd
from IPython.display import HTML, display
from myst_nb import glue

from drawings import look
from drawings import maze as maze_drawings
from report import findings, front_page, provenance
from report.captions import captioned
from report.seeds import SEEDS
from rl_core.maze import Maze
from rl_core.planning import value_iteration

look.use_style()
RESULTS = Path("../results")
ORIGINAL = Path("data/original")
claims = front_page.claims(RESULTS, pd.read_csv("data/claims.csv", dtype=str))
for verdict, count in front_page.counts(claims).items():
    glue(verdict.replace(" ", "-"), count, display=False)
glue("claims", len(claims), display=False)
glue("seeds", len(SEEDS), display=False)
HTML(front_page.findings_list(findings.told(RESULTS, ORIGINAL, claims)))

# %% tags=["remove-input"]
HTML(front_page.verdict_bar(claims))

# %% [markdown]
# The report makes {glue:text}`claims` statements that can be checked. Each got a criterion in code. Where one was not
# fixed before its data was looked at, or its evidence was corrected afterwards, it stands in the [table of amendments](a1_reproduce.ipynb). {glue:text}`holds` hold, {glue:text}`holds-in-part` hold in part,
# {glue:text}`does-not-hold` do not hold, {glue:text}`depends-on-the-reading` depend on how the report is read, and of {glue:text}`cannot-tell` our runs cannot tell. What failed stands
# first. Claims differ in kind: some are theorems, some are numbers that one lucky run produced.

# %% tags=["remove-input"]
HTML(front_page.claims_table(claims))

# %% [markdown]
# The table as {download}`claims.csv <../results/claims.csv>`. A claim holds if all its criteria are met by the whole of their 95%
# intervals, and holds in part if only some are. If none is met and at least one is missed by its whole interval, it does not hold. Otherwise every
# interval reaches to both sides of a bound: what we measured fits a yes and a no, and the seeds are too few to tell. Where the report's words can fairly be read in two ways and the verdicts
# differ, it depends on the reading. Shown is the quantity that decides: of the first criterion that failed, or else of the one that is
# nearest to its bound. "About so many steps" means within a quarter; where a narrower or a wider window makes another verdict, the row says which.
#
# ## The report's figures, then and now

# %% tags=["remove-input"]
maze = Maze()
situation = maze_drawings.situation_figure(
    maze, value_iteration(maze.model(), gamma=0.9).Q, maze.flag_sets[0]
)
display(HTML(front_page.thumbnails(RESULTS, ORIGINAL, situation)))

# %% [markdown]
# :::{container} caption
# Left the published curve, right our seeds (grey) and their median (blue). Where some seeds did not come to the last episode, the title says
# how many did, and the median is theirs. A picture leads to its figure. Vertical scales are logarithmic, except for the Maze, whose first eight figures have no data of 2018. Data of Figures
# {download}`1 to 8 <../results/maze_q_values.csv>`, {download}`9 <../results/figures/figure_9.csv>`,
# {download}`10 <../results/figures/figure_10.csv>`, {download}`11 <../results/figures/figure_11.csv>`,
# {download}`12 <../results/figures/figure_12.csv>`, {download}`13 <../results/figures/figure_13.csv>`,
# {download}`14 <../results/figures/figure_14.csv>`.
# :::
#
# ## What it took

# %% tags=["remove-input"]
made = provenance.read(RESULTS)
processors = " and ".join(sorted(made["processor"].unique()))
captioned(
    provenance.by_chapter(made),
    f"Table 0.1. Experiments of the chapters and the time their training took on one core ({processors}). "
    "A run is one seed of one arm. Not counted: planning, evaluation, statistics and drawing.",
    formats={"one core (min)": "{:.1f}"},
)

# %% [markdown]
# Chapter 1 needs no training; the runs of chapters 2 to 6 share the cores there are. [How to reproduce it](a1_reproduce.ipynb) says what
# was run, with which versions, and what differs from 2018. [Performance](a2_performance.ipynb) has the speed beside other libraries, and how the cost grows.
#
# ## How to read it
#
# A chapter asks a question, explains the method, shows the evidence and gives a verdict. Nothing is
# assumed but some probability and a little programming. Symbols are those of Sutton and Barto,
# *Reinforcement Learning: An Introduction* (second edition, 2018). Cells can be unfolded to see the code. Figures that the
# report has keep its numbers; ours in addition are called S1.1, S1.2 and so on.
#
# ```{tableofcontents}
# ```
