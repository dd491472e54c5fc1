"""A sentence that the data do not bear out stops a chapter, but not a preview."""

import premises
import pytest


def test_a_sentence_that_does_not_hold_stops_the_chapter(monkeypatch):
    monkeypatch.setattr(premises, "PREVIEW", False)
    premises.premise(True, "So it is.")
    with pytest.raises(AssertionError, match=r"do not bear out .*: So it is not\.$"):
        premises.premise(False, "So it is not.")


def test_a_preview_checks_nothing(monkeypatch):
    monkeypatch.setattr(premises, "PREVIEW", True)
    premises.premise(False, "So it is not.")
