"""The drawings of the book, one file a chapter, and what they share."""
