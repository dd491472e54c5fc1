"""Planning against QuantEcon.py and mdpsolver: random mazes, γ = 0.99, errors of at most 1e-6.

Each rival runs in a process of its own in which ours takes turns with it; both times of a ratio
come from there. Building the rivals' models is not counted, nor is compiling ours (a smaller maze
goes first); the ordering of the states, part of our planning, is. At 10⁴ states every method of
both libraries runs; at 10⁵ those that took at most twice as long as the fastest of their library;
at 10⁶, and on other shapes of 10⁵, the fastest of each library. The answers are held against ours
at a tolerance of 1e-9. It takes about five minutes; `python -m bench.planning` runs it alone.
"""

import json
import shutil
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

from bench.table import comparison

ROOT = Path(__file__).parent.parent
GAMMA, TOLERANCE = 0.99, 1e-6
WALL_FRACTION, SEED = 0.2, 0
FLAGS = 3
SIDES = {"10⁴": 40, "10⁵": 125, "10⁶": 395}
SHAPES = {"10⁵ states, 1 flag": (250, 1), "10⁵ states, 8 flags": (22, 8)}
MEMORY_LIMIT = 200  # bytes a state
ROUNDS, SECONDS_OF_ROUNDS = 7, 2.0
PATIENCE = {"10⁴": 15, "10⁵": 60, "10⁶": 300}  # seconds a rival may take, start to end
WITHIN = {"10⁴": 2.0, "10⁵": 1.0}  # who goes on to the next size: relative to the library's fastest

QUANTECON = ("value_iteration", "modified_policy_iteration", "policy_iteration")
UPDATES = ("standard", "standard parallel", "gs", "sor")
METHODS = [("QuantEcon", method) for method in QUANTECON] + [
    ("mdpsolver", f"{algorithm} {update}")
    for algorithm in ("vi", "mpi", "pi")
    for update in UPDATES
]
Method = tuple[str, str]


def rows() -> list[dict]:
    """Measure: times at three sizes and on two other shapes, then memory."""
    table, methods = [], METHODS
    for size, side in SIDES.items():
        results = compare(side, FLAGS, methods, PATIENCE[size])
        table.append(_row(f"{size} states, {FLAGS} flags", results))
        if size in WITHIN:
            methods = _within(WITHIN[size], results)
    for shape, (side, flags) in SHAPES.items():
        table.append(_row(shape, compare(side, flags, methods, PATIENCE["10⁵"])))
    table[0]["note"] += f"; ours takes {_compile_seconds():.0f} s to compile, once on a machine"
    return [*table, _memory_row()]


def compare(
    side: int, flags: int, methods: list[Method], patience: float
) -> dict[Method, dict[str, float]]:
    """Give the seconds of each method and of ours beside it, for those that finish in time."""
    results = {}
    for method in methods:
        try:
            results[method] = _child("times", side, flags, *method, timeout=patience)
        except subprocess.TimeoutExpired:
            outcome = f"not done after {patience} s"
        else:
            outcome = ", ".join(f"{name} {value:.2g}" for name, value in results[method].items())
        print(f"  {side} x {side}, {flags} flags, {' '.join(method)}: {outcome}", file=sys.stderr)
    return results


def _within(factor: float, results: dict[Method, dict[str, float]]) -> list[Method]:
    """Methods that took at most `factor` times as long as the fastest of their library."""
    best: dict[str, float] = {}
    for (library, _), seconds in results.items():
        best[library] = min(seconds["rival"], best.get(library, np.inf))
    return [m for m, seconds in results.items() if seconds["rival"] <= factor * best[m[0]]]


def _row(shape: str, results: dict[Method, dict[str, float]]) -> dict:
    fastest = min(results, key=lambda method: results[method]["rival"])
    seconds = results[fastest]
    difference = max(result["difference"] for result in results.values())
    return comparison(
        f"value iteration, maze of {shape}",
        " ".join(fastest),
        seconds["rival"],
        seconds["ours"],
        "seconds",
        f"the fastest of {len(results)} rivals; answers differ by {difference:.0e}",
    )


def _memory_row() -> dict:
    used = _child("memory", SIDES["10⁶"], FLAGS)
    return comparison(
        "value iteration, maze of 10⁶ states: peak memory, model included",
        "the limit set",
        MEMORY_LIMIT,
        used["peak"],
        "bytes a state",
        f"the model alone takes {used['model']:.1f} bytes a state",
    )


def _compile_seconds() -> float:
    """Seconds the first call takes in a copy of the sources, where nothing was compiled before."""
    with tempfile.TemporaryDirectory() as folder:
        for package in ("rl_core", "bench", "book/studies"):
            shutil.copytree(
                ROOT / package, Path(folder, package), ignore=shutil.ignore_patterns("__pycache__")
            )
        return _child("compile", SIDES["10⁴"], FLAGS, folder=Path(folder))["seconds"]


def _child(
    *arguments: object, timeout: float | None = None, folder: Path = ROOT
) -> dict[str, float]:
    """Run `python -m bench.planning` with arguments in a folder and return what it answers."""
    command = [sys.executable, "-m", "bench.planning", *map(str, arguments)]
    answer = subprocess.run(
        command, stdout=subprocess.PIPE, check=True, text=True, timeout=timeout, cwd=folder
    )
    return json.loads(answer.stdout.splitlines()[-1])


def times(side: int, flags: int, library: str, method: str) -> dict[str, float]:
    """Let a rival and ours take turns; medians in seconds."""
    from rl_core.planning import value_iteration

    model = _maze(side, flags)
    small = _maze(10, flags)
    value_iteration(small, gamma=GAMMA)
    make = {"QuantEcon": _quantecon, "mdpsolver": _mdpsolver}[library]
    make(small, method)()  # QuantEcon compiles too
    solve = make(model, method)
    theirs, ours = [], []
    while len(ours) < ROUNDS and sum(theirs) + sum(ours) < SECONDS_OF_ROUNDS:
        before = time.perf_counter()
        value_iteration(model, gamma=GAMMA, tolerance=TOLERANCE, progress=False)
        ours.append(time.perf_counter() - before)
        seconds, V = solve()
        theirs.append(seconds)
    V_star = value_iteration(model, gamma=GAMMA, tolerance=1e-9, progress=False).V
    difference = float(np.abs(V - V_star).max())
    return {"rival": median(theirs), "ours": median(ours), "difference": difference}


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
        before = time.perf_counter()
        V = getattr(problem, method)(max_iter=1_000_000, **options).v
        return time.perf_counter() - before, V

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
        before = time.perf_counter()
        problem.solve(
            algorithm=algorithm, tolerance=TOLERANCE, update=update, parallel=bool(parallel)
        )
        wall = time.perf_counter() - before
        return min(wall, problem.getRuntime() / 1000), np.array(problem.getValueVector())

    return solve


def memory(side: int, flags: int) -> dict[str, float]:
    """Peak resident memory of model and planning above what the process had before, in bytes."""
    from rl_core.planning import value_iteration

    value_iteration(_maze(10, flags), gamma=GAMMA)
    before = _status("VmRSS")
    model = _maze(side, flags)
    model = replace(model, reward=model.reward + 0.0)  # zeros never written take no memory
    Path("/proc/self/clear_refs").write_text("5")  # the peak counts from here
    value_iteration(model, gamma=GAMMA, tolerance=TOLERANCE, progress=False)
    peak = _status("VmHWM") - before
    return {"peak": peak / model.n_states, "model": held_bytes(model) / model.n_states}


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

    model = _maze(side, flags)
    seconds = []
    for _ in range(2):
        before = time.perf_counter()
        value_iteration(model, gamma=GAMMA, progress=False)
        seconds.append(time.perf_counter() - before)
    return {"seconds": seconds[0] - seconds[1]}


def _maze(side: int, flags: int) -> Any:
    sys.path.append(str(ROOT / "book"))
    from studies.random_mazes import random_maze

    return random_maze(side, side, flags, WALL_FRACTION, np.random.default_rng(SEED)).model()


if __name__ == "__main__":
    if len(sys.argv) == 1:
        for row in rows():
            print(row)
    else:
        kind, side, flags, *method = sys.argv[1:]
        measure = {"times": times, "memory": memory, "compile": compile_once}[kind]
        print(json.dumps(measure(int(side), int(flags), *method)))
