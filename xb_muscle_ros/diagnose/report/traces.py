"""``traces.npz``: every trial of a diagnosis sample by sample, as measured and as the models have it."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import replaced
from xb_muscle_ros.trials.trial import Array

_WITHOUT = "without_"
_AGAIN = "run xb_muscle diagnose again"


@dataclass(frozen=True, eq=False)
class TrialTraces:
    """One trial; arrays of shape (n,), lengths in L0, forces in F0.

    Attributes:
        time_s: of the measured samples, s.
        start_f0: of the fibre file as given.
        before_f0, after_f0: base and answer, fitted to all trials.
        heldout_before_f0, heldout_after_f0: predicted by fits that did not see the trial's condition; None where none
            was left out.
        without_f0: by component of the answer: the answer's model with that component's effect set to nothing,
            everything else as fitted.
    """

    fibre: str
    trial: str
    time_s: Array
    length_l0: Array
    measured_f0: Array
    start_f0: Array
    before_f0: Array
    after_f0: Array
    heldout_before_f0: Array | None = None
    heldout_after_f0: Array | None = None
    without_f0: Mapping[str, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse signals of another length than the time's."""
        for name, values in self.signals().items():
            if values.shape != self.time_s.shape or self.time_s.ndim != 1:
                raise UserError(
                    f"trial {self.trial}: {name} has shape {values.shape}, its time {self.time_s.shape}; "
                    "give one value for each sample"
                )

    def signals(self) -> dict[str, Array]:
        """All arrays that there are by the names that they have in the file."""
        own = {name: getattr(self, name) for name in _REQUIRED if getattr(self, name) is not None}
        return own | {f"{_WITHOUT}{name}_f0": values for name, values in self.without_f0.items()}

    def adds_f0(self, name: str) -> Array:
        """What a component adds to the force: the answer's less that without it, F0, shape (n,)."""
        return self.after_f0 - self.without_f0[name]


_REQUIRED = {f.name: f.default is MISSING for f in fields(TrialTraces) if str(f.type).startswith("Array")}
"""Whether a trial has to have it, by signal."""


def write_traces(path: Path, traces: Sequence[TrialTraces]) -> None:
    """Write all trials; the file appears whole or not at all.

    Raises:
        UserError: the folder cannot be written.
    """
    names = json.dumps([{"fibre": t.fibre, "trial": t.trial} for t in traces])
    arrays: dict[str, Any] = {"names": np.array(names)}
    for i, trial in enumerate(traces):
        arrays |= {f"t{i}_{name}": np.asarray(values, dtype=np.float64) for name, values in trial.signals().items()}
    with replaced(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)


def read_traces(path: Path) -> tuple[TrialTraces, ...]:
    """Read what `write_traces` wrote.

    Raises:
        UserError: the file is missing, damaged or of an older version.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            if "names" not in file:
                raise UserError(f"{path} was made by an older version; {_AGAIN}")
            names = json.loads(str(file["names"]))
            return tuple(_trial(file, i, row["fibre"], row["trial"], path) for i, row in enumerate(names))
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise UserError(f"{path} cannot be read: {error}; {_AGAIN}") from error


def _trial(file: Any, i: int, fibre: str, trial: str, path: Path) -> TrialTraces:
    head = f"t{i}_"
    found = {name.removeprefix(head): name for name in file.files if name.startswith(head)}
    missing = [name for name, required in _REQUIRED.items() if required and name not in found]
    if missing:
        raise UserError(f"{path} has no {head}{missing[0]} (trial {trial}); {_AGAIN}")
    without = {
        name.removeprefix(_WITHOUT).removesuffix("_f0"): file[key]
        for name, key in found.items()
        if name.startswith(_WITHOUT)
    }
    known = {name: file[key] for name, key in found.items() if name in _REQUIRED}
    return TrialTraces(fibre=fibre, trial=trial, without_f0=without, **known)
