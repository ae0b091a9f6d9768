"""A picture of a file: every signal against time, those that were recognised named, phases shaded."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.plotting.style import DATA, MODEL, SHADE, figure, save
from xb_muscle_ros.plotting.thinned import thinned
from xb_muscle_ros.trials.inspecting.clocks import clock_of
from xb_muscle_ros.trials.inspecting.inspection import Inspection
from xb_muscle_ros.trials.inspecting.report import times_of_signal
from xb_muscle_ros.trials.phases import detect_phases
from xb_muscle_ros.trials.readers.contents import Content
from xb_muscle_ros.trials.trial import Array, Phase

MOST_SIGNALS = 10
_UNITS = {"uM": "µM", "um": "µm", "L0": "$L_0$", "%L0": "% $L_0$", "F0": "$F_0$", "%F0": "% $F_0$", "us": "µs"}
_ORDER = ("length", "force", "calcium", "stimulation")
# Room above the first panel's values, where the names of phases stand, as a part of their range.
_HEAD_ROOM = 0.35
_PANEL_MM, _EXTRA_MM, _WIDTH_MM = 27.0, 22.0, 165.0


def draw(path: Path, made: Inspection) -> Path | None:
    """Draw into a PNG, and a PDF beside it.

    Returns:
        its path; None where the file has no signal but time.
    """
    shown = _shown(made)
    if not shown:
        return None
    phases = _phases(made)
    with figure(_WIDTH_MM, _EXTRA_MM + _PANEL_MM * min(len(shown), MOST_SIGNALS)) as fig:
        panels = np.ravel(fig.subplots(min(len(shown), MOST_SIGNALS), 1, sharex=True))
        in_s = [_panel(axes, made, content) for axes, content in zip(panels, shown, strict=False)]
        for axes in panels:
            for phase in phases[1::2]:
                axes.axvspan(phase.start_s, phase.end_s, color=SHADE, linewidth=0, zorder=0)
        _name_phases(panels[0], phases)
        left_out = len(shown) - MOST_SIGNALS
        more = f" ({left_out} more signals are not shown)" if left_out > 0 else ""
        unit = "Time (s)" if all(in_s) else "Time (its unit is not known)" if _has_time(made) else "Sample"
        panels[-1].set_xlabel(unit + more)
        fig.suptitle(_escaped(made.path.name), fontsize=8)
        with warnings.catch_warnings():
            # A script the font lacks is drawn as boxes; the report has the names.
            warnings.filterwarnings("ignore", "Glyph .* missing from")
            save(fig, path)
    return path


def _has_time(made: Inspection) -> bool:
    return "time" in made.recognition.roles


def _shown(made: Inspection) -> list[Content]:
    """Signals with a role first, then the others in the order of the file, without time itself."""
    roles = made.recognition.roles
    first = [roles[role].content for role in _ORDER if role in roles]
    time = roles["time"].content.label if "time" in roles else None
    taken = {content.label for content in first}
    return first + [
        each for each in made.contents.signals if each.label not in taken and each.label != time and each.finite.size
    ]


def _panel(axes: Any, made: Inspection, content: Content) -> bool:
    """One signal; returns whether its times are s."""
    times, in_s = times_of_signal(made, content)
    role = next((one for one in made.recognition.roles.values() if one.content is content), None)
    look: dict[str, Any] = {"color": DATA if role is None else MODEL, "linewidth": 0.9}
    holds = role is not None and role.role == "calcium" and content.times_s is not None
    bounds = clock_of(times, content).runs
    for i in range(len(bounds) - 1):
        part = slice(bounds[i], bounds[i + 1])
        drawn = "steps-post" if holds else "default"
        shown = _drawn(content.values[part])
        axes.plot(
            times[part][shown], content.values[part][shown], drawstyle=drawn,
            marker="." if times.size < 3 else None, **look,
        )  # fmt: skip
    unit = made.recognition.units[content.label]
    what = made.recognition.taken_for.get(content.label, "").partition(": ")[0] if role is None else ""
    axes.set_title(_escaped(f"{content.label}: {what}" if what else content.label), loc="left", pad=2)
    written = _UNITS.get(unit, _escaped(unit)) or "unit ?"
    axes.set_ylabel(written if role is None else f"{role.role.capitalize()} ({written})")
    axes.margins(x=0.01)
    return in_s


def _drawn(values: Array) -> slice | npt.NDArray[np.intp]:
    """Which samples of a signal to draw: all, or of a long one those that show, and where each gap begins."""
    known = np.isfinite(values)
    if not known.any():
        return slice(None)
    shown = thinned(np.arange(float(values.size)), np.where(known, values, values[np.argmax(known)]))
    if isinstance(shown, slice):
        return shown
    return np.union1d(shown, np.flatnonzero(known[:-1] & ~known[1:]) + 1)


def _escaped(text: str) -> str:
    """A text without Matplotlib's mathematics, and without characters that no font has."""
    return "".join(c for c in text if c.isprintable()).replace("$", r"\$")


def _phases(made: Inspection) -> tuple[Phase, ...]:
    """Phases of the trial, where there is one; else what the length record shows by itself."""
    time, length = made.recognition.roles.get("time"), made.recognition.roles.get("length")
    if len(made.trials) == 1:
        shift = 0.0
        if time is not None and time.content.finite.size:
            shift = min(float(times_of_signal(made, time.content)[0][0]), 0.0)
        elif length is not None and length.content.times_s is not None and not made.is_own:
            shift = float(length.content.times_s[0])
        elif length is not None and length.content.times_s is not None:
            shift = float(length.content.times_s[0] - made.trials[0].time_s[0])
        return tuple(Phase(p.name, p.start_s + shift, p.end_s + shift) for p in made.trials[0].facts.phases)
    if made.trials or length is None:
        return ()
    times, in_s = times_of_signal(made, length.content)
    values = length.content.values
    sound = np.isfinite(times).all() and np.isfinite(values).all() and bool(np.all(np.diff(times) > 0.0))
    if not in_s or not sound or values.size < 3 or float(values.min()) <= 0.0:
        return ()
    return detect_phases(times, values)


def _name_phases(axes: Any, phases: tuple[Phase, ...]) -> None:
    """Names of phases above the first panel; of very short ones none, for lack of room."""
    if not phases:
        return
    begin, end = axes.get_xlim()
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + _HEAD_ROOM * (high - low))
    for phase in phases:
        if phase.end_s - phase.start_s >= 0.06 * (end - begin):
            middle = 0.5 * (phase.start_s + phase.end_s)
            axes.annotate(
                phase.name.replace("_", "\n"), (middle, 0.97), xycoords=("data", "axes fraction"), fontsize=6.5,
                ha="center", va="top",
            )  # fmt: skip
