"""What the report is made of beside its chapters: claims, captions, front page, data, seeds."""
