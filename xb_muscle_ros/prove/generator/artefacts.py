"""Measurement artefacts: what they make of length, calcium and force, the ordinary ones, and those beyond them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.world import SAMPLE_S, Stimulus
from xb_muscle_ros.trials.trial import Array


@dataclass(frozen=True)
class Artefacts:
    """Measurement artefacts of a study; the usual values are none.

    Attributes:
        pca_shift: true minus stated pCa, by stated pCa.
        length_gain: true over recorded length change, minus 1.
        run_down: share of its force that the fibre loses from trial to trial.
        force_offset: force recorded at no force, F0, for each trial.
        force_drift: rise of the recorded force, F0/s, for each trial.
        time_shift: by how much force is recorded later than length, s.
        transducer_lag: time constant of the force transducer, s.
    """

    pca_shift: Mapping[float, float] = field(default_factory=dict)
    length_gain: float = 0.0
    run_down: float = 0.0
    force_offset: tuple[float, ...] = ()
    force_drift: tuple[float, ...] = ()
    time_shift: float = 0.0
    transducer_lag: float = 0.0

    def given(self, study: Sequence[Planned]) -> list[Stimulus]:
        """What the fibre was truly given."""
        return [trial.stimulus(self.pca_shift.get(trial.pca, 0.0), self.length_gain) for trial in study]

    def recorded(self, force: Array, i: int) -> Array:
        """Force of trial i as it would be recorded without noise, F0, shape (n,)."""
        time_s = np.arange(force.size) * SAMPLE_S
        if self.transducer_lag > 0.0:
            force = _lagged(force, self.transducer_lag)
        if self.time_shift != 0.0:
            force = np.interp(time_s - self.time_shift, time_s, force)
        force = force * (1.0 - self.run_down) ** i
        offset, drift = (of[i] if of else 0.0 for of in (self.force_offset, self.force_drift))
        return force + offset + drift * time_s

    def as_json(self) -> dict[str, Any]:
        """Sizes as JSON can hold them."""
        plain = {name: list(of) if isinstance(of, tuple) else of for name, of in asdict(self).items()}
        return {**plain, "pca_shift": {f"{pca:g}": shift for pca, shift in self.pca_shift.items()}}


def _lagged(force: Array, lag_s: float) -> Array:
    """First-order low-pass of force that is straight between samples, from rest at the first sample."""
    left = np.exp(-SAMPLE_S / lag_s)
    ramp = lag_s / SAMPLE_S * (1.0 - left)
    # y[k] = left y[k-1] + (1 - ramp) x[k] + (ramp - left) x[k-1]
    out, _ = lfilter([1.0 - ramp, ramp - left], [1.0, -left], force - force[0], zi=np.zeros(1))
    return np.asarray(out + force[0])


class Size(NamedTuple):
    """How large an artefact beyond the ordinary is: so many times what is ordinary, or what one would overlook."""

    ordinary: float
    least: float
    most: float


_SIZES = {
    Name.PCA_SHIFT: (Size(0.05, 1.2, 3.0), Size(0.04, 3.0, 6.0)),
    Name.RUN_DOWN: (Size(0.01, 1.5, 5.0), Size(0.003, 3.0, 7.0)),
    Name.FORCE_OFFSET: (Size(0.005, 2.0, 6.0), Size(0.003, 3.0, 8.0)),
    Name.FORCE_DRIFT: (Size(0.002, 3.0, 12.0), Size(0.002, 3.0, 10.0)),
    Name.LENGTH_GAIN: (Size(0.02, 2.0, 6.0), Size(0.01, 4.0, 10.0)),
    Name.TIME_SHIFT: (Size(5e-4, 2.0, 8.0), Size(7e-4, 3.0, 6.0)),
    Name.TRANSDUCER_LAG: (Size(5e-4, 2.0, 8.0), Size(7e-4, 3.0, 6.0)),
}
PRIORS: Mapping[str, Size] = MappingProxyType({name: of_single for name, (of_single, _) in _SIZES.items()})
"""Of singles, by name: one prior SD, and how many SDs an artefact has."""
ARTEFACTS: Mapping[str, Size] = MappingProxyType({name: of_composite for name, (_, of_composite) in _SIZES.items()})
"""Of composites, by name."""
# A drift and a lag are no part of a careful study.
ORDINARY: Mapping[str, float] = MappingProxyType(
    {name: size.ordinary for name, size in ARTEFACTS.items() if name not in (Name.FORCE_DRIFT, Name.TRANSDUCER_LAG)}
)
"""Size of every ordinary artefact: SD of pCa of a solution, of the offset of a trial (F0), of a study's length gain and
time shift (s); the most that run-down takes of the force from trial to trial."""
# Nobody keeps a fibre that has lost more of its force than this.
_LOST = 0.3


def draw_ordinary(random: np.random.Generator, study: Sequence[Planned]) -> Artefacts:
    """Artefacts as any careful study has them."""
    solutions = sorted({trial.pca for trial in study})
    return Artefacts(
        pca_shift={pca: float(random.normal(0.0, ORDINARY[Name.PCA_SHIFT])) for pca in solutions},
        length_gain=float(random.normal(0.0, ORDINARY[Name.LENGTH_GAIN])),
        run_down=float(random.uniform(0.0, ORDINARY[Name.RUN_DOWN])),
        force_offset=tuple(float(random.normal(0.0, ORDINARY[Name.FORCE_OFFSET])) for _ in study),
        time_shift=float(random.normal(0.0, ORDINARY[Name.TIME_SHIFT])),
    )


def draw_artefact(
    name: str, random: np.random.Generator, study: Sequence[Planned], ordinary: Artefacts | None = None
) -> Artefacts:
    """An artefact of a size that is plausible and worth finding: alone, or in the place of an ordinary one."""
    alone, before = ordinary is None, ordinary or Artefacts()
    unit, least, most = (PRIORS if alone else ARTEFACTS)[name]
    if name == Name.RUN_DOWN and not alone:
        most = max(min(most, _LOST / unit / (len(study) - 1)), least)

    def size() -> float:
        return float(unit * random.uniform(least, most))

    def signed() -> float:
        return size() * float(random.choice([-1.0, 1.0]))

    if name == Name.PCA_SHIFT:
        between = sorted({trial.pca for trial in study if 4.5 < trial.pca < 9.0})
        count = int(random.integers(1, min(3, len(between)) + 1 if alone else 3))
        chosen = random.choice(between, count, replace=False)
        return replace(before, pca_shift={**before.pca_shift, **{float(pca): signed() for pca in chosen}})
    if name == Name.FORCE_OFFSET:
        if alone:
            return replace(before, force_offset=tuple(signed() for _ in study))
        # Of some trials only, or of all.
        count = len(study) if random.random() < 0.5 else max(2, round(0.4 * len(study)))
        moved = {int(i) for i in random.choice(len(study), count, replace=False)}
        offsets = tuple(signed() if i in moved else offset for i, offset in enumerate(before.force_offset))
        return replace(before, force_offset=offsets)
    if name == Name.FORCE_DRIFT:
        return replace(before, force_drift=tuple(signed() for _ in study))
    one_way = name in (Name.RUN_DOWN, Name.TRANSDUCER_LAG) or (alone and name == Name.TIME_SHIFT)
    value: dict[str, Any] = {name: size() if one_way else signed()}
    return replace(before, **value)


def with_artefacts(
    names: Sequence[str], random: np.random.Generator, study: Sequence[Planned], ordinary: Artefacts
) -> Artefacts:
    """Ordinary artefacts, but for those beyond them that take the place of some."""
    for name in names:
        ordinary = draw_artefact(name, random, study, ordinary)
    return ordinary
