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
# # Take it from here
#
# *Not in the report: the same tools on a problem of one's own.*
#
# **Question.** The chapters so far use the report's worlds, networks and claims. What does it take to bring one's own? Here is one small
# example of each: an environment, a network, a compiled task, an algorithm, an experiment, and a claim with its verdict. Each is a file of a few lines that
# you can copy and change. They stand in `book/examples`, because what workers run has to be found by import.

# %% tags=["hide-input"]
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from dask.distributed import Client
from myst_nb import glue

from drawings import look
from drawings import own as drawings
from examples.room import Room
from examples.room_task import FastRoom
from report import figure_data
from report.captions import captioned
from report.claims import details
from report.listings import listing
from report.seeds import SEEDS
from rl_core.dqn import DQNConfig, dqn
from rl_core.evaluation import evaluate, load, rollout
from rl_core.experiments import Arm, run
from rl_core.policies import MLP
from studies import own as study

look.use_style()
RESULTS = Path("../results")

# %% [markdown]
# ## One's own environment
#
# A room is heated for a day. Every quarter of an hour the agent decides whether to heat. Heating costs, and so does every degree off the comfortable
# temperature, but only while somebody is up. A thermostat heats whenever it is too cold, all night long. Can an agent do better?
#
# An environment is a class with two spaces and two functions, as Gymnasium wants it:

# %%
listing("examples.room")

# %% [markdown]
# An arm of an experiment is an algorithm, an environment and its settings. The experiments of this page are run here, or read where they were run before:

# %%
results, small = study.learn(RESULTS / "store")
perceptron = small.arm("perceptron, Gymnasium's room")
agent = perceptron.agent(seed=int(SEEDS[0]))
action, _ = agent.predict(Room().reset(seed=0)[0], deterministic=True)

# %% [markdown]
# `agent` is what one takes home. `predict` has the arguments of Stable-Baselines3's policies, so that what is written for those takes it too. It is saved
# with its configuration in one file, which holds no code.

# %%
with tempfile.TemporaryDirectory() as folder:
    agent.save(Path(folder) / "room.npz")
    again = load(Path(folder) / "room.npz")
assert again.predict(Room().reset(seed=0)[0], deterministic=True)[0] == action

# %% tags=["hide-input"] mystnb={"image": {"alt": "Temperature of a room over a day, with a thermostat and with the agent. Shaded: the hours in which somebody is up. Below, marks show when each of them heats."}}
trained = results.arm(study.FAR).agent(seed=int(SEEDS[0]))
by_name = {
    "thermostat": study.day(study.thermostat, seed=1),
    "DQN": study.day(lambda seen: int(trained.predict(seen, deterministic=True)[0]), seed=1),
}
figure_data.offer("figure_s7_1", pd.concat(by_name, names=["agent"]).reset_index("agent"))
drawings.days(by_name)

# %% [markdown]
# :::{container} caption
# :name: figure-s7-1
# **Figure S7.1.** The same day with a thermostat and with an agent that has learned. Shaded: somebody is up. Data: {download}`CSV <../results/figures/figure_s7_1.csv>`.
# :::
#
# ## One's own network
#
# The hour before midnight is near the hour after it, but the share of the day that is over jumps from one to zero. A network can be told that a day is a circle.
# Any `torch.nn.Module` will do. `Module("examples.networks:clock")` names the function that makes it, and its source is part of what
# identifies a result: an edited network is another one.

# %%
listing("examples.networks")

# %% tags=["hide-input"] mystnb={"image": {"alt": "Return of a day against days of learning, a line a seed, for the perceptron and for the network with the clock; a dotted line for the thermostat."}}
rule = float(np.mean([study.day(study.thermostat, seed)["reward"].sum() for seed in range(20)]))
networks = {"perceptron, Gymnasium's room": "perceptron", "clock": "clock"}
figure_data.offer("figure_s7_2", small.table[small.table["arm"].isin(networks)])
drawings.learning(small.table, networks, rule)

# %% [markdown]
# :::{container} caption
# :name: figure-s7-2
# **Figure S7.2.** While learning: two seeds of each network. That is too few to say which is better. Data: {download}`CSV <../results/figures/figure_s7_2.csv>`.
# :::
#
# ## One's own compiled task
#
# The same room as three functions on vectors runs compiled. A test holds it to the class above, step by step.

# %%
listing("examples.room_task")

# %% tags=["hide-input"] mystnb={"image": {"alt": "Two bars on a logarithmic axis: steps a second in Gymnasium's usual loop and on the compiled task, which is the longer by far."}}
speeds = study.speed()
ratio = float(speeds["steps a second"].iloc[1] / speeds["steps a second"].iloc[0])
glue("ratio", ratio, display=False)
figure_data.offer("figure_s7_3", speeds)
drawings.bars(speeds)

# %% [markdown]
# :::{container} caption
# :name: figure-s7-3
# **Figure S7.3.** Steps a second with random actions, measured one after the other when this page was built. Data: {download}`CSV <../results/figures/figure_s7_3.csv>`.
# :::
#
# The compiled task takes {glue:text}`ratio:.0f` times as many steps in a second. This is the world alone: what a learner takes comes on top.
#
# ## One's own algorithm
#
# An algorithm is one file: a frozen configuration, a function that trains a seed, and a check. The actor-critic of Sutton and Barto's section 13.5 learns a policy and a
# value at every step ({download}`the whole file <examples/actor_critic.py>`). These lines are its heart:

# %%
listing("examples.actor_critic:_train", first="while steps < max_steps", last="steps, total =")

# %% tags=["hide-input"] mystnb={"image": {"alt": "Return of a day against days of learning, a line a seed, for the actor-critic; a dotted line for the thermostat."}}
figure_data.offer("figure_s7_4", small.table[small.table["arm"] == "actor-critic"])
drawings.learning(small.table, {"actor-critic": "actor-critic"}, rule)

# %% [markdown]
# :::{container} caption
# :name: figure-s7-4
# **Figure S7.4.** The actor-critic on the same room, two seeds. Data: {download}`CSV <../results/figures/figure_s7_4.csv>`.
# :::
#
# ## One's own experiment
#
# Two arms: one looks hours ahead, the other lives for the moment. Each is run with {glue:text}`n-seeds` seeds, on all cores. What is done is kept in the store under a digest of all that
# made it: run it again and it is read, change a line of the room and it is made anew.

# %%
listing("studies.own:arms")

# %% [markdown]
# With Dask the same arms run on other machines. A client is all it takes, and the bits are the same:

# %%
with tempfile.TemporaryDirectory() as store, Client(processes=False, dashboard_address=None):
    arm = Arm("room", dqn, FastRoom, DQNConfig(network=MLP((8,)), learning_starts=100), 3)
    far_away = run([arm], seeds=SEEDS[:2], store=store, backend="dask", progress=False)
direct = dqn(FastRoom, arm.config, episodes=arm.episodes, seeds=SEEDS[:2])
pd.testing.assert_frame_equal(far_away.table.drop(columns="arm"), direct.table)

# %% tags=["hide-input"] mystnb={"image": {"alt": "Median return of a day over the seeds against days of learning, with bands, for the two discounts; a dotted line for the thermostat."}}
glue("n-seeds", len(SEEDS), display=False)
figure_data.offer("figure_s7_5", results.table)
drawings.medians(results.table, [study.FAR, study.NEAR], rule)

# %% [markdown]
# :::{container} caption
# :name: figure-s7-5
# **Figure S7.5.** While learning, with random actions. Line: median over seeds; band: its 95% interval. Data: {download}`CSV <../results/figures/figure_s7_5.csv>`.
# :::
#
# ## The verdict on one's own claim
#
# A claim gets its criteria before its data is seen. Here it is: who looks ahead heats a room better than a thermostat, and than who does not.

# %%
far, near = study.earned(results, study.FAR), study.earned(results, study.NEAR)
finding = study.judge(far, near, rule)
captioned(details([finding]), "Table 7.1. The claim's criteria with their evidence.")

# %% tags=["hide-input"] mystnb={"image": {"alt": "What every seed earns a day, a dot each, for the two discounts, with the median; a dotted line for the thermostat."}}
glue("verdict", finding.verdict, display=False)
by_arm = {"looks ahead": far, "for the moment": near}
figure_data.offer("figure_s7_6", pd.DataFrame(by_arm).assign(seed=SEEDS))
drawings.ends(by_arm, rule)

# %% [markdown]
# :::{container} caption
# :name: figure-s7-6
# **Figure S7.6.** Every seed's greedy policy on days it has not seen. Diamonds: medians. Data: {download}`CSV <../results/figures/figure_s7_6.csv>`.
# :::
#
# The verdict, computed: *{glue:text}`verdict`*.
#
# ## Taking results elsewhere
#
# A table of results is a pandas data frame. As CSV it is a line; what rliable asks for is a matrix for each algorithm, a row a seed and a column a task:

# %%
last = results.table.groupby(["arm", "seed"]).tail(20).groupby(["arm", "seed"], as_index=False)
scores = last["return"].mean().assign(task="room")
by_task = scores.pivot(index=["arm", "seed"], columns="task", values="return")
matrices = {arm: rows.to_numpy() for arm, rows in by_task.groupby("arm")}
with tempfile.TemporaryDirectory() as folder:
    results.table.to_csv(Path(folder) / "room.csv", index=False)

# %% [markdown]
# Neither library is needed here, so what follows is not run on this page; a test runs it. With rliable (1.2.0 does not work beside pandas 3: take the matrices to an
# environment with `arch==7.2.0` and `pandas==2.3.3`):
#
# ```python
# import numpy as np
# from rliable import library
#
# estimates, intervals = library.get_interval_estimates(
#     matrices, lambda matrix: np.array([np.median(matrix)]), reps=1_000
# )
# ```
#
# Minari's data sets are made of episodes, and an episode is a rollout:

# %%
played = rollout(FastRoom, trained, np.random.default_rng(0), max_steps=200)
ends = np.zeros(len(played.rewards), bool)
ends[-1] = True

# %% [markdown]
# ```python
# import minari
# from minari.data_collector import EpisodeBuffer
#
# episode = EpisodeBuffer(
#     observations=played.observations, actions=played.actions[:, 0].astype(int),
#     rewards=played.rewards, terminations=ends & played.terminated,
#     truncations=ends & (not played.terminated),
# )
# minari.create_dataset_from_buffers("room/learned-v0", buffer=[episode], env=Room())
# ```
#
# **What to take along.** Bring a class, a network, a file. What was measured on the report's worlds then goes for yours: seeds, intervals, a criterion before
# the data, and a verdict that nobody chooses.
#
# ## Exercises
#
# **1.** Electricity is cheaper at night in some places. Make a room in which heating costs half while everybody sleeps, as a class that changes `step` only. Does the
# thermostat gain or lose?


# %% tags=["hide-cell"]
class NightRoom(Room):
    def step(self, action):
        asleep = not 28 <= self.quarter < 88
        seen, reward, over, cut, info = super().step(action)
        return seen, reward + 0.05 * action * asleep, over, cut, info


def paid(room, act):
    seen, _ = room.reset(seed=0)
    total, over = 0.0, False
    while not over:
        seen, reward, over, _, _ = room.step(act(seen))
        total += reward
    return total


{room.__name__: round(paid(room(), study.thermostat), 2) for room in (Room, NightRoom)}

# %% [markdown]
# **2.** How much does the agent's noise cost? Evaluate one seed's policy as it was at the end of training, with its random actions, and greedily.

# %% tags=["hide-cell"]
from rl_core.evaluation import greedy

{
    name: evaluate(FastRoom, one, seed=0, episodes=50, max_steps=200)["return"].mean().round(2)
    for name, one in (("with noise", trained), ("greedy", greedy(trained)))
}

# %% [markdown]
# **3.** A rule of your own: heat by day below the comfortable temperature, and in the night only in its last two hours. Is it better than the thermostat?


# %% tags=["hide-cell"]
def rule_of_my_own(seen):
    awake_soon = 20 / 96 <= seen[1] < 88 / 96
    return int(awake_soon and seen[0] < 1.0)


round(study.day(rule_of_my_own, seed=1)["reward"].sum() - by_name["thermostat"]["reward"].sum(), 2)
