"""Stretch reflex: what a fibre's length, velocity and force, some time ago, add to its muscle's excitation."""

from __future__ import annotations

import fnmatch
import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.plant.plant import Array

_LONGEST_S, _MOST = 1.0, 1e3


@dataclass(frozen=True)
class Reflex:
    """Gains, thresholds and delay, the same for all muscles that have the reflex; with gains of 0 there is none.

    Excitation (0 to 1, the share of F0 that it sustains) grows by

        k_l [l - l(0) - l_t]+ + k_v [v - v_t]+ + k_f [F - F(0)]+

    of the fibre's length l, velocity v and force F a delay ago, each from its value at the start and only where
    positive, as a spindle falls silent when it is unloaded. Form, and feedback of force: Geyer and Herr (2010), doi
    10.1109/TNSRE.2010.2047592, whose gains are 1.1 per L0 (tibialis anterior) and 1.2 per F0 (soleus, one leg), from
    fixed offsets in place of the start. Delay: the short-latency reflex of soleus begins 42 ms after a stretch of the
    standing person's ankle (Sinkjaer et al. 1996, J Neurophysiol 76:1112).

    Attributes:
        length_per_l0: k_l, excitation per L0 of stretch.
        velocity_s_per_l0: k_v, excitation per L0/s of lengthening.
        force_per_f0: k_f, excitation per F0 of rise in force.
        delay_s: from the fibre to the excitation of its muscle; a whole number of ticks.
        length_threshold_l0: l_t.
        velocity_threshold_l0_per_s: v_t.
        muscles: names that have it, or patterns as of file names (``soleus*``); none: all.
    """

    length_per_l0: float = 0.0
    velocity_s_per_l0: float = 0.0
    force_per_f0: float = 0.0
    delay_s: float = 0.04
    length_threshold_l0: float = 0.0
    velocity_threshold_l0_per_s: float = 0.0
    muscles: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what is no reflex.

        Raises:
            UserError: a number out of range.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple):
                continue
            most = _LONGEST_S if field.name == "delay_s" else _MOST
            if not 0.0 <= value <= most:
                raise UserError(f"the reflex's {field.name} is {value:g}; allowed is 0 to {most:g}")

    @property
    def works(self) -> bool:
        """Whether any gain is above 0."""
        return max(self.length_per_l0, self.velocity_s_per_l0, self.force_per_f0) > 0.0

    @property
    def words(self) -> str:
        """Gains and delay, for a title."""
        gains = (
            (self.length_per_l0, "/L0"),
            (self.velocity_s_per_l0, " s/L0"),
            (self.force_per_f0, "/F0"),
        )
        return f"reflex {', '.join(f'{gain:g}{unit}' for gain, unit in gains if gain)}, {1e3 * self.delay_s:g} ms"

    def ticks(self, tick_s: float) -> int:
        """The delay in ticks.

        Raises:
            UserError: it is no whole number of them.
        """
        ticks = round(self.delay_s / tick_s)
        if not math.isclose(ticks * tick_s, self.delay_s, rel_tol=1e-9, abs_tol=1e-12):
            raise UserError(
                f"the reflex's delay_s is {self.delay_s:g}; allowed are whole ticks of {tick_s:g} s, such as "
                f"{ticks * tick_s:g}"
            )
        return ticks

    def share(self, muscles: Sequence[str]) -> Array:
        """1 for each muscle that has the reflex, 0 for the others, shape (muscle,).

        Raises:
            UserError: a name or pattern is no muscle's.
        """
        share = np.full(len(muscles), 0.0 if self.muscles else 1.0)
        for pattern in self.muscles:
            chosen = [fnmatch.fnmatchcase(name, pattern) for name in muscles]
            if not any(chosen):
                raise UserError(f"no muscle for the reflex is called '{pattern}'{suggest(pattern, muscles)}")
            share[chosen] = 1.0
        return share


NO_REFLEX = Reflex()


class ReflexArc:
    """Excitation that muscles get from their own fibres, tick by tick."""

    def __init__(self, reflex: Reflex, muscles: Sequence[str], tick_s: float) -> None:
        """Wait for the first tick, which is the start.

        Args:
            reflex: gains.
            muscles: names, in the order of all arrays.
            tick_s: time between observations.

        Raises:
            UserError: the delay is no whole number of ticks, or a muscle is not there.
        """
        self.ticks = reflex.ticks(tick_s)
        self._reflex = reflex
        self._tick_s = tick_s
        self._share = reflex.share(muscles)
        self._start: tuple[Array, Array] | None = None

    def observe(self, length_l0: Array, force_f0: Array) -> Array:
        """What a moment adds to the excitation `ticks` later.

        Velocity is the mean of the tick that ends here, 0 at the start.

        Args:
            length_l0: length changes of the fibres, shape (muscle,).
            force_f0: their forces, shape (muscle,).

        Returns:
            shape (muscle,), 0 or above.
        """
        if self._start is None:
            self._start = length_l0.copy(), force_f0.copy()
            self._last = self._start[0]
        reflex, (length, force) = self._reflex, self._start
        velocity = (length_l0 - self._last) / self._tick_s
        self._last = length_l0.copy()
        added = reflex.length_per_l0 * np.maximum(length_l0 - length - reflex.length_threshold_l0, 0.0)
        added += reflex.velocity_s_per_l0 * np.maximum(velocity - reflex.velocity_threshold_l0_per_s, 0.0)
        added += reflex.force_per_f0 * np.maximum(force_f0 - force, 0.0)
        excitation: Array = self._share * added
        return excitation


class ReflexLoop:
    """The delay between fibres and what drives their muscles.

    Attributes:
        ahead: newest level, which drives the tick that begins `ticks` after the last observation, shape (muscle,).
        ticks: of the delay.
    """

    def __init__(self, arc: ReflexArc, start: Array, level: Callable[[Array], Array]) -> None:
        """Nothing is on its way.

        Args:
            arc: that has observed nothing yet.
            start: level without a reflex (calcium, µM, or excitation), shape (muscle,).
            level: of an excitation on top of that of the start, called once for every tick, in order.
        """
        self.ticks = arc.ticks
        self.ahead = start
        self._arc = arc
        self._level = level
        self._coming: deque[Array] = deque([start] * arc.ticks)

    def observe(self, length_l0: Array, force_f0: Array) -> Array:
        """Level of the tick that begins now, shape (muscle,); arguments as for `ReflexArc.observe`."""
        self.ahead = self._level(self._arc.observe(length_l0, force_f0))
        self._coming.append(self.ahead)
        return self._coming.popleft()

    @property
    def coming(self) -> tuple[Array, ...]:
        """Levels of the ticks after the newest that began, in order, `ticks` of them."""
        return tuple(self._coming)


def levels_by_tick(now: Array, reflex: ReflexLoop | None, tick: int) -> list[tuple[int, Array]]:
    """Level of the newest tick that began and, with a reflex, of those to come, each with its tick.

    Args:
        now: of the newest tick, shape (muscle,).
        reflex: what comes next; None: nothing changes.
        tick: how many were played since the start.
    """
    coming = () if reflex is None else reflex.coming
    return [*enumerate((now, *coming), max(tick - 1, 0))]
