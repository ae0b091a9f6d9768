"""What an evaluation is asked for, and what it found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from xb_muscle_ros.evaluate.sets import ModelSet
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.evaluate.trials import Trials
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.work import Options


@dataclass(frozen=True)
class Request:
    """What to evaluate.

    Attributes:
        bags: bag folders, ``.mcap`` files or folders of bags; may be empty where `empirical` is given.
        fibres: fibre files or names; empty: a bag's own, or all of the package's that were measured.
        models: parameter sets; None for all that the fibre files have.
        method: representation of strain; None for the fibre file's.
        settle_s: isometric time before a trial, s; None until at rest.
        measured_only: no models.
        skip_bad: leave recordings that cannot be used out, in place of refusing all.
        empirical: table of measured SRS; its presence asks for the paper's grid.
        golden: the authors' released output.
        out: folder for results; the journal lies there too.
        work: where to compute.
        known: what is known of L0 and F0 beside bags and fibre files.
        only: take trials of this fibre and no other.
    """

    bags: tuple[str, ...]
    fibres: tuple[str, ...]
    models: tuple[str, ...] | None
    method: str | None
    settle_s: float | None
    measured_only: bool
    skip_bad: bool
    empirical: Path | None
    golden: Path | None
    out: Path
    work: Options
    known: Known = field(default_factory=Known)
    only: str | None = None


@dataclass
class Results:
    """What an evaluation found.

    Attributes:
        sections: content of ``evaluate.json``.
        warnings: lines for the user.
        trials: of the recordings; None without.
        models: parameter sets, simplest first.
        tables: SRS of models on the same trials as `data`, by set.
        data: measured SRS; None where the recordings have none.
    """

    sections: dict[str, Any]
    warnings: list[str] = field(default_factory=list)
    trials: Trials | None = None
    models: list[ModelSet] = field(default_factory=list)
    tables: dict[str, SrsTable] = field(default_factory=dict)
    data: SrsTable | None = None
