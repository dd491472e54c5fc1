"""DQN of many seeds in JAX: rejax's, vmapped over the seeds, on gymnax's environments.

It runs with a Python of its own (`bench/jax.txt`) and knows nothing of ours. For every line it
reads it trains so many steps, each with an update, and prints its processor and wall time.
"""

import json
import sys
import time

import jax
from flax import linen as nn
from rejax import DQN
from rejax.networks import DiscreteQNetwork, EpsilonGreedyPolicy

told = json.loads(sys.argv[1])


def algorithm(steps: int) -> DQN:
    """Return DQN for so many steps, with the network asked for and nothing evaluated."""
    made = DQN.create(
        env=told["env"],
        total_timesteps=steps,
        eval_freq=steps,
        skip_initial_evaluation=True,
        learning_rate=told["learning_rate"],
        gamma=told["gamma"],
        buffer_size=told["memory_size"],
        batch_size=told["batch_size"],
        fill_buffer=0,
        num_envs=1,
        num_epochs=1,
        ddqn=False,
        polyak=0.0,  # the weights are copied
        target_update_freq=told["copy_every"],
        eps_start=told["epsilon"],
        eps_end=told["epsilon"],
        exploration_fraction=1.0,
    )
    agent = EpsilonGreedyPolicy(DiscreteQNetwork)(
        hidden_layer_sizes=tuple(told["hidden"]), action_dim=made.action_dim, activation=nn.relu
    )
    return made.replace(agent=agent, eval_callback=lambda *_: ())


def trained(steps: int) -> object:
    """Compile the training of all seeds."""
    made = algorithm(steps)
    return jax.jit(jax.vmap(lambda state: made.train(train_state=state)[0]))


train = trained(told["steps"])
keys = jax.random.split(jax.random.PRNGKey(0), told["seeds"])
state = jax.jit(jax.vmap(algorithm(told["starts"]).init_state))(keys)
state = jax.block_until_ready(trained(told["starts"])(state))
state = jax.block_until_ready(train(state))
for _ in sys.stdin:
    wall, processor = time.perf_counter(), time.process_time()
    state = jax.block_until_ready(train(state))
    print(json.dumps([time.process_time() - processor, time.perf_counter() - wall]), flush=True)
