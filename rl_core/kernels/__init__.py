"""Arithmetic that is compiled. It knows nothing of algorithms, worlds and experiments."""
