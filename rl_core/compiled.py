"""Moved to `rl_core.kernels.compiled`."""

from rl_core.kernels.compiled import compiled as compiled
