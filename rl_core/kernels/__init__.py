"""Compiled arithmetic: what the algorithms do in every step, apart from what they are."""
