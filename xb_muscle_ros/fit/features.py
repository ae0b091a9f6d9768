"""Features as data: isometric force and short-range stiffness at conditions, from tables rather than traces."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.stretches import onset_stiffness, stretched_and_back, waited
from xb_muscle_ros.trials.trial import Array

KINDS = ("isometric_force", "srs_test", "srs_conditioning")


@dataclass(frozen=True)
class Feature:
    """One number measured on a fibre.

    Attributes:
        kind: of `KINDS`; isometric force in F0, stiffness of a stretch in F0/L0.
        pca: -log10 of free calcium in M.
        recovery_s, amplitude_l0: of the conditioning before a test stretch, s and L0; of no account for other kinds.
        sd: its standard deviation, with what the model cannot be expected to meet.
        held_out: whether it is kept out of the fit.
    """

    kind: str
    pca: float
    recovery_s: float
    amplitude_l0: float
    value: float
    sd: float
    held_out: bool = False

    def __post_init__(self) -> None:
        where = f"feature {self.kind} at pCa {self.pca:g}"
        if self.kind not in KINDS:
            raise UserError(f"{where}: kind is not known; there are {', '.join(KINDS)}")
        if not (np.isfinite(self.value) and self.sd > 0.0 and 1.0 <= self.pca <= 12.0):
            raise UserError(f"{where}: value {self.value:g} ± {self.sd:g}; needed are a finite value and an sd above 0")
        if not (0.0 <= self.recovery_s <= 1e4 and 0.0 <= self.amplitude_l0 <= 1.0):
            raise UserError(
                f"{where}: recovery {self.recovery_s:g} s, amplitude {self.amplitude_l0:g} L0; allowed is 0 to 1e4 s "
                "and 0 to 1 L0"
            )


# What a model cannot be expected to meet, of measured values: 2 % F0 of force, 5 % and 0.5 F0/L0 of stiffness.
_FORCE_SD_F0, _SRS_SHARE, _SRS_SD = 0.02, 0.05, 0.5
# Stretches in one solution share its error and the model's: all of them together tell as much as so many would alone.
_INDEPENDENT_PER_SOLUTION = 4
# Below it, F0/L0, a stretch's stiffness is mostly noise, and says nothing of the fibre's health.
_ACTIVE_SRS = 5.0

# A fibre's forces are divided by its isometric force at pCa 4.5: a model that is to give forces in F0 gives 1 there.
F0_ANCHOR = Feature("isometric_force", 4.5, 0.0, 0.0, 1.0, 0.02)


def simulated(muscle: Muscle, features: Sequence[Feature], shifts: Mapping[float, float] | None = None) -> Array:
    """What a fibre shows for each feature, shape (features,).

    Args:
        features: at any conditions; those of one pCa and amplitude share what went before.
        shifts: pCa shift of the solution by stated pCa.

    Raises:
        UserError: see `Muscle.settle` and `Muscle.step`; begins with the pCa.
    """
    out = np.empty(len(features))
    for pca in dict.fromkeys(f.pca for f in features):
        chosen = [i for i, f in enumerate(features) if f.pca == pca]
        calcium = 10.0 ** (6.0 - pca - (shifts or {}).get(pca, 0.0))
        with naming(f"features at pCa {pca:g}"):
            out[chosen] = _at_calcium(muscle, [features[i] for i in chosen], calcium)
    return out


def _at_calcium(muscle: Muscle, features: Sequence[Feature], calcium: float) -> list[float]:
    """Features of one solution."""
    settled = muscle.settle(0.0, calcium)
    conditioned: dict[float, Array] = {0.0: settled}
    found = []
    for f in features:
        if f.kind == "isometric_force":
            found.append(muscle.outputs(settled).force_f0)
        elif f.kind == "srs_conditioning":
            found.append(onset_stiffness(muscle, settled, calcium))
        else:
            if f.amplitude_l0 not in conditioned:
                conditioned[f.amplitude_l0] = stretched_and_back(muscle, settled, f.amplitude_l0, calcium)
            recovered = waited(muscle, conditioned[f.amplitude_l0], f.recovery_s, calcium)
            found.append(onset_stiffness(muscle, recovered, calcium))
    return found


def measured(
    path: Path, fibre: str, stiffness: bool = True, tell: Callable[[str], None] = lambda line: None
) -> tuple[Feature, ...]:
    """Features of one fibre from a table of measurements such as ``empirical_srs.json``.

    Isometric force is taken once for each pCa (mean over trials), stiffness of conditioning stretches as well, that of
    test stretches from every cell; those of one pCa count as four independent ones. The test stretches of a solution
    in which the fibre has run down are left out.

    Args:
        path: JSON with ``pCa``, ``recovery_s``, ``amplitude_L0``, ``fibres``: quantity -> [pCa][recovery][amplitude].
        stiffness: with SRS, or isometric force alone.
        tell: called with a line for each solution whose test stretches are left out.

    Raises:
        UserError: no such file or fibre, or nothing measured.
    """
    try:
        tables = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UserError(f"features {path} cannot be read: {error}") from error
    if not isinstance(tables, dict) or fibre not in tables.get("fibres", {}):
        known = ", ".join(tables.get("fibres", {})) if isinstance(tables, dict) else "none"
        raise UserError(f"features {path}: fibre '{fibre}' is not among {known}")
    cells = tables["fibres"][fibre]
    found: list[Feature] = []
    for i, pca in enumerate(tables["pCa"]):
        for kind in ("isometric_force", "srs_conditioning") if stiffness else ("isometric_force",):
            values = np.array(cells[kind][i], dtype=np.float64)
            if np.isfinite(values).any():
                found.append(feature(kind, pca, 0.0, 0.0, float(np.nanmean(values))))
        stretches = [
            feature("srs_test", pca, recovery, amplitude, float(cells["srs_test"][i][j][k]))
            for j, recovery in enumerate(tables["recovery_s"])
            for k, amplitude in enumerate(tables["amplitude_L0"])
            if stiffness and cells["srs_test"][i][j][k] is not None
        ]
        if _broken([f.value for f in stretches], np.array(cells["srs_conditioning"][i], dtype=np.float64)):
            tell(
                f"features {path}: {len(stretches)} test stretches at pCa {pca:g} are left out, their stiffness is "
                "that of a fibre that has run down"
            )
            stretches = []
        shared = max(1.0, len(stretches) / _INDEPENDENT_PER_SOLUTION) ** 0.5
        found += [replace(f, sd=f.sd * shared) for f in stretches]
    if not found:
        raise UserError(f"features {path}: nothing was measured on fibre '{fibre}'")
    return tuple(found)


def _broken(tests: Sequence[float], unconditioned: Array) -> bool:
    """Whether a solution's test stretches are those of a fibre that has run down: far below zero, or twice too stiff.

    Fibre 13Dec2017a at pCa 4.5 is one: -60 to 118 F0/L0 where unconditioned stretches had 41 to 47.
    """
    if not np.isfinite(unconditioned).any() or not len(tests):
        return False
    reference = float(np.nanmean(unconditioned))
    return reference > _ACTIVE_SRS and not -0.1 * reference < min(tests) <= max(tests) < 2.0 * reference


def feature(kind: str, pca: float, recovery_s: float, amplitude_l0: float, value: float) -> Feature:
    """A measured value with the standard deviation that its kind has."""
    sd = _FORCE_SD_F0 if kind == "isometric_force" else _SRS_SD + _SRS_SHARE * abs(value)
    return Feature(kind, pca, recovery_s, amplitude_l0, value, sd)
