"""The claims of the report: criteria fixed beforehand, evidence, verdicts, one table of them all.

A claim is one statement of the report. Its criteria say, before any data is seen, between which
bounds a measured quantity has to lie. The verdict follows from the interval of that quantity alone:
no one decides it after looking. Where the report's words can fairly be read in several ways, each
reading has its criteria, and a verdict that they do not share depends on the reading.
"""

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from report.names import file_name
from rl_core import checks
from rl_core.checks import fields, floats, integer, require

Answer = Literal["yes", "no", "open"]
Verdict = Literal[
    "holds", "holds in part", "does not hold", "cannot tell", "depends on the reading"
]
COLUMNS = (
    *("id", "section", "claim", "criterion", "estimate", "low", "high"),
    *("seeds", "verdict", "figure"),
    *("deciding_criterion", "deciding_estimate", "deciding_low", "deciding_high"),
    *("deciding_seeds", "deciding_bound", "distance", "readings", "amended", "about", "chapter"),
)
WINDOWS = (0.15, 0.25, 0.35)  # of what a report says is "about" so much
POWER = 2.04
"""((1.96 + 0.84) / 1.96)^2: times as many seeds for a chance of 80% to tell as for one of 50%."""


def _real(name: str, value: object) -> float:
    """A number, infinities included."""
    if isinstance(value, Real) and math.isinf(value):
        return float(value)
    return checks.number(name, value)


@dataclass(frozen=True)
class Evidence:
    """A measured quantity with its 95% interval over seeds.

    Attributes
    ----------
    estimate, low, high : float
        The quantity and its interval; a quantity that does not depend on chance has no width.
    seeds : int
        How many seeds stand behind it; 0 where nothing is random.

    Raises
    ------
    TypeError, ValueError
        If one is no number or NaN, the interval does not hold its estimate, or seeds are negative.
    """

    estimate: float
    low: float
    high: float
    seeds: int

    def __post_init__(self) -> None:
        fields(self, estimate=(_real,), low=(_real,), high=(_real,), seeds=(integer,))
        inside = self.low <= self.estimate <= self.high
        require(inside, "estimate", self.estimate, f"from low to high, {self.low} to {self.high}")

    @classmethod
    def none(cls) -> "Evidence":
        """Evidence of no seed at all, such as of those that learned where none did: all is open.

        Examples
        --------
        >>> Criterion("at most 100 steps", at_most=100).answer(Evidence.none())
        'open'
        """
        return cls(math.inf, -math.inf, math.inf, seeds=0)

    @classmethod
    def exact(cls, value: float) -> "Evidence":
        """Evidence in which nothing is random."""
        return cls(value, value, value, seeds=0)

    def __str__(self) -> str:
        interval = f" [{number(self.low)}, {number(self.high)}]" if self.low < self.high else ""
        return f"{number(self.estimate)}{interval}"


@dataclass(frozen=True)
class Criterion:
    """Between which bounds a quantity has to lie.

    Attributes
    ----------
    text : str
        The criterion in words, with the quantity, its unit and the bound.
    at_least, at_most : float
        The bounds, both included.
    above : float
        A lower bound that is not included.

    Raises
    ------
    TypeError, ValueError
        If there is no finite bound, nothing between the bounds, or a bound is NaN; or if the text
        has a "; ", which stands between criteria in the table of claims.
    """

    text: str
    at_least: float = -math.inf
    at_most: float = math.inf
    above: float = -math.inf

    def __post_init__(self) -> None:
        fields(self, at_least=(_real,), at_most=(_real,), above=(_real,))
        require("; " not in self.text, "text", self.text, "without '; ', which ends a criterion")
        require(self.bounds, "at_least, at_most or above", None, "a finite number")
        possible = self.at_least <= self.at_most and self.above < self.at_most
        require(possible, "at_most", self.at_most, "no less than at_least, and more than above")

    @property
    def bounds(self) -> tuple[float, ...]:
        """The bounds that there are."""
        return tuple(filter(math.isfinite, (self.at_least, self.above, self.at_most)))

    def answer(self, evidence: Evidence) -> Answer:
        """Say "yes" if the whole interval is within the bounds, "no" if all of it is outside.

        An interval that ends at the bound of "above" leaves that open, from either side, unless it
        is nothing but the bound.

        Examples
        --------
        >>> criterion = Criterion("at most 100 steps", at_most=100)
        >>> criterion.answer(Evidence(90, 80, 99, seeds=30))
        'yes'
        >>> criterion.answer(Evidence(90, 80, 110, seeds=30))
        'open'
        >>> Criterion("more likely than not", above=0.5).answer(Evidence(0.48, 0.45, 0.5, seeds=30))
        'open'
        """
        low, high = evidence.low, evidence.high
        if self.at_least <= low and high <= self.at_most and self._above(low):
            return "yes"
        not_above = high < self.above or low == high == self.above
        if high < self.at_least or self.at_most < low or not_above:
            return "no"
        return "open"

    def _above(self, value: float) -> bool:
        return self.above < value or self.above == -math.inf

    def margin(self, value: float) -> tuple[float, float]:
        """Return how far a value keeps its nearest bound, negative if it does not, and that bound.

        Examples
        --------
        >>> Criterion("75 to 125 steps", 75, 125).margin(140)
        (-15.0, 125.0)
        """
        sides = [(value - bound, bound) for bound in (self.at_least, self.above)]
        sides.append((self.at_most - value, self.at_most))
        return min(side for side in sides if math.isfinite(side[1]))

    def tightness(self, evidence: Evidence) -> float:
        """Distance of the estimate from its nearest bound in halves of the interval's width."""
        distance, half = abs(self.margin(evidence.estimate)[0]), _half(evidence)
        if half == 0:
            return math.inf if distance else 0.0
        return 0.0 if math.isinf(half) else distance / half


def _half(evidence: Evidence) -> float:
    return 0.0 if evidence.low == evidence.high else (evidence.high - evidence.low) / 2


@dataclass(frozen=True)
class Reading:
    """Another fair reading of a claim's words: its name, and the criteria that test it."""

    name: str
    criteria: tuple[Criterion, ...]


@dataclass(frozen=True)
class Claim:
    """A statement of the report and what would bear it out.

    Attributes
    ----------
    id : str
        Its name in the list of claims, such as "1a".
    section : str
        Where the report says it.
    claim : str
        What it says.
    criteria : tuple of Criterion
        What has to be true, all of it; the first is the one whose estimate stands in the table.
    figure : str
        The figure or table to look at.
    reading : str
        How the criteria read the words, where there is another way.
    readings : tuple of Reading
        The other ways.
    amended : str
        What was changed with data known, and on which seeds it is judged since.

    Raises
    ------
    ValueError
        If there is no criterion, or there are other readings than one without a name.
    """

    id: str
    section: str
    claim: str
    criteria: tuple[Criterion, ...]
    figure: str
    reading: str = ""
    readings: tuple[Reading, ...] = ()
    amended: str = ""

    def __post_init__(self) -> None:
        require(self.criteria, "criteria", self.criteria, "one criterion or more")
        named = not self.readings or self.reading
        require(named, "reading", self.reading, "a name, since there are other readings")

    def judge(self, *evidence: Evidence, readings: Sequence[Sequence[Evidence]] = ()) -> "Finding":
        """Hold the evidence, one piece a criterion, against the criteria.

        All answers yes: the claim holds. Some yes, others not: it holds in part. None yes, but some
        no: it does not hold, because all of it would have to be true. Otherwise, all being open,
        the data cannot tell. If another reading comes to something else, it depends on the reading.

        Parameters
        ----------
        *evidence : Evidence
            For the criteria, in their order.
        readings : sequence of sequences of Evidence
            The same for each of the other readings.

        Raises
        ------
        ValueError
            If there is not exactly one piece of evidence for each criterion.

        Examples
        --------
        >>> claim = Claim("0", "0", "Steps are few.", (Criterion("<= 9", at_most=9),), "Figure 0")
        >>> claim.judge(Evidence.exact(7)).verdict
        'holds'
        """
        wanted = f"{len(self.criteria)} pieces, one for each criterion of claim {self.id}"
        require(len(evidence) == len(self.criteria), "evidence", evidence, wanted)
        wanted = f"{len(self.readings)} sequences, one for each other reading of claim {self.id}"
        require(len(readings) == len(self.readings), "readings", readings, wanted)
        answers = tuple(c.answer(e) for c, e in zip(self.criteria, evidence, strict=True))
        others = tuple(
            replace(self, criteria=one.criteria, reading=one.name, readings=()).judge(*pieces)
            for one, pieces in zip(self.readings, readings, strict=True)
        )
        return Finding(self, evidence, answers, others)


@dataclass(frozen=True)
class Finding:
    """A claim with its evidence, an answer a criterion; and the findings of other readings."""

    claim: Claim
    evidence: tuple[Evidence, ...]
    answers: tuple[Answer, ...]
    others: tuple["Finding", ...] = ()

    @property
    def verdict(self) -> Verdict:
        """What the answers come to."""
        own: Verdict = "does not hold" if "no" in self.answers else "cannot tell"
        if "yes" in self.answers:
            own = "holds" if set(self.answers) == {"yes"} else "holds in part"
        agreed = all(other.verdict == own for other in self.others)
        return own if agreed else "depends on the reading"

    @property
    def deciding(self) -> int:
        """The place of the criterion that made the verdict.

        That is the first that failed. If none did, it is the tightest of those that are open; if
        none is, the tightest of all: nearest to its bound in halves of its interval's width.
        """
        if "no" in self.answers:
            return self.answers.index("no")
        last = "open" if "open" in self.answers else "yes"
        places = [place for place, answer in enumerate(self.answers) if answer == last]
        return min(places, key=lambda i: self.claim.criteria[i].tightness(self.evidence[i]))

    def row(self) -> dict[str, object]:
        """Give the finding as a row of the table of claims."""
        first, place = self.evidence[0], self.deciding
        criterion, evidence = self.claim.criteria[place], self.evidence[place]
        distance, bound = criterion.margin(evidence.estimate)
        every = (self, *self.others) if self.others else ()
        return {
            "id": self.claim.id,
            "section": self.claim.section,
            "claim": self.claim.claim,
            "criterion": "; ".join(criterion.text for criterion in self.claim.criteria),
            "estimate": first.estimate,
            "low": first.low,
            "high": first.high,
            "seeds": first.seeds,
            "verdict": self.verdict,
            "figure": self.claim.figure,
            "deciding_criterion": criterion.text,
            "deciding_estimate": evidence.estimate,
            "deciding_low": evidence.low,
            "deciding_high": evidence.high,
            "deciding_seeds": evidence.seeds,
            "deciding_bound": bound,
            "distance": distance,
            "readings": "; ".join(one._as_read() for one in every),
            "amended": self.claim.amended,
            "about": "",
        }

    def _as_read(self) -> str:
        own = replace(self, others=()).verdict
        return f"{self.claim.reading}: {own}, {self.evidence[self.deciding]}"


def number(value: float) -> str:
    """A measured number as text: three digits, and whole from a thousand on.

    Examples
    --------
    >>> [number(value) for value in (0.12345, 999.7, -1234.5, math.inf, -math.inf)]
    ['0.123', '1,000', '−1,234', '∞', '−∞']
    """
    value += 0.0  # no negative zero
    if math.isinf(value):
        text = "∞" if value > 0 else "-∞"
    else:
        text = f"{value:,.0f}" if abs(value) >= 999.5 else f"{value:.3g}"
    return f"−{text[1:]}" if text.startswith("-") else text


def seeds_to_tell(criterion: Criterion, evidence: Evidence) -> float:
    """Seeds at which an interval would leave its bound behind, with a chance of 80%.

    What an interval reaches beyond its estimate over n seeds is proportional to 1 / sqrt(n). If the
    estimate stayed what it is, the interval would just end at the bound with
    n (reach / distance to the bound)^2 seeds; chance takes it further in half of all repetitions.
    With 2.04 times as many seeds (a normal estimate, a 95% interval) it is 80% of them.

    Parameters
    ----------
    criterion : Criterion
    evidence : Evidence
        With which it is open.

    Returns
    -------
    float
        Rounded up to tens; infinite where no number of seeds would do, because the estimate is the
        bound, or the interval has no end.

    Examples
    --------
    >>> tenth = Criterion("at least a tenth", at_least=0.1)
    >>> seeds_to_tell(tenth, Evidence(0.2, 0.0, 0.4, seeds=30))
    250
    """
    low, middle, high = evidence.low, evidence.estimate, evidence.high
    held = [bound for bound in criterion.bounds if low <= bound <= high]
    bound = min(held, key=lambda bound: abs(middle - bound), default=math.nan)
    reach, distance = (middle - low if bound < middle else high - middle), abs(middle - bound)
    if not (math.isfinite(reach) and distance > 0 and math.isfinite(distance)):
        return math.inf
    return math.ceil(evidence.seeds * (reach / distance) ** 2 * POWER / 10) * 10


def excluded(criterion: Criterion, evidence: Evidence) -> str:
    """Say which values an open criterion's interval rules out, on the side that would bear it out.

    Examples
    --------
    >>> excluded(Criterion("above a half", above=0.5), Evidence(0.55, 0.47, 0.63, seeds=30))
    'above 0.63'
    """
    parts = []
    if math.isfinite(criterion.at_most) and math.isfinite(evidence.low):
        parts.append(f"below {number(evidence.low)}")
    if criterion.bounds != (criterion.at_most,) and math.isfinite(evidence.high):
        parts.append(f"above {number(evidence.high)}")
    return " and ".join(parts) or "nothing"


class Judged(NamedTuple):
    """One criterion of one reading of a claim, with its evidence."""

    id: str
    reading: str
    place: int
    criterion: Criterion
    evidence: Evidence
    answer: Answer

    @property
    def label(self) -> str:
        """Its name, such as "3a, criterion 1"."""
        reading = f" ({self.reading})" if self.reading else ""
        return f"{self.id}{reading}, criterion {self.place}"


def judged(findings: Sequence[Finding]) -> Iterator[Judged]:
    """Every criterion of every reading of the claims."""
    for finding in findings:
        for one in (finding, *finding.others):
            parts = zip(one.claim.criteria, one.evidence, one.answers, strict=True)
            for place, part in enumerate(parts, 1):
                yield Judged(one.claim.id, one.claim.reading, place, *part)


def _distinct(findings: Sequence[Finding]) -> Iterator[Judged]:
    """The same, but once where two readings share a criterion and its evidence."""
    seen = set()
    for one in judged(findings):
        key = (one.id, one.criterion, one.evidence)
        if key not in seen:
            seen.add(key)
            yield one


def what_it_would_take(findings: Sequence[Finding]) -> str:
    """Say which criteria are open, how many seeds would settle each, and what is excluded.

    Examples
    --------
    >>> claim = Claim("9a", "9", "Few.", (Criterion("at most 2", at_most=2),), "Figure 9")
    >>> what_it_would_take([claim.judge(Evidence(1, 0, 3, seeds=30))])
    '9a, criterion 1: 250 (excluded: below 0)'
    >>> what_it_would_take([claim.judge(Evidence.exact(1))])
    'none is open'
    """
    parts = []
    for one in _distinct(findings):
        if one.answer == "open":
            seeds = seeds_to_tell(one.criterion, one.evidence)
            text = f"{seeds:,}" if math.isfinite(seeds) else "no number"
            parts.append(f"{one.label}: {text} (excluded: {excluded(one.criterion, one.evidence)})")
    return "; ".join(parts) or "none is open"


def sensitivity(
    finding: Finding, about: float, values: ArrayLike, *, windows: Sequence[float] = WINDOWS
) -> pd.DataFrame:
    """Say what becomes of a claim of "about" so much where "about" means more, or less.

    Parameters
    ----------
    finding : Finding
        Of a claim all of whose criteria have the bounds of one window.
    about : float
        What the report says.
    values : array, shape (seeds,)
        What each seed comes to; infinite where it does not get there.
    windows : sequence of float
        Half the widths of what counts as "about", as shares of it.

    Returns
    -------
    pandas.DataFrame
        A row a window: `claim, about, window, low, high, share` of the seeds inside, `verdict`.

    Raises
    ------
    TypeError, ValueError
        An argument is not as described, or NaN.

    Examples
    --------
    >>> claim = Claim("9a", "9", "About 100.", (Criterion("75 to 125", 75, 125),), "Figure 9")
    >>> finding = claim.judge(Evidence(125, 110, 132, seeds=4))
    >>> sensitivity(finding, 100, [90, 120, 130, 400])[["window", "share", "verdict"]]
       window  share      verdict
    0    0.15   0.25  cannot tell
    1    0.25   0.50  cannot tell
    2    0.35   0.75        holds
    """
    about, values = checks.number("about", about), floats("values", values, (None,), finite=False)
    require(len(values), "values", values, "not empty")
    claim, rows = finding.claim, []
    for window in windows:
        half = checks.number("windows", window, above=0) * abs(about)
        low, high = about - half, about + half
        criteria = tuple(Criterion(one.text, low, high) for one in claim.criteria)
        judged = replace(claim, criteria=criteria, readings=()).judge(*finding.evidence)
        share = float(np.mean((low <= values) & (values <= high)))
        rows.append((claim.id, about, window, low, high, share, judged.verdict))
    columns = ["claim", "about", "window", "low", "high", "share", "verdict"]
    return pd.DataFrame(rows, columns=columns)


def criteria(findings: Sequence[Finding]) -> pd.DataFrame:
    """One row for each criterion of each reading: what was asked and measured, and the answer.

    A criterion that two readings share, with the same evidence, has one row. `near` says whether
    its interval ends within a tenth of its width of a bound.

    Examples
    --------
    >>> half = Criterion("above a half", above=0.5)
    >>> claim = Claim("9b", "9", "Better.", (half,), "Figure 9")
    >>> rows = criteria([claim.judge(Evidence(0.7, 0.51, 0.9, seeds=30))])
    >>> rows[["label", "answer", "near"]].values.tolist()
    [['9b, criterion 1', 'yes', True]]
    """
    rows = []
    for one in _distinct(findings):
        numbers = {"label": one.label, "criterion": one.criterion.text, **asdict(one.evidence)}
        bound = one.criterion.margin(one.evidence.estimate)[1]
        near = _is_near(one.criterion, one.evidence)
        rows.append({**numbers, "bound": bound, "answer": one.answer, "near": near})
    names = ("label", "criterion", "estimate", "low", "high", "seeds", "bound", "answer", "near")
    return pd.DataFrame(rows, columns=list(names))


def _is_near(criterion: Criterion, evidence: Evidence) -> bool:
    """Whether the interval ends within a tenth of its width of a bound."""
    ends = (evidence.low, evidence.high)
    distance = min(abs(end - bound) for end in ends for bound in criterion.bounds)
    return 0 < _half(evidence) < math.inf and distance <= _half(evidence) / 5


def verdicts(findings: Sequence[Finding]) -> pd.DataFrame:
    """One row for each claim: its verdict and where to look."""
    rows = pd.DataFrame([finding.row() for finding in findings], columns=list(COLUMNS))
    return rows[["id", "claim", "verdict", "figure"]]


def details(findings: Sequence[Finding]) -> pd.DataFrame:
    """One row for each criterion of each claim: what was asked, what was measured, the answer.

    The estimate and its interval are one text, so that the table fits on a phone.
    """
    return pd.DataFrame(
        [
            {
                "id": one.id,
                "criterion": f"{one.reading}: " * bool(one.reading) + one.criterion.text,
                "measured": f"{number(one.evidence.estimate)} "
                f"[{number(one.evidence.low)}, {number(one.evidence.high)}]",
                "seeds": one.evidence.seeds,
                "met": one.answer,
            }
            for one in judged(findings)
        ]
    )


def record(
    findings: Sequence[Finding],
    folder: Path,
    *,
    chapter: str,
    about: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Write a chapter's findings, and anew the book's tables from all chapters so far.

    Parameters
    ----------
    findings : sequence of Finding
        The chapter's findings.
    folder : Path
        Where the results are. `claims.csv`, `criteria.csv` and `about.csv` are written in it, from
        a part a chapter in `claims/<chapter>.csv` and so on; each at once or not at all.
    chapter : str
        The chapter's name, which orders the parts: letters and digits, never a path.
    about : pandas.DataFrame, optional
        The rows of `sensitivity` for the chapter's claims of "about" so much.

    Returns
    -------
    pandas.DataFrame
        The chapter's rows, with the columns of `claims.csv`.

    Raises
    ------
    TypeError, ValueError
        If a claim is given twice, here or in another chapter, or `chapter` is not such a name.

    Examples
    --------
    >>> import tempfile
    >>> claim = Claim("9a", "9", "Few.", (Criterion("at most 2", at_most=2),), "Figure 9")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     rows = record([claim.judge(Evidence.exact(1))], Path(folder), chapter="9")
    ...     sorted(path.name for path in Path(folder).glob("*.csv"))
    ['claims.csv', 'criteria.csv']
    >>> rows["verdict"].tolist()
    ['holds']
    """
    chapter = file_name("chapter", chapter)
    rows = pd.DataFrame([finding.row() for finding in findings], columns=list(COLUMNS))
    rows["chapter"] = chapter
    if about is not None:
        words = about["window"].map("{:.0%}: ".format) + about["verdict"]
        rows["about"] = rows["id"].map(words.groupby(about["claim"]).agg("; ".join)).fillna("")
        _gather(about, folder, "about", chapter)
    everything = _with_others(rows, folder, "claims", chapter)
    twice = everything.loc[everything["id"].duplicated(), "id"].tolist()
    require(not twice, "findings", ", ".join(twice), "of claims that are judged only once")
    _gather(rows, folder, "claims", chapter)
    _gather(criteria(findings), folder, "criteria", chapter)
    return rows


def _with_others(rows: pd.DataFrame, folder: Path, name: str, chapter: str) -> pd.DataFrame:
    """A chapter's rows among those of the others, in their order."""
    paths = [path for path in sorted((folder / name).glob("*.csv")) if path.stem != chapter]
    text = dict.fromkeys(("id", "section", "chapter"), str)
    known = {path.stem: pd.read_csv(path, dtype=text) for path in paths} | {chapter: rows}
    return pd.concat([known[one] for one in sorted(known)], ignore_index=True)


def _gather(rows: pd.DataFrame, folder: Path, name: str, chapter: str) -> None:
    """Write a chapter's part of a table, and the table."""
    (folder / name).mkdir(parents=True, exist_ok=True)
    _write_atomically(rows, folder / name / f"{chapter}.csv")
    _write_atomically(_with_others(rows, folder, name, chapter), folder / f"{name}.csv")


def _write_atomically(table: pd.DataFrame, path: Path) -> None:
    unfinished = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    table.to_csv(unfinished, index=False)
    os.replace(unfinished, path)
