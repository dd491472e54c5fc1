"""What chapter 7 brings of its own: modules of a few lines, which workers can import."""
