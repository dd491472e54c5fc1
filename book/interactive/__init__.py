"""Figures that answer: data as a snippet of HTML that the scripts of the book bring to life.

Each function returns a `Widget`, which a notebook shows when it is the last line of a cell. In it
stand the data as JSON and a still picture; `_static/play/*.js` draws the rest from the data. The
picture is what print, JupyterLab and browsers without scripts show. A page needs the files of
`scripts` (`_static/play/core.js` first) and `_static/play.css`, as Sphinx's `html_js_files` and
`html_css_files`. The caption is the page's own, below the cell, as for any other figure.

    from interactive import maze_sweeps, maze_widget
    maze_widget(maze, maze_sweeps(maze, gamma=0.9), still=maze_figures.situation_figure(...))

    from interactive import learning_log, learning_widget
    log = learning_log(maze, QLearningConfig(exploration=EpsilonGreedy(0.9)), Q_star)
    learning_widget(maze, log, Q_star, still=drawings.figure_9(...))

    from interactive import seed_curves
    films = {"best, seed 4": (4, film), "failed, seed 7": (7, other_film)}
    seed_curves(curves, fates, original, still=drawings.learning_curve(...), films=films)

    from interactive import knob
    knob("sigma", [0.3, 0.5, 1.0], {0.3: curve, 0.5: curve, 1.0: curve}, table, still=figure)

    from interactive import snapshots
    snapshots({"before": grid, "episode 100": grid}, x=positions, y=velocities, still=figure,
              x_label="position", y_label="velocity", value_label="mean action")
"""

from interactive.curves import knob, seed_curves
from interactive.grids import snapshots
from interactive.learning import LearningLog, learning_log, learning_widget
from interactive.maze import Sweeps, maze_sweeps, maze_widget
from interactive.page import Widget, scripts

__all__ = [
    "LearningLog",
    "Sweeps",
    "Widget",
    "knob",
    "learning_log",
    "learning_widget",
    "maze_sweeps",
    "maze_widget",
    "scripts",
    "seed_curves",
    "snapshots",
]
