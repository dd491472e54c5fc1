"""What the algorithms act in, and how it is read, opened and played."""
