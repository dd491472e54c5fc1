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
# # How to reproduce it
#
# ```
# git clone <this repository>
# make book            # sets up .venv, runs everything, builds the site
# make test            # style, types, tests, every notebook at full scale, the built site in a browser
# make book SEEDS=3    # a first look in a few minutes, marked as a preview
# make bench           # speed beside other libraries
# make pdf             # the book as one file
# ```
#
# Python 3.11, 3.12 or 3.13, make and git are all it needs; a browser (Chromium) is used for the last step of `make test` and for `make pdf`. Setting up
# and `make bench` install packages from the network; nothing else needs one.
#
# ## Randomness
#
# A run is a pure function of environment, configuration, number of episodes and seed. From one `numpy.random.SeedSequence(seed)` independent
# streams are spawned. REINFORCE and DQN have four: for the environment, for the actions, for the network (initial weights, order of the samples) and for
# the replay memory. Q-learning has six: start states, transitions and decisions, each for learning and for evaluation. An evaluation of chapter 6
# has two more, for starts and for actions, which no training has touched. The SARSA of chapter 2, which is not in the package, has one generator a seed; each bootstrap has a
# fixed seed of its own. No global random state is read or changed. The same seed gives the same bits alone or among others, on one worker or
# several, in one go or after having been killed; tests hold this to the bit. This copy of the book stands on the seeds 0 to {glue:text}`last-seed`. Whatever had to be chosen, such as
# caps and budgets, was chosen on seeds from 1000 on. What was changed with data known is judged on seeds from 100 on, which nobody had seen.
#
# ## Versions

# %% tags=["hide-input"]
from pathlib import Path

import pandas as pd
from myst_nb import glue

from report import provenance
from report.amendments import AMENDMENTS, told
from report.captions import captioned
from report.chance import chance
from report.seeds import SEEDS, premise
from studies import calibration

glue("seeds", len(SEEDS), display=False)
glue("last-seed", SEEDS[-1], display=False)
RESULTS = Path("../results")
made = provenance.read(RESULTS)
captioned(
    provenance.versions(made), "Table A.1. What the results were made with, as stored beside them."
)

# %% [markdown]
# All packages, with exact versions, are in `environment.txt`. Another version of any of the libraries in the table means another digest: results are
# then made again, not read. The version of Python counts too.
#
# Do the answers hang on it? The preview was made with Python 3.11, 3.12 and 3.13, and the three tables of claims compared. They are
# the same to the last digit, but for claim t, which is about time. So versions are kept apart for certainty, not because they are known to differ. Another kind of
# processor was not tried. Our guess is that last digits may differ there, since compiled code may sum in another order, and with them what chance decides.
#
# ## Where every result comes from
#
# Results are kept in `results/store`, each under a digest (SHA-256) of all that decides it: configuration, seed, episodes, the source code of the modules involved and
# the versions of the libraries. Beside each one lies a record of the same, with the processor and the time it took.

# %% tags=["hide-input"]
provenance.by_arm(made).to_csv(RESULTS / "provenance.csv", index=False)
captioned(
    provenance.by_arm(made).drop(columns=["config", "algorithm", "environment"]),
    "Table A.2. The arms of all chapters. Seconds of one core, all seeds together; the beginning of the digest of the first seed.",
    formats={"seconds": "{:.1f}"},
)

# %% [markdown]
# With algorithms, environments and configurations: {download}`provenance.csv <../results/provenance.csv>`.
#
# ## What was changed afterwards
#
# Criteria are fixed before their data are seen. Where one was changed later, or its evidence corrected, it stands here.

# %% tags=["hide-input"]
captioned(
    pd.DataFrame(told(AMENDMENTS)),
    "Table A.3. Every amendment of claims, criteria and evidence, in the order in which they were "
    "made.",
)

# %% [markdown]
# ## Many criteria
#
# Each criterion is held against a 95% interval. Such an interval misses what it is about once in twenty times, by chance alone. The more criteria,
# the more of these misses.

# %% tags=["hide-input"]
criteria = pd.read_csv(RESULTS / "criteria.csv")
counted = chance(criteria)
glue("criteria", counted.criteria, display=False)
glue("random", counted.random, display=False)
glue("by-chance", counted.by_chance, display=False)
glue("failed", counted.failed, display=False)
glue("near", len(counted.near), display=False)
captioned(
    counted.near,
    "Table A.4. Criteria whose interval ends within a tenth of its width of their bound: "
    "a few other seeds could have moved them.",
)

# %% [markdown]
# The claims have {glue:text}`criteria` criteria in all their readings ({download}`all of them, with evidence and answer <../results/criteria.csv>`), and {glue:text}`random` of these
# rest on seeds. If each interval missed once in twenty times, {glue:text}`by-chance:.1f` of them would miss. A miss makes a wrong answer only if a bound lies between the
# interval and the truth. So at most about as many criteria may have failed by chance, of the {glue:text}`failed` that did fail, and nothing says which. No interval is widened for that.
# Those nearest to their bound are the first to doubt: {glue:text}`near` are in Table A.4.
#
# ## Do the intervals hold what they promise?
#
# Once in twenty times an interval may miss. Does it? Here seeds are drawn from a law whose truth is known, intervals are made as in the chapters, {glue:text}`repeats` of each kind, and those that hold the
# truth are counted.

# %% tags=["hide-input"]
held = calibration.coverage()
held.to_csv(RESULTS / "calibration.csv", index=False)
glue("repeats", calibration.REPEATS, display=False)
by_kind = held.groupby(held["interval"].str.split().str[0])["held (%)"]
for kind, (fewest, most) in by_kind.agg(["min", "max"]).T.items():
    glue(f"{kind}-least", float(fewest), display=False)
    glue(f"{kind}-most", float(most), display=False)
premise("medians are about right", by_kind.min()["median"] > 90)
premise(
    "near certainty, with few seeds, an interval is too short", by_kind.min()["probability"] < 90
)
captioned(
    held,
    "Table A.5. How many of the 95% intervals hold the truth. Steps are lognormal, a seed that fails "
    "needs for ever; shares are computed without chance.",
    formats={"held (%)": "{:.1f}"},
)

# %% [markdown]
# Medians hold it in {glue:text}`median-least:.0f` to {glue:text}`median-most:.0f`% of the cases, shares in {glue:text}`share-least:.0f` to {glue:text}`share-most:.0f`%. The probability that one arm needs fewer steps is
# another matter: with few seeds and a truth near 1 the interval is much too short and holds it in {glue:text}`probability-least:.0f`% only. The bootstrap draws from the seeds it has, and where nearly all pairs go one
# way it cannot draw the others. Such an interval is far from the bound of one half, so that no verdict hangs on its end. (The data: {download}`CSV <../results/calibration.csv>`.)
#
# ## Near a bound
#
# Where a bound lies within half an interval's width of the interval's end, a few seeds decide. The rule for this was fixed before the seeds concerned were run:
# such a criterion is judged on further seeds instead, from 100 on, once and on these alone, as far as it does not cost too much. The first seeds then no longer count. So each criterion
# is decided by one 95% interval, and two looks at the data do not make two chances to be wrong. (A criterion that the first seeds settled was further from its bound. Of those that are true, hardly one in
# ten thousand is refuted so clearly.) Claims 2g, 3a, 3i, 3k and 3n have such criteria. Where it would cost too much, the chapter says so, with the seeds it would take.
#
# ## How much is "about"?
#
# The report says "about so many steps" of five results. Here that means within a quarter. Another width can make another verdict.

# %% tags=["hide-input"]
about = pd.read_csv(RESULTS / "about.csv")
verdicts = about.groupby("claim")["verdict"].nunique()
glue("about", len(verdicts), display=False)
glue("moved", ", ".join(verdicts.index[verdicts > 1]) or "none", display=False)
captioned(
    about,
    "Table A.6. Claims of about so many steps: half the width of the window, as a share of the "
    "steps; the share of all seeds inside; the verdict.",
    formats={"window": "{:.0%}", "low": "{:.0f}", "high": "{:.0f}", "share": "{:.0%}"},
)

# %% [markdown]
# Of the {glue:text}`about` claims, those whose verdict hangs on the width are: {glue:text}`moved`. The front page marks them.
#
# ## What differs from 2018, and why
#
# | 2018 | here | why |
# |---|---|---|
# | one run a curve | {glue:text}`seeds` seeds, intervals, failures counted | one run shows what can happen, not what does |
# | OpenAI gym of 2018 | Gymnasium; for Acrobot, MountainCar and MountainCarContinuous compiled twins | the twins are tested against Gymnasium step by step, to the bit |
# | TensorFlow 1.5 | networks and optimisers compiled with numba, tested against PyTorch | speed; Adam and RMSProp keep TensorFlow's constants and the place of their epsilon |
# | no time limits; capped episodes thrown away or left out of the curves | no time limits; capped episodes stay in the tables, and are learned from or not as stated | a curve without its failures says too much |
# | no budget | a budget of environment steps a seed, stated in each chapter, exhausted ones counted | a hopeless run would not end |
# | ε is the probability of exploiting | in code the standard ε, in the text *exploitation probability* | one word for one thing |
# | "RMSE" is a Frobenius norm; "iterations" are episodes | called what they are | |
# | "softmax" divided exp(Q) by the sum of Q | a softmax; the faulty formula as an arm of its own in chapter 2 | the report's remarks are about something else |
# | transitions without a terminal flag in the DQN | both, as arms of chapter 4 | it decides what can be learned |
# | batch 512 (report) or 32 (program) in the DQN | 512 for the report's figures | the text is what is reproduced |
# | "3 features" of MountainCarContinuous | two readings, as arms of chapter 5 | the environment has two observations |
# | curves not smoothed | seeds drawn as medians over a window, as stated in each caption | thirty unsmoothed curves cannot be read |
