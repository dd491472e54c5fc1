"""The same room as a compiled task: three functions on vectors."""

from gymnasium import spaces

from examples.room import COMFORT, DAY, DISCOMFORT, HEATING, LOSS, OUTSIDE, PRICE, SLEEPS, WAKES
from rl_core.worlds.tasks import task


@task(
    n_state=2,
    observation_space=spaces.Box(0.0, 2.0, (2,)),
    action_space=spaces.Discrete(2),
    max_episode_steps=None,
)
class FastRoom:
    """See `examples.room.Room`. The state: temperature, and quarters of an hour since midnight."""

    @staticmethod
    def start(rng, state, observation):
        """Draw the temperature at midnight."""
        state[0], state[1] = rng.uniform(14.0, 20.0), 0.0
        observation[0], observation[1] = state[0] / COMFORT, 0.0

    @staticmethod
    def step(state, action):
        """Heat, lose warmth to the outside, and pay for both."""
        state[0] += LOSS * (OUTSIDE - state[0]) + HEATING * action[0]
        state[1] += 1.0
        degrees = abs(COMFORT - state[0]) if WAKES <= state[1] < SLEEPS else 0.0
        return -PRICE * action[0] - DISCOMFORT * degrees, state[1] == DAY

    @staticmethod
    def observe(state, observation):
        """See temperature and time."""
        observation[0], observation[1] = state[0] / COMFORT, state[1] / DAY
