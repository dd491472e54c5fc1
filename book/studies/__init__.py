"""The studies of the book, one file a chapter: arms, criteria and measures."""
