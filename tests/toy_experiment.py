"""An experiment of a second or two, as a program: to be killed, or to run twice at once."""

import hashlib
import sys
from pathlib import Path

import pandas as pd
from toy_learner import ToyConfig, learn

from rl_core.dqn import DQNConfig, dqn
from rl_core.experiments import Arm, Results, run
from rl_core.policies import Gaussian
from rl_core.reinforce import ReinforceConfig, reinforce

SEEDS = [4, 0, 11, 7, 2, 30]
ARMS = {
    "toy": [
        Arm(
            f"step {size}",
            learn,
            "CartPole-v1",
            ToyConfig(size, diverging=(7,), seconds=0.004),
            25,
            (0,),
        )
        for size in (0.1, 0.5)
    ],
    "slow": [Arm("slow", learn, "CartPole-v1", ToyConfig(seconds=0.1), 20)],
    "reinforce": [
        Arm(
            f"gamma {gamma}",
            reinforce,
            "Acrobot-v1",
            ReinforceConfig(gamma=gamma, max_episode_steps=1000),
            15,
            (0, 15),
        )
        for gamma in (0.9, 0.99)
    ]
    + [
        Arm(
            "Gaussian",
            reinforce,
            "MountainCarContinuous-v0",
            ReinforceConfig(policy=Gaussian(learn_sigma=True), max_episode_steps=1000),
            15,
            (0, 15),
        )
    ]
    + [
        Arm(
            "DQN",
            dqn,
            "MountainCar-v0",
            DQNConfig(batch_size=32, memory_size=300, learning_starts=200, max_episode_steps=500),
            6,
            (0, 6),
        )
    ],
}


def fingerprint(results: Results) -> str:
    """Return a digest of every bit of the tables and arrays, in order."""
    everything = hashlib.sha256()
    for table in (results.table, results.failures):
        everything.update(pd.util.hash_pandas_object(table).to_numpy().tobytes())
        everything.update(repr(list(table.dtypes.items())).encode())
    for arm in results.provenance.arm.unique():
        for name, array in sorted(results.arrays(arm).items()):
            everything.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
    return everything.hexdigest()


def main(learner: str, store: str, workers: str) -> None:
    """Run the experiment and print its fingerprint."""
    print("begun", flush=True)
    results = run(ARMS[learner], seeds=SEEDS, store=Path(store), workers=int(workers))
    print(fingerprint(results), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
