"""Planning against QuantEcon.py, mdpsolver and Storm: random mazes, γ = 0.99, errors below 1e-6.

Each rival runs in a process of its own in which ours takes turns with it; both times of a ratio
come from there. Building the rivals' models is not counted, nor is compiling ours (a smaller maze
goes first); the ordering of the states, part of our planning, is. At 10⁴ states every method of
QuantEcon.py and mdpsolver runs; on mazes of 10⁵ those that took at most twice as long as the
fastest of their library; at 10⁶ the fastest of all at 10⁵. Their answers are held against ours at
a tolerance of 1e-9. Storm stands by itself: it is given the loosest precision with which its error,
known from ours, is at most 1e-6. It takes about eight minutes; `python -m bench.planning` runs it
alone.
"""

import json
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from bench.table import TURNS, comparison, limit, processor_seconds

ROOT = Path(__file__).parent.parent
GAMMA, TOLERANCE = 0.99, 1e-6
WALL_FRACTION, SEED = 0.2, 0
FLAGS = 3
SIDES = {"10⁴": 40, "10⁵": 125, "10⁶": 395}
LARGEST = 1250  # the side of a maze of 10⁷ states
SHAPES = {"10⁵ states, 1 flag": (250, 1), "10⁵ states, 8 flags": (22, 8)}
MEMORY_LIMIT = 200  # bytes a state
SCREENED = 2.0  # seconds for turns beyond the first, where the fastest method is looked for
PATIENCE = {"10⁴": 20, "10⁵": 60}  # processor seconds a method may take, start to end, to stay in
WITHIN = 2.0  # who goes on from 10⁴ to 10⁵ states: relative to the library's fastest

QUANTECON = ("value_iteration", "modified_policy_iteration", "policy_iteration")
UPDATES = ("standard", "standard parallel", "gs", "sor")
METHODS = [("QuantEcon", method) for method in QUANTECON] + [
    ("mdpsolver", f"{algorithm} {update}")
    for algorithm in ("vi", "mpi", "pi")
    for update in UPDATES
]
STORM = ("Storm", "value iteration")
PRECISIONS = (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 1e-6)  # 1e-3 is too loose for all
Method = tuple[str, str]
Times = dict[str, Any]


def rows() -> list[dict]:
    """Measure: times at three sizes and on two other shapes, against Storm, then memory."""
    table = []
    fastest, methods = _screened(SIDES["10⁴"], FLAGS, METHODS, PATIENCE["10⁴"])
    table.append(_row("10⁴", FLAGS, fastest, f"the fastest of {len(methods)} rivals"))
    methods = _within(WITHIN, methods)
    fastest, results = _screened(SIDES["10⁵"], FLAGS, methods, PATIENCE["10⁵"])
    table.append(_row("10⁵", FLAGS, fastest, f"the fastest of {len(results)} rivals"))
    table.append(_row("10⁶", FLAGS, fastest, "the fastest rival at 10⁵"))
    for shape, (side, flags) in SHAPES.items():
        fastest, results = _screened(side, flags, methods, PATIENCE["10⁵"])
        note = f"the fastest of {len(results)} rivals"
        table.append(_row(shape, flags, fastest, note, side))
    table[0]["note"] += f"; ours takes {_compile_seconds():.0f} s to compile, once on a machine"
    table += [_row(size, FLAGS, STORM, "sparse MDP, discounted reward") for size in SIDES]
    return [*table, *_memory_rows()]


def _screened(
    side: int, flags: int, methods: list[Method], patience: float
) -> tuple[Method, dict[Method, float]]:
    """Return the fastest method, and the seconds of each that finishes in time."""
    seconds = {}
    for method in methods:
        try:
            found = _child("times", side, flags, *method, 1, patience=patience)
        except subprocess.CalledProcessError as error:
            if error.returncode != -signal.SIGXCPU:
                raise
            outcome = f"not done after {patience} processor seconds"
        else:
            seconds[method] = median(found["rival"])
            outcome = f"{seconds[method]:.2g} s, ours {median(found['ours']):.2g} s"
        _say(f"{side} x {side}, {flags} flags, {' '.join(method)}: {outcome}")
    return min(seconds, key=lambda method: seconds[method]), seconds


def _within(factor: float, seconds: dict[Method, float]) -> list[Method]:
    """Methods that took at most `factor` times as long as the fastest of their library."""
    best: dict[str, float] = {}
    for (library, _), taken in seconds.items():
        best[library] = min(taken, best.get(library, np.inf))
    return [method for method, taken in seconds.items() if taken <= factor * best[method[0]]]


def _row(shape: str, flags: int, method: Method, note: str, side: int | None = None) -> dict:
    """Let a rival and ours take all their turns on a maze; a size tells its own side."""
    maze = shape if side else f"{shape} states, {flags} flags"
    found = _child("times", side or SIDES[shape], flags, *method, TURNS)
    row = comparison(
        f"value iteration, maze of {maze}",
        " ".join(method),
        found["rival"],
        found["ours"],
        "processor seconds",
        f"{note}{found['setting']}; answers differ by {found['difference']:.0e}",
    )
    _say(f"{maze}, {' '.join(method)}: {row['ratio']} ({row['low']} to {row['high']})")
    return row


def _memory_rows() -> list[dict]:
    table = []
    for size, side in {"10⁶": SIDES["10⁶"], "10⁷": LARGEST}.items():
        used = _child("memory", side, FLAGS)
        note = (
            f"model included, which takes {used['model']:.1f} bytes a state alone; the process "
            f"takes {used['process'] / 1e9:.2f} GB at its peak; solved in {used['seconds']:.3g} "
            "processor seconds"
        )
        name = f"value iteration, maze of {size} states: peak memory"
        table.append(
            limit(name, "the limit set", MEMORY_LIMIT, used["peak"], "bytes a state", note)
        )
        _say(f"{name}: {used['peak']:.0f} bytes a state, {used['seconds']:.1f} s")
    return table


def _say(text: str) -> None:
    print(f"  {text}", file=sys.stderr, flush=True)


def _compile_seconds() -> float:
    """Seconds the first call takes in a copy of the sources, where nothing was compiled before."""
    with tempfile.TemporaryDirectory() as folder:
        for package in ("rl_core", "bench", "book/studies"):
            shutil.copytree(
                ROOT / package, Path(folder, package), ignore=shutil.ignore_patterns("__pycache__")
            )
        return _child("compile", SIDES["10⁴"], FLAGS, folder=Path(folder))["seconds"]


def _child(*arguments: object, patience: int | None = None, folder: Path = ROOT) -> Times:
    """Run `python -m bench.planning` with arguments in a folder and return what it answers."""

    def limited() -> None:
        if patience:
            resource.setrlimit(resource.RLIMIT_CPU, (patience, patience + 5))

    command = [sys.executable, "-m", "bench.planning", *map(str, arguments)]
    answer = subprocess.run(
        command, stdout=subprocess.PIPE, check=True, text=True, cwd=folder, preexec_fn=limited
    )
    return json.loads(answer.stdout.splitlines()[-1])


def times(side: int, flags: int, library: str, method: str, at_least: int) -> Times:
    """Let a rival and ours take turns: so many at least, and more if that is quick."""
    from rl_core.planning import value_iteration

    model = maze_model(side, flags)
    small = maze_model(10, flags)
    value_iteration(small, gamma=GAMMA)
    V_star = value_iteration(model, gamma=GAMMA, tolerance=1e-9, progress=False).V
    make = {"QuantEcon": _quantecon, "mdpsolver": _mdpsolver, "Storm": _Storm}[library]
    make(small, method)()  # QuantEcon compiles too
    solve = make(model, method)
    setting = _loosest(solve, V_star) if library == "Storm" else ""

    def mine() -> object:
        return value_iteration(model, gamma=GAMMA, tolerance=TOLERANCE, progress=False)

    theirs: list[float] = []
    ours: list[float] = []
    while len(ours) < at_least or (len(ours) < TURNS and sum(theirs) + sum(ours) < SCREENED):
        ours.append(processor_seconds(mine))
        seconds, V = solve()
        theirs.append(seconds)
    difference = float(np.abs(V - V_star).max())
    return {"rival": theirs, "ours": ours, "difference": difference, "setting": setting}


def _loosest(solve: Any, V_star: np.ndarray) -> str:
    """Set the rival's precision to the loosest with which it is as near as asked for."""
    for solve.precision in PRECISIONS:
        if np.abs(solve()[1] - V_star).max() <= TOLERANCE:
            break
    return f", precision {solve.precision:g}"


def _quantecon(model: Any, method: str) -> Callable[[], tuple[float, np.ndarray]]:
    """Return a function that solves the model and gives seconds and V."""
    from quantecon.markov import DiscreteDP
    from scipy.sparse import csr_matrix

    S, A, K = model.successor.shape
    pairs = np.arange(S * A)
    P = csr_matrix(
        (model.probability.ravel(), model.successor.ravel(), np.arange(0, S * A * K + 1, K)),
        shape=(S * A, S),
    )
    r = (model.probability * model.reward).sum(axis=2).ravel()
    problem = DiscreteDP(r, P, GAMMA, pairs // A, pairs % A)
    # V is within epsilon / 2 of V*.
    options = {} if method == "policy_iteration" else {"epsilon": 2 * TOLERANCE}

    def solve() -> tuple[float, np.ndarray]:
        before = time.process_time()
        V = getattr(problem, method)(max_iter=1_000_000, **options).v
        return time.process_time() - before, V

    return solve


def _mdpsolver(model: Any, method: str) -> Callable[[], tuple[float, np.ndarray]]:
    """Return a function that solves the model and gives seconds and V."""
    import mdpsolver

    algorithm, update, *parallel = method.split()
    rewards = (model.probability * model.reward).sum(axis=2).tolist()
    probability, successor = model.probability.tolist(), model.successor.tolist()

    def solve() -> tuple[float, np.ndarray]:
        problem = mdpsolver.model()  # a new one: a second solve would start from the first's answer
        problem.mdp(
            discount=GAMMA, rewards=rewards, tranMatProbs=probability, tranMatColumns=successor
        )
        before = time.process_time()
        problem.solve(
            algorithm=algorithm, tolerance=TOLERANCE, update=update, parallel=bool(parallel)
        )
        taken = time.process_time() - before  # its own clock may show less: it has several threads
        return min(taken, problem.getRuntime() / 1000), np.array(problem.getValueVector())

    return solve


class _Storm:
    """Storm's value iteration on its sparse MDP; a call gives seconds and V."""

    precision = PRECISIONS[0]

    def __init__(self, model: Any, method: str) -> None:
        from stormpy import models, parse_properties

        assert method == STORM[1]
        labels = models.StateLabeling(model.n_states)
        labels.add_label("init")
        labels.add_label_to_state("init", 0)
        r = (model.probability * model.reward).sum(axis=2).ravel().tolist()
        reward = models.SparseRewardModel(optional_state_action_reward_vector=r)
        parts = models.SparseModelComponents(
            transition_matrix=_storm_matrix(model),
            state_labeling=labels,
            reward_models={"r": reward},
        )
        self.states, self.mdp = model.n_states, models.SparseMdp(parts)
        self.wanted = parse_properties(f'R{{"r"}}max=? [Cdiscount={GAMMA}]')[0]

    def __call__(self) -> tuple[float, np.ndarray]:
        from stormpy import Rational, environments, model_checking

        environment = environments.Environment()
        solver = environment.solver().min_max()
        solver.method = environments.MinMaxMethod.VALUE_ITERATION
        solver.relative_termination_criterion = False
        solver.precision = Rational(self.precision)
        before = time.process_time()
        found = model_checking(self.mdp, self.wanted, environment=environment)
        seconds = time.process_time() - before
        return seconds, np.array([found.get_value(s) for s in range(self.states)])


def _storm_matrix(model: Any) -> Any:
    """Storm's matrix has a row a state and action; slots with the same successor are one entry."""
    from stormpy.datastructures import SparseMatrixBuilder

    builder = SparseMatrixBuilder(has_custom_row_grouping=True)
    pair = 0
    for first in range(0, model.n_states, 10_000):  # lists of all numbers would take gigabytes
        part = slice(first, first + 10_000)
        lists = model.successor[part].tolist(), model.probability[part].tolist()
        for successors, probabilities in zip(*lists, strict=True):
            builder.new_row_group(pair)
            for columns, numbers in zip(successors, probabilities, strict=True):
                entries: dict[int, float] = {}
                for column, number in zip(columns, numbers, strict=True):
                    entries[column] = entries.get(column, 0.0) + number
                for column in sorted(entries):
                    builder.add_next_value(pair, column, entries[column])
                pair += 1
    return builder.build()


def memory(side: int, flags: int) -> dict[str, float]:
    """Peak resident memory of model and planning above what the process had before, in bytes."""
    from rl_core.planning import value_iteration

    value_iteration(maze_model(10, flags), gamma=GAMMA)
    before = _status("VmRSS")
    model = maze_model(side, flags)
    model = replace(model, reward=model.reward + 0.0)  # zeros never written take no memory
    process = _status("VmHWM")
    Path("/proc/self/clear_refs").write_text("5")  # the peak counts from here

    def solve() -> object:
        return value_iteration(model, gamma=GAMMA, tolerance=TOLERANCE, progress=False)

    seconds, peak, states = processor_seconds(solve), _status("VmHWM"), model.n_states
    return {
        "peak": (peak - before) / states,
        "model": held_bytes(model) / states,
        "process": max(process, peak),
        "seconds": seconds,
    }


def held_bytes(model: Any) -> int:
    """Memory the arrays of a model take; what a broadcast view repeats is counted once."""
    total = 0
    for array in vars(model).values():
        held = [n for n, stride in zip(array.shape, array.strides, strict=True) if stride]
        total += array.itemsize * int(np.prod(held))
    return total


def _status(field: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith(field))


def compile_once(side: int, flags: int) -> dict[str, float]:
    """Seconds the first call takes beyond the second."""
    from rl_core.planning import value_iteration

    model = maze_model(side, flags)
    seconds = []
    for _ in range(2):
        before = time.perf_counter()
        value_iteration(model, gamma=GAMMA, progress=False)
        seconds.append(time.perf_counter() - before)
    return {"seconds": seconds[0] - seconds[1]}


def maze_model(side: int, flags: int) -> Any:
    """Return the model of a random maze, which the book's own modules draw."""
    sys.path.append(str(ROOT / "book"))
    from studies.random_mazes import random_maze

    return random_maze(side, side, flags, WALL_FRACTION, np.random.default_rng(SEED)).model()


if __name__ == "__main__":
    if len(sys.argv) == 1:
        for row in rows():
            print(row)
    else:
        kind, side, flags, *rest = sys.argv[1:]
        measure = {"times": times, "memory": memory, "compile": compile_once}[kind]
        arguments = [*rest[:-1], int(rest[-1])] if rest else []
        print(json.dumps(measure(int(side), int(flags), *arguments)))
