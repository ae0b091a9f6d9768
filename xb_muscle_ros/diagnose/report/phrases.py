"""Numbers and names of a diagnosis as its sentences, tables and figures write them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from xb_muscle_ros.diagnose.component import NAMED, Component, HeldOutGain, Kind, Parameter
from xb_muscle_ros.diagnose.residual import Place
from xb_muscle_ros.diagnose.result import Diagnosis, NuisanceParameter
from xb_muscle_ros.diagnose.words import after_number, digits, family_words, human, joined, phase_words, quantity

NOTHING = "–"
"""Where a number is unknown."""
ONE_WAY = 0.5
"""Where the mean is less than this share of the root mean square, a residual goes both ways."""
_SURE_WORDS = (
    (0.99, "almost certainly"),
    (0.90, "very likely"),
    (0.66, "probably"),
    (NAMED, "more likely than not"),
    (0.33, "possibly"),
    (0.10, "hardly"),
)
_MOST_MEMBERS = 3
_MINUS = "−"


def sureness(probability: float) -> str:
    """The adverb that goes with a probability."""
    return next((words for least, words in _SURE_WORDS if probability >= least), "very unlikely")


def probability(value: float) -> str:
    """Two digits, cut and not rounded, so that no threshold seems to be reached that is not."""
    if not math.isfinite(value):
        return NOTHING
    if value >= 0.995:
        return "> 0.99"
    return "< 0.01" if value < 0.01 else f"{math.floor(100.0 * value + 1e-9) / 100.0:.2f}"


def share(value: float) -> str:
    """A fraction in per cent: whole, within 0 and 100."""
    if not math.isfinite(value):
        return NOTHING
    if 0.0 < value < 0.01:
        return "< 1 %"
    if 0.99 < value < 1.0:
        return "> 99 %"
    return f"{round(100.0 * min(max(value, 0.0), 1.0))} %"


def force(value_f0: float | None, unit: str = " % F0") -> str:
    """A force in % F0 with two significant digits."""
    if value_f0 is None or not math.isfinite(value_f0):
        return NOTHING
    return digits(100.0 * value_f0).replace("-", _MINUS) + unit


def signed(value_f0: float) -> str:
    """A force in % F0 with its sign, without the unit."""
    text = force(value_f0, "")
    return f"+{text}" if value_f0 > 0.0 and text != NOTHING else text


def p_value(value: float, floor: float = 0.0) -> str:
    """A p-value; at the floor of the bootstrap it may be any smaller one."""
    if not math.isfinite(value):
        return NOTHING
    if value <= floor * (1.0 + 1e-9):
        return f"≤ {digits(value)}"
    return "< 0.001" if 0.0 <= value < 0.001 else digits(value)


def gain(g: HeldOutGain | None) -> str:
    """``+0.16 ± 0.05``."""
    if g is None or not math.isfinite(g.mean):
        return NOTHING
    # Zero has no sign.
    mean = f"{g.mean:+.2f}".replace("-", _MINUS) if round(g.mean, 2) else "0.00"
    return mean + (f" ± {g.se:.2f}" if math.isfinite(g.se) else "")


def number(value: float, unit: str | None = None, significant: int = 3) -> str:
    """A value of three digits with its unit."""
    return quantity(value, unit, significant).replace("-", _MINUS, 1) if math.isfinite(value) else NOTHING


def error(n: NuisanceParameter) -> tuple[str, str]:
    """An ordinary artefact with its standard error, and what is ordinary; short times in ms."""
    scale, unit = (1e3, "ms") if n.unit == "s" and abs(n.prior_sd) < 0.1 else (1.0, n.unit)
    value, prior = number(scale * n.value, significant=2), number(scale * n.prior_sd, unit, 2)
    sd = "" if n.sd is None else f" ± {number(scale * n.sd, significant=2)}"
    return f"{value}{sd}{after_number(unit)}", f"± {prior}"


def estimate(p: Parameter) -> str:
    """Value, unit and interval, in one line."""
    if not math.isfinite(p.value):
        return NOTHING
    low, high = p.interval
    known = math.isfinite(low) and math.isfinite(high)
    return number(p.value, p.unit) + (f" [{number(low)}, {number(high)}]" if known else "")


def title(c: Component) -> str:
    """A component as a sentence calls it; a family by its members, or by its name where they are many."""
    if len(c.members) < 2:
        return human(c.name)
    if len(c.members) > _MOST_MEMBERS:
        return f"one of {len(c.members)} mechanisms of {family_words(c.family)}"
    return joined([human(name) for name in c.members], "or")


def called(d: Diagnosis, name: str) -> str:
    """A component by its name, as a sentence calls it."""
    found = next((c for c in d.components if c.name == name), None)
    return human(name) if found is None else title(found)


def mechanisms(components: Iterable[Component]) -> list[Component]:
    """Those that are physics."""
    return [c for c in components if c.kind is Kind.MECHANISM]


def artefacts(components: Iterable[Component]) -> list[Component]:
    """Those that are the measurement's."""
    return [c for c in components if c.kind is Kind.ARTEFACT]


def replicated(c: Component) -> tuple[int, int]:
    """In how many fibres a component that the other fibres show is found again, and of how many."""
    known = [row for row in c.by_fibre if row.replication is not None]
    return sum(row.replicates for row in known), len(known)


def replicated_by(d: Diagnosis, fibre: str) -> list[str]:
    """What of the answer a fibre replicates."""
    return [c.members[0] for c in d.named if any(row.fibre == fibre and row.replicates for row in c.by_fibre)]


def changed(d: Diagnosis) -> bool:
    """Whether the answer is another model than the base; where it is not, only one is shown."""
    return d.after.names != d.before.names or d.after.train_rmsd_f0 != d.before.train_rmsd_f0


def fibres(d: Diagnosis) -> str:
    """Whose recordings they are."""
    if len(d.fibres) == 1:
        return f"fibre {d.fibres[0]}"
    return f"{len(d.fibres)} fibres" if d.fibres else "the fibre"


def way(place: Place) -> int:
    """1 where measured force is higher than simulated, -1 where lower, 0 where it goes both ways or is unknown."""
    if not math.isfinite(place.mean_f0) or not abs(place.mean_f0) >= ONE_WAY * place.size_f0:
        return 0
    return (place.mean_f0 > 0.0) - (place.mean_f0 < 0.0)


def solutions(levels: Iterable[float | None]) -> str:
    """``pCa 6.2 to 5.8``, from low to high calcium; empty where none is known."""
    known = sorted({round(v, 6) for v in levels if v is not None and math.isfinite(v)}, reverse=True)
    if not known:
        return ""
    return f"pCa {known[0]:g}" if len(known) == 1 else f"pCa {known[0]:g} to {known[-1]:g}"


def _like_first(places: Sequence[Place]) -> list[Place]:
    """The largest place with all others of its phase and direction."""
    return [p for p in places if p.phase == places[0].phase and way(p) == way(places[0])]


def largest(places: Sequence[Place]) -> str:
    """Size of the largest place that `where` speaks of."""
    rows = _like_first(places)
    words = "up to " if len({(p.fibre, p.trial) for p in rows}) > 1 else ""
    return words + force(max(p.size_f0 for p in rows))


def where(d: Diagnosis, places: Sequence[Place]) -> str:
    """Phase and conditions of the largest place, with all others of its phase and direction."""
    first, rows = places[0], _like_first(places)
    trials = list(dict.fromkeys((p.fibre, p.trial) for p in rows))
    total, levels = len(d.trials), solutions(p.pca for p in rows)
    if len(trials) == 1:
        of = f" at {levels}" if levels else f" of trial {first.trial}"
        of += f" (fibre {first.fibre})" if len(d.fibres) > 1 else ""
    else:
        count = "all" if len(trials) == total else f"{len(trials)} of {total}"
        of = f" of {count} trials" + (f" ({levels})" if levels else "")
    return phase_words(first.phase) + of
