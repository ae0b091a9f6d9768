"""Which cases a benchmark has: a fixed share of each kind, every mechanism and every size about equally often."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.generator.effects import EFFECTS, OUTSIDE

SHARES = {"null": 0.2, "fault": 0.2, "single": 0.4, "pair": 0.1, "outside": 0.1}
SIZES = (0.005, 0.01, 0.02, 0.04)
"""RMS that an effect leaves after a refit, F0."""
MODEL_SHARES = {
    "3state_coop": 0.5,
    "2state_coop": 0.2,
    "2state": 0.15,
    "3state_coop_rigid": 0.1,
    "2state_coop_rigid": 0.05,
}
"""How often a model is given where the effect leaves it open."""


class Spec(NamedTuple):
    """What a case is to be.

    Attributes:
        kind: a key of `SHARES`.
        labels: what is concealed: names, or ``outside:`` and a name; empty for a null.
        size: to reach, F0; None where there is none to reach.
        model: that the tool is given.
    """

    kind: str
    labels: tuple[str, ...]
    size: float | None
    model: str


def specs(cases: int, seed: int) -> list[Spec]:
    """All cases in the order of their numbers, which tells nothing."""
    random = np.random.default_rng([seed, 0])
    counts = _counts(cases)
    made = [Spec("null", (), None, drawn_model(random, tuple(MODEL_SHARES))) for _ in range(counts["null"])]
    for label in _turns(random, [name.value for name in MEASUREMENT], counts["fault"]):
        made.append(Spec("fault", (label,), None, drawn_model(random, tuple(MODEL_SHARES))))
    for kind, labels in (("single", [name.value for name in MECHANISMS]), ("outside", list(OUTSIDE))):
        for label, size in _sized(random, labels, counts[kind]):
            made.append(Spec(kind, (label,), size, drawn_model(random, EFFECTS[label].models)))
    sizes = _turns(random, SIZES, counts["pair"])
    for size in sizes:
        made.append(_pair(random, size))
    return [made[i] for i in random.permutation(len(made))]


def spike_specs(cases: int, seed: int, model: str) -> list[Spec]:
    """Cases for recordings of one fibre: one in five as recorded, else a mechanism that the model can have."""
    random = np.random.default_rng([seed, 0])
    bare = round(0.2 * cases)
    possible = [name.value for name in MECHANISMS if model in EFFECTS[name.value].models]
    if not possible:
        raise UserError(f"model {model} can have no effect of the generator; allowed are {', '.join(MODEL_SHARES)}")
    made = [Spec("null", (), None, model) for _ in range(bare)]
    made += [Spec("single", (label,), size, model) for label, size in _sized(random, possible, cases - bare)]
    return [made[i] for i in random.permutation(len(made))]


def _counts(cases: int) -> dict[str, int]:
    """Numbers of each kind by largest remainder."""
    counts = {kind: int(share * cases + 1e-9) for kind, share in SHARES.items()}
    by_rest = sorted(SHARES, key=lambda kind: counts[kind] - SHARES[kind] * cases)
    for kind in by_rest[: cases - sum(counts.values())]:
        counts[kind] += 1
    return counts


def _turns(random: np.random.Generator, what: Sequence, count: int) -> list:  # type: ignore[type-arg]
    """So many of them, each as often as the others, in random order."""
    taken: list[object] = []
    while len(taken) < count:
        taken += [what[i] for i in random.permutation(len(what))]
    return taken[:count]


def _sized(random: np.random.Generator, labels: Sequence[str], count: int) -> list[tuple[str, float]]:
    """Labels by turns; over a label's turns its sizes go round, and over a turn's labels they are balanced."""
    first = dict(zip(labels, _turns(random, range(len(SIZES)), len(labels)), strict=True))
    seen: dict[str, int] = {}
    out = []
    for label in _turns(random, labels, count):
        place = (first[label] + seen.get(label, 0)) % len(SIZES)
        seen[label] = seen.get(label, 0) + 1
        out.append((label, SIZES[place]))
    return out


def _pair(random: np.random.Generator, size: float) -> Spec:
    """Two mechanisms of different families that one model can have, and that a refit does not hide."""
    names = [name for name in MECHANISMS if name not in (Name.TEMPERATURE, Name.PHOSPHATE)]
    while True:
        a, b = (names[i] for i in random.choice(len(names), 2, replace=False))
        both = tuple(model for model in EFFECTS[a.value].models if model in EFFECTS[b.value].models)
        if FAMILY[a] != FAMILY[b] and both:
            return Spec("pair", (a.value, b.value), size, drawn_model(random, both))


def drawn_model(random: np.random.Generator, allowed: Sequence[str]) -> str:
    """One of the models, by their shares."""
    weights = np.array([MODEL_SHARES[model] for model in allowed])
    return str(random.choice(list(allowed), p=weights / weights.sum()))
