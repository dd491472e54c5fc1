"""Reinforcement learning algorithms that fit on a page, and the course's Maze.

Importing the package registers the Maze with Gymnasium as `rl_core/Maze-v0`.
"""

from gymnasium import register

register(id="rl_core/Maze-v0", entry_point="rl_core.maze:Maze")
