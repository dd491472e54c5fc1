"""Layouts as they are read."""

from rl_core.worlds.maze_layout import COURSE_LAYOUT, find, read_layout


def test_the_course_layout_as_read() -> None:
    letters = read_layout(COURSE_LAYOUT)
    assert letters.shape == (4, 5)
    assert find(letters, "S") == [(0, 0)]
    assert find(letters, "F") == [(0, 2), (3, 0), (3, 3)]
    assert find(letters, "W") == [(0, 1), (0, 3), (2, 0), (2, 4), (3, 2), (3, 4)]
