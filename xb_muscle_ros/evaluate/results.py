"""What an evaluation found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from xb_muscle_ros.evaluate.curves import ForcePcaRow, RedevelopmentRow
from xb_muscle_ros.evaluate.enhancement import EnhancementRow
from xb_muscle_ros.evaluate.force_scores import ForceScores
from xb_muscle_ros.evaluate.paper import PaperSection
from xb_muscle_ros.evaluate.sections import SetSection, SrsSection, TrialsSection
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.evaluate.trials import Trials


@dataclass(frozen=True)
class Sections:
    """Content of ``evaluate.json``; what was not computed is None there, and left out of the file.

    Attributes:
        trials, force_rmsd, notes: of recordings.
        paper: the paper's numbers beside ours.
        srs: of models beside measured SRS: of the paper's grid where it was computed, else of recordings.
        srs_of_recordings: of recordings where the paper's grid was computed as well.
        force_pca, k_tr, residual_force_enhancement: rows.
        enhancement_after_s: when after a stretch forces are compared, s.
    """

    sets: Sequence[SetSection] = ()
    trials: TrialsSection | None = None
    force_rmsd: ForceScores | None = None
    paper: PaperSection | None = None
    srs: SrsSection | None = None
    srs_of_recordings: SrsSection | None = None
    force_pca: Sequence[ForcePcaRow] = ()
    k_tr: Sequence[RedevelopmentRow] = ()
    residual_force_enhancement: Sequence[EnhancementRow] = ()
    enhancement_after_s: float | None = None
    notes: Sequence[str] | None = None

    def as_row(self) -> dict[str, Any]:
        """Content of the file."""
        return {name: part for name, part in vars(self).items() if part is not None}


@dataclass(frozen=True)
class Results:
    """What an evaluation found.

    Attributes:
        sections: content of ``evaluate.json``.
        warnings: lines for the user.
        trials: of the recordings; None without.
        tables: SRS of models on the same trials as `data`, by set.
        data: measured SRS; None where the recordings have none.
    """

    sections: Sections
    warnings: Sequence[str] = ()
    trials: Trials | None = None
    tables: Mapping[str, SrsTable] = field(default_factory=dict)
    data: SrsTable | None = None
