"""A room to be heated for a day: an environment of one's own, for Gymnasium."""

import gymnasium
import numpy as np
from gymnasium import spaces

DAY, WAKES, SLEEPS = 96, 28, 88  # quarters of an hour: all, 7 o'clock, 22 o'clock
OUTSIDE, COMFORT = 5.0, 20.0  # degrees Celsius
LOSS, HEATING = 0.05, 1.0  # a quarter: share of the difference, degrees
PRICE, DISCOMFORT = 0.1, 0.1  # of a quarter's heating, of a degree off while somebody is up


class Room(gymnasium.Env):
    """Decide every quarter of an hour whether to heat; the day begins at midnight.

    Seen are the temperature, in units of what is comfortable, and the share of the day that is
    over.
    """

    observation_space = spaces.Box(0.0, 2.0, (2,))
    action_space = spaces.Discrete(2)  # off, on

    def reset(self, *, seed=None, options=None):
        """Draw the temperature at midnight."""
        super().reset(seed=seed)
        self.temperature, self.quarter = self.np_random.uniform(14.0, 20.0), 0
        return self._seen(), {}

    def step(self, action):
        """Heat, lose warmth to the outside, and pay for both."""
        self.temperature += LOSS * (OUTSIDE - self.temperature) + HEATING * action
        self.quarter += 1
        degrees = abs(COMFORT - self.temperature) if WAKES <= self.quarter < SLEEPS else 0.0
        reward = -PRICE * action - DISCOMFORT * degrees
        return self._seen(), float(reward), self.quarter == DAY, False, {}

    def _seen(self):
        return np.array([self.temperature / COMFORT, self.quarter / DAY], np.float32)
