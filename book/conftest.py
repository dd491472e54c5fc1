"""What pytest passes over here when it looks for examples: the notebooks, which are run as such."""

collect_ignore_glob = ["[0-9]*.py", "a[0-9]*.py", "intro.py"]
