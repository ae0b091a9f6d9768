"""A file looked into: what is in it, what was recognised, what is missing, and the mapping that would import it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.bag_reading import TrialBag
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.inspecting.facts import facts_of
from xb_muscle_ros.trials.inspecting.mapping_text import Proposal
from xb_muscle_ros.trials.inspecting.proposal import propose
from xb_muscle_ros.trials.inspecting.recognition import Recognition, recognise
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.base import Reader
from xb_muscle_ros.trials.readers.columns import BAG
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.options import PATTERN
from xb_muscle_ros.trials.readers.registry import READERS, reader_for
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.study import trial_of_bag
from xb_muscle_ros.trials.trial import Trial


@dataclass(frozen=True)
class Inspection:
    """What was found in one file or bag.

    Attributes:
        path: of it.
        format: name of its reader, as ``--format`` has it.
        contents: what is in it.
        recognition: which signal is what.
        proposal: the mapping that would import it, with what is missing.
        trials: what an import by this mapping makes, or `replay` takes the bag for.
        refused: why trials are not made, though nothing is missing, one line each.
        replayed: lines on what `replay` takes for granted of the bag.
        is_own: the bag has this package's topics, so that no import is needed.
    """

    path: Path
    format: str
    contents: Contents
    recognition: Recognition
    proposal: Proposal
    trials: tuple[Trial, ...] = ()
    refused: tuple[str, ...] = ()
    replayed: tuple[str, ...] = ()
    is_own: bool = False

    @property
    def layout(self) -> tuple[object, ...]:
        """What files that one mapping imports have in common."""
        roles = {role: (one.content.label, one.unit) for role, one in self.recognition.roles.items()}
        names = tuple(signal.label for signal in self.contents.signals) if not READERS[self.format].defaults else ()
        return self.format, names, tuple(sorted(roles.items()))

    @property
    def imports(self) -> bool:
        """Whether an import by the mapping makes all trials."""
        return bool(self.trials) and not self.proposal.missing and not self.refused


def inspect_file(path: Path, file_format: str | None = None) -> Inspection:
    """Look into a file or a bag.

    Args:
        file_format: name of its reader; None for what it looks like.

    Raises:
        UserError: it cannot be read at all.
    """
    reader = reader_for(path, file_format)
    contents = reader.contents(path)
    recognition = recognise(contents, PATTERN in reader.takes)
    proposal = propose([path], reader, contents, recognition)
    trials, refused = ((), ()) if proposal.missing else imported(path, reader, proposal)
    replayed: tuple[str, ...] = ()
    own = reader.kind == BAG and _own_trials(path)
    if own:
        trials, replayed = own
    return Inspection(
        path, reader.name, contents, recognition, proposal, tuple(trials), tuple(refused), replayed, bool(own)
    )  # fmt: skip


def imported(path: Path, reader: Reader, proposal: Proposal) -> tuple[tuple[Trial, ...], tuple[str, ...]]:
    """The trials that an import by a mapping makes of a file, and why it makes no others."""
    trials: list[Trial] = []
    refused: list[str] = []
    try:
        prepared = ImportSettings(proposal.tree, "mapping", reader.name).prepare(path)
        for pending in prepared.reader.trials(path, prepared.mapping):
            try:
                trials.append(trial_of(pending.read(), prepared.mapping, path))
            except UserError as problem:
                refused.append(str(problem))
    except UserError as problem:
        refused.append(str(problem))
    return tuple(trials), tuple(refused)


def one_mapping(inspections: Sequence[Inspection]) -> Proposal:
    """The mapping of all files, which have to be of one layout.

    Raises:
        UserError: they are not.
    """
    first = inspections[0]
    other = next((one for one in inspections if one.layout != first.layout), None)
    if other is not None:
        raise UserError(
            f"{first.path} and {other.path} have different signals, and --mapping-out is of files that have the same; "
            "inspect them apart"
        )
    reader = reader_for(first.path, first.format)
    facts = [facts_of(one.contents) for one in inspections]
    return propose([one.path for one in inspections], reader, first.contents, first.recognition, facts)


def _own_trials(path: Path) -> tuple[tuple[Trial, ...], tuple[str, ...]] | None:
    """What `replay` takes a bag for, and its lines; None where it takes it for nothing."""
    try:
        bag = TrialBag(path)
        found = [trial_of_bag(bag, fibre, Known(), str(path)) for fibre in bag.fibres]
    except UserError:
        return None
    lines = dict.fromkeys(line for trial, notes in found for line in (*notes, *trial.warnings))
    return tuple(trial for trial, _ in found), tuple(lines)
