"""Facts of a trial in names of files, sheets and columns: pCa, and amplitude and recovery of the paper's protocol."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.trials.readers.calcium import pcas_in
from xb_muscle_ros.trials.readers.description import fact_of, name_of

# Others are no trial's: 10 without its point is pCa 10 and not 1.
_USUAL_PCA = (3.0, 12.0)


class NamePattern(NamedTuple):
    """A regular expression for ``file_name.pattern``, its factors, and what it reads in the first name."""

    pattern: str
    factors: dict[str, float]
    found: dict[str, float]


# Patterns by order of how much they tell; factors for numbers that are written without their point.
_PATTERNS: tuple[tuple[str, dict[str, float]], ...] = (
    (
        r"amp(?P<amplitude_l0>\d+)_rt(?P<recovery_s>\d+)ms_pca(?P<pca>\d+)",
        {"amplitude_l0": 1e-4, "recovery_s": 1e-3, "pca": 0.1},
    ),
    # pCa4_5 may be 4.5, or 4 and the fifth trial.
    (r"[pP][cC][aA][ _=-]?(?P<pca>\d{1,2}[.,]\d+|1[0-2](?![\d.,])|\d(?!\d|[._,p-]\d))", {}),
    (r"[pP][cC][aA][ _=-]?(?P<pca>\d{2})(?![\d.,])", {"pca": 0.1}),
    (r"(?<!\d)(?P<pca>\d{2})[pP][cC][aA]", {"pca": 0.1}),
)


def name_pattern(paths: Sequence[Path]) -> NamePattern | None:
    """The first pattern that the names of all files have, with a pCa that is one; None where there is none."""
    return pattern_in([name_of(path) for path in paths])


def sheet_pattern(sheets: Sequence[str]) -> NamePattern | None:
    """The same of those of several sheets that tell a pCa, for their whole names; None where one tells two."""
    told = {sheet: len(pcas_in(sheet)) for sheet in sheets}
    named = [sheet for sheet, count in told.items() if count]
    found = pattern_in(named) if len(named) > 1 and max(told.values()) == 1 else None
    return None if found is None else found._replace(pattern=f".*?{found.pattern}.*")


def column_pattern(columns: Sequence[str]) -> NamePattern | None:
    """The same of several columns that differ in the pCa alone, for their whole names."""
    found = pattern_in(columns) if len(columns) > 1 else None
    if found is None:
        return None
    around = {re.sub(found.pattern, "\0", name, count=1) for name in columns}
    if len(around) > 1:
        return None
    before, _, after = around.pop().partition("\0")
    return found._replace(pattern=f"{_plain(before)}{found.pattern}{_plain(after)}")


def _plain(text: str) -> str:
    return re.escape(text).replace("\\ ", " ")


def pattern_in(names: Sequence[str]) -> NamePattern | None:
    """The same of any names."""
    for pattern, factors in _PATTERNS:
        found = [_found(pattern, factors, name) for name in names]
        if found and all(each is not None for each in found):
            assert found[0] is not None  # all of them are
            return NamePattern(pattern, factors, found[0])
    return None


def _found(pattern: str, factors: dict[str, float], name: str) -> dict[str, float] | None:
    match = re.search(pattern, name)
    if match is None or len(pcas_in(name)) > 1:
        return None
    values = {key: fact_of(text, factors.get(key, 1.0), key, name) for key, text in match.groupdict().items()}
    return values if _USUAL_PCA[0] <= values["pca"] <= _USUAL_PCA[1] else None
