"""The figures that answer, in a headless browser, from a file: they show what Python computes.

Run with the test of the book's pages; it needs a browser but not the book. Started as a program it
writes the page it looks at, `python tests/interactive_browser.py demo.html`, for people to look at.
"""

import sys
from collections.abc import Iterator
from io import StringIO
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pandas as pd
import pytest

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "book")]  # for the program; pytest has them already

from browser import CONTRAST, VIEWS  # noqa: E402
from interactive import (  # noqa: E402
    knob,
    learning_log,
    learning_widget,
    maze_sweeps,
    maze_widget,
    scripts,
    seed_curves,
    snapshots,
)
from matplotlib.figure import Figure  # noqa: E402
from playwright.sync_api import Locator, Page  # noqa: E402

from drawings.look import Film  # noqa: E402
from drawings.maze import situation_figure  # noqa: E402
from rl_core.exploration import EpsilonGreedy  # noqa: E402
from rl_core.maze import ACTIONS, CLOCKWISE, Maze  # noqa: E402
from rl_core.planning import (  # noqa: E402
    optimal_actions,
    policy_iteration,
    value_iteration,
)
from rl_core.q_learning import QLearningConfig, q_learning  # noqa: E402
from studies.by_sweeps import backup  # noqa: E402

PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Demonstration</title>
<meta name="viewport" content="width=device-width"><style>
body {{ font: 16px/1.5 sans-serif; margin: 1rem auto; max-width: 52rem; padding: 0 1rem }}
html[data-theme="dark"] body {{ background: #14181e; color: #e6e6e6 }}
{style}</style>{code}</head><body><script>document.documentElement.dataset.theme =
matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"</script>
<main>{body}</main></body></html>"""

MAZE = Maze()
MODEL = MAZE.model()
GAMMA = 0.9
Q_STAR = value_iteration(MODEL, gamma=GAMMA, tolerance=1e-10, progress=False).Q
CONFIG = QLearningConfig(step_size=0.2, exploration=EpsilonGreedy(0.9))
STEP_SIZES = (0.02, 0.05, 0.1, 0.2, 0.5, 0.9)


def seed_tables() -> tuple[pd.DataFrame, pd.DataFrame]:
    """Curves and fates of greedy learners, some of which settle for too few flags."""
    config = QLearningConfig(exploration=EpsilonGreedy(0.1))
    seeds = range(12)
    table = q_learning(MODEL, config, episodes=600, seeds=seeds, Q_star=Q_STAR).table
    table["steps"] = table.groupby("seed")["steps"].transform(lambda it: it.rolling(30, 1).mean())
    ends = table[table["episode"] == 600].set_index("seed")
    fate = np.where(ends["value_lost"] <= ends["value_lost"].median(), "learned", "not learned")
    fates = ends[["steps", "env_steps"]].rename(columns={"steps": "steps_at_end"}).reset_index()
    fates.insert(1, "fate", fate)
    stopped = fates["seed"] == 11
    fates.loc[stopped, ["fate", "steps_at_end"]] = ["out of budget", np.nan]
    table.loc[(table["seed"] == 11) & (table["episode"] > 350), "steps"] = np.nan
    table["stopped"] = (table["seed"] == 2) & (table["episode"] == 1)
    return table[["seed", "episode", "steps", "stopped"]], fates


def knob_tables() -> tuple[dict[float, pd.DataFrame], pd.DataFrame, np.ndarray]:
    """The error over the episodes for some step sizes, what it came to, and for each seed."""
    curves, rows, ends = {}, [], []
    for value in STEP_SIZES:
        config = QLearningConfig(step_size=value, exploration=EpsilonGreedy(0.9))
        table = q_learning(MODEL, config, episodes=600, seeds=range(4), Q_star=Q_STAR).table
        errors = table.pivot(index="episode", columns="seed", values="rmse_visitable")
        spread = {"median": errors.median(axis=1), "low": errors.min(axis=1)}
        curves[value] = pd.DataFrame({**spread, "high": errors.max(axis=1)}).reset_index()
        lost = table.loc[table["episode"] == 600, "value_lost"]
        end = errors.iloc[-1].median()
        ends.append(errors.iloc[-1])
        rows.append({"error at the end": end, "share that learned": (lost < 0.2).mean()})
    return curves, pd.DataFrame(rows), np.array(ends)


X, Y = np.linspace(-1.2, 0.6, 25), np.linspace(-0.07, 0.07, 21)
GRIDS = {
    f"episode {k}": np.tanh(k / 40 * (Y[:, None] * 14 + 0.3 * np.sin(3 * X))) for k in (0, 40, 200)
}


class Demonstration:
    """Every kind of figure once, on what little can be computed while one waits."""

    def __init__(self) -> None:
        self.sweeps = maze_sweeps(MAZE, GAMMA)
        self.log = learning_log(MAZE, CONFIG, Q_STAR)
        self.curves, self.fates = seed_tables()
        self.by_value, self.measures, self.ends = knob_tables()
        still = situation_figure(MAZE, Q_STAR, "")
        blank = Figure(figsize=(6, 3))
        film = Film(np.zeros((4, 64, 96, 3), np.uint8), frames_per_second=2, description="A film.")
        original = pd.DataFrame({"episode": [0, 300, 600], "low": [30, 8, 8], "high": [90, 20, 15]})
        films = {"seed 3": (3, film), "of no seed": film}
        self.widgets = {
            "One sweep at a time": maze_widget(MAZE, self.sweeps, still=still),
            "One step at a time": learning_widget(MAZE, self.log, Q_STAR, still=still),
            "Every seed": seed_curves(
                *(self.curves, self.fates, original),
                still=blank,
                films=films,
                y_label="steps",
                title="Greedy",
            ),
            "One knob": knob(
                *("step size α", STEP_SIZES, self.by_value, self.measures),
                **{"still": blank, "y_label": "RMSE, visitable entries"},
                seeds={"error at the end": self.ends},
            ),
            "Over time": snapshots(
                *(GRIDS,),
                **{"x": X, "y": Y, "still": blank, "x_label": "position", "y_label": "velocity"},
                **{"value_label": "mean action", "mark": -np.pi / 6},
            ),
        }

    def page(self) -> str:
        """The page, with scripts and styles in it."""
        static = ROOT / "book" / "_static"
        return PAGE.format(
            style=(static / "play.css").read_text(),
            code="".join(f"<script>{(static / name).read_text()}</script>" for name in scripts()),
            body="".join(f"<h2>{it}</h2>{w._repr_html_()}" for it, w in self.widgets.items()),
        )


@pytest.fixture(scope="session")
def demo() -> Demonstration:
    """The page and what it was made of."""
    return Demonstration()


@pytest.fixture(scope="session")
def address(demo, tmp_path_factory) -> str:
    """The page as a file."""
    file = tmp_path_factory.mktemp("demo") / "demo.html"
    file.write_text(demo.page())
    return file.as_uri()


@pytest.fixture(scope="module", params=VIEWS)
def view(request, browser, address) -> Iterator[Page]:
    """The page in a window of a certain width, light or dark."""
    with browser.new_context(**VIEWS[request.param]) as context:
        page = context.new_page()
        page.goto(address)
        yield page


@pytest.fixture
def page(browser, address) -> Iterator[Page]:
    """The page, newly opened in a wide, light window; nothing may go wrong on it."""
    problems = []
    with browser.new_context(**VIEWS["desk light"]) as context:
        page = context.new_page()
        page.on("console", lambda message: problems.append(message.text))
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", lambda request: problems.append(request.url[:80]))
        page.goto(address)
        yield page
    inline = ("file:", "data:", "blob:")
    assert [it for it in problems if not it.startswith(inline)] == []


def figure(page: Page, kind: str) -> Locator:
    return page.locator(f'[data-play="{kind}"]')


def cell(host: Locator, row: int, column: int) -> Locator:
    return host.locator(f'.cell[aria-label^="row {row}, column {column},"]')


def slide(host: Locator, value: int, nth: int = 0) -> None:
    slider = host.locator("input[type=range]:visible").nth(nth)
    slider.evaluate("(it, x) => { it.value = x; it.dispatchEvent(new Event('input')); }", value)


def said(host: Locator) -> str:
    return " ".join(host.locator("[aria-live]").all_inner_texts())


def plain(text: str) -> str:
    return text.replace("−", "-").replace(",", "")


def test_values_of_every_cell_are_those_of_the_sweep(page, demo):
    host = figure(page, "sweeps")
    Q, done = np.zeros((112, 4)), 0
    for k in (0, 1, 7, 28):
        slide(host, k)
        for _ in range(k - done):
            Q = backup(MODEL, Q.max(axis=1), gamma=GAMMA)
        done = k
        for flags in ("", "A", "AB"):
            for letter in "ABC":
                button = host.get_by_role("button", name=f"flag {letter}", exact=True)
                if (button.get_attribute("aria-pressed") == "true") != (letter in flags):
                    button.click()
            number = MAZE.flag_sets.index(flags) + 1
            assert f"Situation {number}" in host.locator(".play-row strong").inner_text()
            labels = host.locator(".cell").evaluate_all("all => all.map(it => it.ariaLabel)")
            places = sorted(MAZE.cells.tolist())
            for (row, column), label in zip(places, labels, strict=True):
                state = MAZE.state(row, column, flags)
                assert label.startswith(f"row {row}, column {column}, ")
                if MODEL.terminal[state]:
                    assert "goal" in label
                    continue
                assert f"value {Q[state].max():.3f}," in label
                best = [ACTIONS[a] for a in np.flatnonzero(optimal_actions(Q)[state])]
                assert ("any action" if len(best) == 4 else " or ".join(best)) in label
                assert ("cannot be reached" in label) == (not MAZE.reachable_states()[state])


def backup_shown(host: Locator) -> tuple[list[str], list[float]]:
    """The sums of the four actions, each as one text, and the results."""
    rows = host.locator(".play-backup tbody tr")
    sums = [" ".join(row.locator(".sum").all_inner_texts()) for row in rows.all()]
    return sums, [float(it.strip("= ")) for it in rows.locator(".result").all_inner_texts()]


@pytest.mark.parametrize("k", [1, 7, 12])
def test_a_backup_shows_its_numbers(page, demo, k):
    host = figure(page, "sweeps")
    slide(host, k)
    V = demo.sweeps.V[k - 1]
    Q = backup(MODEL, V, gamma=GAMMA)
    host.get_by_role("button", name="flag A", exact=True).click()
    for row, column in ((1, 0), (1, 3), (2, 2), (1, 4)):
        cell(host, row, column).focus()
        page.keyboard.press("Enter")
        state = MAZE.state(row, column, "A")
        sums, results = backup_shown(host)
        for a in range(4):
            (s0, s1), (r0, r1) = MODEL.successor[state, a], MODEL.reward[state, a]
            assert sums[a] == (
                f"0.9 × [{r0:.0f} + 0.9 × {V[s0]:.4f}] + 0.1 × [{r1:.0f} + 0.9 × {V[s1]:.4f}]"
            )
        assert results == [float(f"{q:.4f}") for q in Q[state]]
        bold = host.locator(".play-backup tr.best th").all_inner_texts()
        assert [it.split()[-1] for it in bold] == [
            ACTIONS[a] for a in np.flatnonzero(optimal_actions(Q)[state])
        ]
        assert f"V = max Q = {Q[state].max():.4f}" in said(host)
        slips = host.locator(".play-backup small").all_inner_texts()
        assert slips[1].startswith(f"slips {ACTIONS[CLOCKWISE[0]]}")


def test_what_a_sweep_changed(page, demo):
    host = figure(page, "sweeps")
    acting = ~MODEL.terminal
    for k in (1, 5, 20):
        slide(host, k)
        before, V = demo.sweeps.V[k - 1 : k + 1][:, acting]
        digits = [[f"{x:.3f}" for x in values] for values in (before, V)]
        moved = sum(one != other for one, other in zip(*digits, strict=True))
        turned = (demo.sweeps.best[k] != demo.sweeps.best[k - 1]).any(axis=1)[acting].sum()
        text = said(host)
        assert f"changed {moved} of {acting.sum()} values" in text
        assert f"up to {np.abs(V - before).max():.4f}, and {turned} arrows" in text


def test_policy_iteration_ends_at_the_optimal_policy(page, demo):
    host = figure(page, "sweeps")
    host.get_by_role("button", name="policy iteration").click()
    plan = policy_iteration(MODEL, gamma=GAMMA)
    assert int(host.locator("input:visible").get_attribute("max")) == len(plan.table)
    for row in plan.table.itertuples():
        host.get_by_role("button", name="round: one on").click()
        assert f"and {row.policy_changes} arrows" in said(host)
    state = MAZE.state(*MAZE.start)
    name = host.locator(".cell").first.get_attribute("aria-label")
    assert f"value {plan.V[state]:.3f}, {ACTIONS[plan.policy[state]]}" in name
    assert "it stays" in said(host)
    slide(host, 2)
    V = demo.sweeps.round_V[2]
    _, results = backup_shown(host)
    assert results == [float(f"{q:.4f}") for q in backup(MODEL, V, gamma=GAMMA)[state]]


def test_the_arrow_keys_walk_over_walls(page):
    cells = figure(page, "sweeps").locator(".cell")
    assert cells.evaluate_all("all => all.filter(it => it.tabIndex === 0).length") == 1
    cells.first.focus()
    page.keyboard.press("ArrowRight")  # over a wall, onto flag A
    assert page.evaluate("document.activeElement.ariaLabel").startswith("row 0, column 2")
    page.keyboard.press("ArrowUp")
    assert page.evaluate("document.activeElement.ariaLabel").startswith("row 0, column 2")


def test_the_numbers_of_an_update(page, demo):
    host, log = figure(page, "learning"), demo.log
    slide(host, 30)
    steps = int(log.lengths[:30].sum())
    for more in (1, 1, 10):
        host.get_by_role(
            "button", name="10 steps ▶" if more == 10 else "step ▶", exact=True
        ).click()
        steps += more
        before, after = log.replay(MAZE, steps - 1), log.replay(MAZE, steps)
        ((s, a),) = np.argwhere(before != after).tolist() or [(None, None)]
        update = [plain(it) for it in host.locator(".play-update > *").all_inner_texts()]
        assert f"Q(s {ACTIONS[a]})" in update[0]
        assert update[1].startswith(f"= {before[s, a]:.4f} + 0.2 × [")
        assert update[1].endswith(f"- {before[s, a]:.4f}]")
        assert update[2] == f"= {after[s, a]:.4f}"
        row = plain(host.locator(".play-backup tbody tr").nth(a).inner_text()).split()
        assert row[2:] == [f"{x:.4f}" for x in (after[s, a], Q_STAR[s, a], (after - Q_STAR)[s, a])]
    host.get_by_role("button", name="◀ step").click()
    one, other = log.replay(MAZE, steps - 1), log.replay(MAZE, steps - 2)
    assert host.locator(".play-update strong").inner_text() == f"= {one[one != other][0]:.4f}"


def test_the_error_and_the_states_that_cannot_be_reached(page, demo):
    host, log = figure(page, "learning"), demo.log
    slider = host.locator("input")
    assert int(slider.get_attribute("max")) == len(log.lengths) + len(log.snapshots)
    unreachable = ~MAZE.reachable_states()
    for i, Q in (
        (17, log.replay(MAZE, int(log.lengths[:17].sum()))),
        (len(log.lengths), log.replay(MAZE)),
        (len(log.lengths) + len(log.snapshots), log.snapshots[5000]),
    ):
        slide(host, i)
        error = Q - Q_STAR
        parts = [np.linalg.norm(error[it]) for it in (unreachable, ~unreachable)]
        text = host.locator(".play-said", has_text="‖Q").inner_text().replace("−", "-")
        assert f"‖Q - Q*‖ = {np.linalg.norm(error):.4f} = " in text
        assert f"√({parts[0]:.4f}² + {parts[1]:.4f}²)" in text
        state = MAZE.state(1, 4, "ABC")
        host.locator(".mini").last.click()
        cell(host, 1, 4).click()
        values = plain(host.locator(".play-backup tbody").inner_text()).split()
        assert values[2::5] == [f"{q:.4f}" for q in Q[state]]
    assert host.locator(".mini path").count() == unreachable.sum() == 12
    assert host.get_by_role("button", name="step ▶", exact=True).is_disabled()


def test_to_the_next_reward(page, demo):
    host = figure(page, "learning")
    button = host.get_by_role("button", name="next reward")
    for _ in range(3):
        button.click()
        assert "[r − Q]" in host.locator(".play-update").inner_text()
        assert "the goal" in said(host)
    assert host.get_by_role("button", name="end of episode").is_enabled()


def test_every_seed_can_be_reached_by_key_and_tells_its_fate(page, demo):
    host = figure(page, "seeds")
    fates = demo.fates.assign(lost=demo.fates["fate"] != "learned")
    fates = fates.sort_values(["lost", "steps_at_end", "seed"])
    wide = demo.curves.pivot(index="episode", columns="seed", values="steps")
    host.locator(".seed").first.focus()
    for number, row in enumerate(fates.itertuples()):
        if number:
            page.keyboard.press("ArrowRight")
        text = plain(said(host))
        assert text.startswith(f"Seed {row.seed}: {row.fate}.")
        assert f"{row.env_steps} environment steps" in text
        if np.isfinite(row.steps_at_end):
            assert f"{float(f'{row.steps_at_end:.3g}'):g} steps at the end" in text
        link = host.locator("a[download]").get_attribute("href")
        rows = pd.read_csv(StringIO(unquote(link.partition(",")[2])))
        expected = wide.loc[rows["episode"], row.seed].to_numpy()
        assert list(rows.columns) == ["seed", "episode", "steps"]
        assert (rows["seed"] == row.seed).all()
        np.testing.assert_allclose(rows["steps"], expected, rtol=5e-4)
        film = host.get_by_role("button", name="film:")
        assert film.is_visible() == (row.seed == 3)


def test_failed_seeds_alone(page, demo):
    host = figure(page, "seeds")
    failed = (demo.fates["fate"] != "learned").sum()
    assert 0 < failed < len(demo.fates)
    assert host.locator(".seed:visible").count() == len(demo.fates)
    host.get_by_role("button", name=f"failed seeds only ({failed})").click()
    assert host.locator(".seed:visible").count() == failed
    assert host.locator(".seed-line").count() == failed
    assert "learned." not in said(host).replace("not learned.", "")


def test_a_line_that_is_pointed_at_is_picked(page, demo):
    host = figure(page, "seeds")
    host.locator(".play-chart").scroll_into_view_if_needed()
    spot = host.locator(".seed-line").first.evaluate(
        "it => { const p = it.getPointAtLength(0);"
        " const box = it.ownerSVGElement.getBoundingClientRect();"
        " return [box.left + p.x, box.top + p.y]; }"
    )
    host.locator(".seed").last.click()
    page.mouse.move(*spot)
    seed = int(host.locator('.seed[aria-pressed="true"]').inner_text().removesuffix("✕"))
    starts = demo.curves[demo.curves["episode"] == 1].set_index("seed")["steps"]
    best = int(host.locator(".seed").first.inner_text())
    assert starts[seed] == starts[best]


def test_the_median_its_band_and_what_was_stopped_are_drawn(page, demo):
    host = figure(page, "seeds")
    for name in ("path.median", "path.band"):
        assert host.locator(name).get_attribute("d").count("L") > 100
    assert host.locator(".cut").count() == 2  # an episode that was cut off, and a seed's end
    assert host.locator(".title").inner_text() == "Greedy"
    host.get_by_role("button", name="failed seeds only").click()
    assert host.locator("path.median").count() == 0


def test_a_film_opens_with_its_seed(page):
    host = figure(page, "seeds")
    host.get_by_role("button", name="seed 3,").click()
    host.get_by_role("button", name="film: seed 3").click()
    assert page.locator(".play-film[open] summary").all_inner_texts() == ["Film: seed 3"]


def test_a_knob_moves_its_measures(page, demo):
    host = figure(page, "knob")
    host.locator("input").focus()
    page.keyboard.press("Home")
    for i, value in enumerate(STEP_SIZES):
        if i:
            page.keyboard.press("ArrowRight")
        assert host.locator("output").inner_text() == f"step size α = {value:g}"
        shown = [float(it) for it in host.locator(".play-measures strong").all_inner_texts()]
        assert shown == [float(f"{x:.4g}") for x in demo.measures.iloc[i]]
    assert host.locator(".one-seed").count() == demo.ends.size


def test_a_snapshot_can_be_read_off(page):
    host = figure(page, "snapshots")
    host.locator("input").focus()
    page.keyboard.press("End")
    host.locator(".play-chart").focus()
    for key in ("ArrowUp", "ArrowUp", "ArrowLeft"):
        page.keyboard.press(key)
    i, j = len(Y) // 2 + 2, len(X) // 2 - 1
    text = said(host).replace("−", "-")
    value = np.float32(GRIDS["episode 200"][i, j])
    assert text.startswith(f"episode 200: mean action {value:.3f} at position {X[j]:.3g}")
    assert f"velocity {Y[i]:.3g}" in text
    positive = GRIDS["episode 200"] > 0
    sides = sum(int((np.diff(positive, axis=axis) != 0).sum()) for axis in (0, 1))
    assert host.locator(".border").get_attribute("d").count("M") == sides > 0
    assert host.locator("line.mark").count() == 1


def test_without_scripts_and_in_print_the_picture_stands_there(browser, address, page, demo):
    with browser.new_context(java_script_enabled=False) as context:
        quiet = context.new_page()
        quiet.goto(address)
        assert quiet.locator(".play-still img:visible").count() == len(demo.widgets)
        assert quiet.locator(".play-live").count() == 0
    assert page.locator(".play-live:visible").count() == len(demo.widgets)
    assert page.locator(".play-still:visible").count() == 0
    page.emulate_media(media="print")
    assert page.locator(".play-live:visible").count() == 0
    assert page.locator(".play-still img:visible").count() == len(demo.widgets)


def test_the_figures_fit_the_window_and_can_be_read(view):
    wide, window = view.evaluate(
        "() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    assert wide <= window
    outside = view.evaluate(
        """() => [...document.querySelectorAll('.play')].flatMap(host => {
          const edge = host.getBoundingClientRect().right + 1;
          return [...host.querySelectorAll('.play-live :not(.play-hidden)')].filter(
            it => it.getBoundingClientRect().right > edge).map(it => it.outerHTML.slice(0, 80));
        })"""
    )
    assert outside == []
    pale = view.evaluate(
        f"async () => {{ const article = document.querySelector('main'); {CONTRAST} }}"
    )
    assert pale == []


def test_fingers_find_the_buttons(view):
    """At least 24 pixels on either side (WCAG 2.2, 2.5.8)."""
    sizes = view.locator(".play button:visible").evaluate_all(
        "all => all.map(it => it.getBoundingClientRect()).map(it => Math.min(it.width, it.height))"
    )
    assert min(sizes) >= 24


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(Demonstration().page())
