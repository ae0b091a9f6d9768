"""What an evaluation is asked for."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.work import Options


@dataclass(frozen=True)
class Request:
    """What to evaluate.

    Attributes:
        out: folder for results; the journal lies there too.
        bags: bag folders, ``.mcap`` files or folders of bags; may be empty where `empirical` is given.
        fibres: fibre files or names; empty: a bag's own, or all of the package's that were measured.
        models: parameter sets; None for all that the fibre files have.
        method: representation of strain; None for the fibre file's.
        settle_s: isometric time before a trial, s; None until at rest.
        measured_only: no models.
        skip_bad: leave recordings that cannot be used out, in place of refusing all.
        empirical: table of measured SRS; its presence asks for the paper's grid.
        golden: the authors' released output.
        known: what is known of L0 and F0 beside bags and fibre files.
        only: take trials of this fibre and no other.
    """

    out: Path
    bags: tuple[str, ...] = ()
    fibres: tuple[str, ...] = ()
    models: tuple[str, ...] | None = None
    method: str | None = None
    settle_s: float | None = None
    measured_only: bool = False
    skip_bad: bool = False
    empirical: Path | None = None
    golden: Path | None = None
    work: Options = field(default_factory=Options)
    known: Known = field(default_factory=Known)
    only: str | None = None
