"""A trial: what was done to one fibre and what it answered; read-only data in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.spool import is_settled

Array = npt.NDArray[np.float64]


def frozen(values: npt.ArrayLike) -> Array:
    """A read-only copy of numbers; numbers that nobody can change are taken as they are."""
    if type(values) is np.ndarray and values.dtype == np.float64 and values.flags.c_contiguous and is_settled(values):
        return values
    array = np.ascontiguousarray(values, dtype=np.float64).copy()
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class Phase:
    """A named stretch of time within a trial.

    Attributes:
        name: ``isometric``, ``conditioning_stretch``, ``shortening``, ``recovery``, ``test_stretch`` or ``hold``;
            records that are not the paper's protocol use ``stretch`` and ``release`` (a quick shortening) as well,
            and ``clamp`` where force is held in place of length. Protocols add their own (``oscillation``, ``cycles``).
        start_s: begin, in the trial's own time, s.
        end_s: end, s; not before ``start_s``.
    """

    name: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class TrialFacts:
    """What is known of a trial beside its samples; kept in a bag's ``custom_data``.

    Attributes:
        fibre: name of the fibre.
        trial: name of the trial, unique within its data set.
        pca: -log10 of the free calcium in M; None where calcium changes.
        amplitude_l0: amplitude of the conditioning stretch in L0; None where there is none to speak of.
        recovery_s: time between shortening and test stretch, s; None where there is no test stretch.
        reference_length_m: the length that is one L0 (rest), m.
        f0_n: the isometric force at pCa 4.5 that is one F0, N.
        phases: in order of time.
        source: where the data come from, and what was done to them, in words.
        data_set: name of the set of recordings the trial belongs to; empty where there is none.
        protocol: name of the protocol that made the trial; empty where that is not known.
        settings: numbers of the protocol for this trial: name with unit, for example ``frequency_hz``, and number.
    """

    fibre: str
    trial: str
    pca: float | None = None
    amplitude_l0: float | None = None
    recovery_s: float | None = None
    reference_length_m: float = 1.0
    f0_n: float = 1.0
    phases: tuple[Phase, ...] = ()
    source: str = ""
    data_set: str = ""
    protocol: str = ""
    settings: tuple[tuple[str, float], ...] = ()

    def setting(self, name: str) -> float | None:
        """A number of the protocol; None where the trial does not tell."""
        return dict(self.settings).get(name)


@dataclass(frozen=True)
class Trial:
    """Samples and facts of one trial; arrays are read-only.

    Attributes:
        facts: see `TrialFacts`.
        time_s: shape (n,), strictly increasing, s; the trial's own time.
        length_m: shape (n,), fibre length, m.
        calcium_time_s: shape (m,), strictly increasing, s; a value holds until the next one.
        calcium_um: shape (m,), free calcium, µM.
        force_time_s: shape (k,), strictly increasing, s; empty where force was not measured.
        force_n: shape (k,), measured force, N.
        warnings: what was wrong with the source but could be lived with (a recovered file, say), one line each.
        force_is_measured: False where a model made the force that stands for the measured one.
    """

    facts: TrialFacts
    time_s: Array
    length_m: Array
    calcium_time_s: Array
    calcium_um: Array
    force_time_s: Array = field(default_factory=lambda: np.empty(0))
    force_n: Array = field(default_factory=lambda: np.empty(0))
    warnings: tuple[str, ...] = ()
    force_is_measured: bool = True

    def __post_init__(self) -> None:
        for name in ("time_s", "length_m", "calcium_time_s", "calcium_um", "force_time_s", "force_n"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def length_change_l0(self) -> Array:
        """Fibre length change relative to rest, L0, shape (n,)."""
        return self.length_m / self.facts.reference_length_m - 1.0

    def length_change_at(self, time_s: Array) -> Array:
        """The same at other times, linear between samples; looks at the samples around these times alone.

        Args:
            time_s: shape (n,), ascending, s.
        """
        if not time_s.size:
            return np.empty(0)
        first = max(int(np.searchsorted(self.time_s, time_s[0], side="right")) - 1, 0)
        around = slice(first, int(np.searchsorted(self.time_s, time_s[-1])) + 1)
        change = self.length_m[around] / self.facts.reference_length_m - 1.0
        found: Array = np.interp(time_s, self.time_s[around], change)
        return found

    @property
    def measured_f0(self) -> Array:
        """Measured force in F0, shape (k,)."""
        return self.force_n / self.facts.f0_n

    def phases_by_name(self) -> Mapping[str, Phase]:
        """The first phase of each name."""
        found: dict[str, Phase] = {}
        for phase in self.facts.phases:
            found.setdefault(phase.name, phase)
        return MappingProxyType(found)
