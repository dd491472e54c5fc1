"""The claims of the report: criteria fixed beforehand, evidence, verdicts, one table of them all.

A claim is one statement of the report. Its criteria say, before any data is seen, between which
bounds a measured quantity has to lie. The verdict follows from the interval of that quantity alone:
no one decides it after looking.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd

Answer = Literal["yes", "no", "open"]
Verdict = Literal["holds", "holds in part", "does not hold", "cannot tell"]
COLUMNS = (
    *("id", "section", "claim", "criterion", "estimate", "low", "high"),
    *("seeds", "verdict", "figure"),
)


@dataclass(frozen=True)
class Evidence:
    """A measured quantity with its 95% interval over seeds.

    Attributes
    ----------
    estimate, low, high : float
        The quantity and its interval; a quantity that does not depend on chance has no width.
    seeds : int
        How many seeds stand behind it; 0 where nothing is random.
    """

    estimate: float
    low: float
    high: float
    seeds: int

    def __post_init__(self) -> None:
        if not self.low <= self.estimate <= self.high:
            raise ValueError(
                "an interval must hold its estimate: low <= estimate <= high, "
                f"not {self.low}, {self.estimate}, {self.high}"
            )
        if self.seeds < 0:
            raise ValueError(f"seeds must not be negative, not {self.seeds}")

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
    ValueError
        If the text has a "; ", which stands between criteria in the table of claims.
    """

    text: str
    at_least: float = -math.inf
    at_most: float = math.inf
    above: float = -math.inf

    def __post_init__(self) -> None:
        if "; " in self.text:
            raise ValueError(
                f"text must be without '; ', which ends a criterion, got {self.text!r}"
            )

    def answer(self, evidence: Evidence) -> Answer:
        """Say "yes" if the whole interval is within the bounds, "no" if all of it is outside.

        Examples
        --------
        >>> criterion = Criterion("at most 100 steps", at_most=100)
        >>> criterion.answer(Evidence(90, 80, 99, seeds=30))
        'yes'
        >>> criterion.answer(Evidence(90, 80, 110, seeds=30))
        'open'
        """
        low, high = evidence.low, evidence.high
        if self.at_least <= low and high <= self.at_most and self._above(low):
            return "yes"
        if high < self.at_least or self.at_most < low or not self._above(high):
            return "no"
        return "open"

    def _above(self, value: float) -> bool:
        return self.above < value or self.above == -math.inf


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
    """

    id: str
    section: str
    claim: str
    criteria: tuple[Criterion, ...]
    figure: str

    def judge(self, *evidence: Evidence) -> "Finding":
        """Hold the evidence, one piece a criterion, against the criteria.

        All answers yes: the claim holds. Some yes, others not: it holds in part. None yes, but some
        no: it does not hold, because all of it would have to be true. Otherwise, all being open,
        the data cannot tell.

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
        if len(evidence) != len(self.criteria):
            raise ValueError(
                f"claim {self.id} has {len(self.criteria)} criteria, not {len(evidence)}"
            )
        answers = tuple(c.answer(e) for c, e in zip(self.criteria, evidence, strict=True))
        return Finding(self, evidence, answers)


@dataclass(frozen=True)
class Finding:
    """A claim with its evidence."""

    claim: Claim
    evidence: tuple[Evidence, ...]
    answers: tuple[Answer, ...]

    @property
    def verdict(self) -> Verdict:
        """What the answers come to."""
        if all(answer == "yes" for answer in self.answers):
            return "holds"
        if "yes" in self.answers:
            return "holds in part"
        return "does not hold" if "no" in self.answers else "cannot tell"

    def row(self) -> dict[str, object]:
        """Give the finding as a row of the table of claims."""
        first = self.evidence[0]
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
        }


def number(value: float) -> str:
    """A measured number as text: three digits, and whole from a thousand on.

    Examples
    --------
    >>> [number(value) for value in (0.12345, 999.7, -1234.5, math.inf, -math.inf)]
    ['0.123', '1,000', '−1,234', '∞', '−∞']
    """
    if math.isinf(value):
        text = "∞" if value > 0 else "-∞"
    else:
        text = f"{value:,.0f}" if abs(value) >= 999.5 else f"{value:.3g}"
    return f"−{text[1:]}" if text.startswith("-") else text


def seeds_to_tell(criterion: Criterion, evidence: Evidence) -> float:
    """Seeds at which an interval, shrinking with their root, would hold no bound any more.

    Half an interval's width over n seeds is proportional to 1 / sqrt(n). If the estimate stayed
    what it is, the bound would be left behind at n (half width / distance to the bound)^2 seeds.

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
    120
    """
    half = (evidence.high - evidence.low) / 2
    bounds = (criterion.at_least, criterion.at_most, criterion.above)
    held = [bound for bound in bounds if evidence.low <= bound <= evidence.high]
    distance = min((abs(evidence.estimate - bound) for bound in held), default=math.nan)
    if not (math.isfinite(half) and distance > 0 and math.isfinite(distance)):
        return math.inf
    return math.ceil(evidence.seeds * (half / distance) ** 2 / 10) * 10


def what_it_would_take(findings: Sequence[Finding]) -> str:
    """Say which criteria are open, and how many seeds would probably settle each.

    Examples
    --------
    >>> claim = Claim("9a", "9", "Few.", (Criterion("at most 2", at_most=2),), "Figure 9")
    >>> what_it_would_take([claim.judge(Evidence(1, 0, 3, seeds=30))])
    '9a, criterion 1: 70'
    >>> what_it_would_take([claim.judge(Evidence.exact(1))])
    'none is open'
    """
    parts = []
    for finding in findings:
        criteria = zip(finding.claim.criteria, finding.evidence, finding.answers, strict=True)
        for place, (criterion, evidence, answer) in enumerate(criteria, 1):
            if answer == "open":
                seeds = seeds_to_tell(criterion, evidence)
                text = f"{seeds:,}" if math.isfinite(seeds) else "no number"
                parts.append(f"{finding.claim.id}, criterion {place}: {text}")
    return "; ".join(parts) or "none is open"


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
                "id": finding.claim.id,
                "criterion": criterion.text,
                "measured": f"{number(evidence.estimate)} "
                f"[{number(evidence.low)}, {number(evidence.high)}]",
                "seeds": evidence.seeds,
                "met": answer,
            }
            for finding in findings
            for criterion, evidence, answer in zip(
                finding.claim.criteria, finding.evidence, finding.answers, strict=True
            )
        ]
    )


def record(findings: Sequence[Finding], folder: Path, *, chapter: str) -> pd.DataFrame:
    """Write a chapter's findings, and `claims.csv` anew from those of all chapters so far.

    Parameters
    ----------
    findings : sequence of Finding
        The chapter's findings.
    folder : Path
        Where the results are; `claims/<chapter>.csv` and `claims.csv` are written in it, each at
        once or not at all.
    chapter : str
        The chapter's name, which orders the parts.

    Returns
    -------
    pandas.DataFrame
        The chapter's rows, with the columns of `claims.csv`.

    Raises
    ------
    ValueError
        If a claim is given twice, here or in another chapter.

    Examples
    --------
    >>> import tempfile
    >>> claim = Claim("9a", "9", "Few.", (Criterion("at most 2", at_most=2),), "Figure 9")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     rows = record([claim.judge(Evidence.exact(1))], Path(folder), chapter="9")
    ...     sorted(path.name for path in Path(folder).iterdir())
    ['claims', 'claims.csv']
    >>> rows["verdict"].tolist()
    ['holds']
    """
    rows = pd.DataFrame([finding.row() for finding in findings], columns=list(COLUMNS))
    parts = folder / "claims"
    parts.mkdir(parents=True, exist_ok=True)
    others = [path for path in sorted(parts.glob("*.csv")) if path.stem != chapter]
    known = {path.stem: pd.read_csv(path, dtype={"id": str, "section": str}) for path in others}
    known[chapter] = rows
    everything = pd.concat([known[name] for name in sorted(known)], ignore_index=True)
    twice = everything.loc[everything["id"].duplicated(), "id"].tolist()
    if twice:
        raise ValueError(f"claims judged more than once: {', '.join(twice)}")
    _write_atomically(rows, parts / f"{chapter}.csv")
    _write_atomically(everything, folder / "claims.csv")
    return rows


def _write_atomically(table: pd.DataFrame, path: Path) -> None:
    unfinished = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    table.to_csv(unfinished, index=False)
    os.replace(unfinished, path)
