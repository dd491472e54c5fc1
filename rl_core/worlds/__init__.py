"""The worlds that agents live in."""
