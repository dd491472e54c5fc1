"""Worlds to learn in: how they are named, opened and told apart."""
