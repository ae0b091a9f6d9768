"""Which cases a benchmark has: a fixed share of each kind, every mechanism and every size about equally often."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.generator.artefacts import ARTEFACTS
from xb_muscle_ros.prove.generator.effects import EFFECTS, OUTSIDE
from xb_muscle_ros.prove.generator.study import TRIALS

NULL, ARTEFACT, SINGLE, PAIR, COMPOSITE, OUTSIDE_KIND = "null", "artefact", "single", "pair", "composite", "outside"
SHARES = {NULL: 0.2, ARTEFACT: 0.2, SINGLE: 0.4, PAIR: 0.1, OUTSIDE_KIND: 0.1}
"""Of a benchmark of singles, by kind."""
SIZES = (0.005, 0.01, 0.02, 0.04)
"""RMS that an effect of a single leaves after a refit, F0."""
MODEL_SHARES = {
    "3state_coop": 0.5,
    "2state_coop": 0.2,
    "2state": 0.15,
    "3state_coop_rigid": 0.1,
    "2state_coop_rigid": 0.05,
}
"""How often a model is given where the effect leaves it open."""


class Part(NamedTuple):
    """A share of the composites.

    Attributes:
        kind: ``null``: ordinary artefacts only; ``artefact``: artefacts beyond them; ``composite``: mechanisms;
            ``outside``: an effect that has no name, perhaps beside a mechanism.
    """

    kind: str
    share: float
    mechanisms: int = 0
    artefacts: int = 0


PARTS = (
    Part(NULL, 0.15), Part(ARTEFACT, 0.08, artefacts=1), Part(ARTEFACT, 0.07, artefacts=2), Part(COMPOSITE, 0.2, 1),
    Part(COMPOSITE, 0.2, 2), Part(COMPOSITE, 0.12, 3), Part(COMPOSITE, 0.08, 4), Part(OUTSIDE_KIND, 0.05),
    Part(OUTSIDE_KIND, 0.05, 1),
)  # fmt: skip
# Unique contribution that an effect of a composite is to have, F0, and how often.
_SIZES = ((0.003, 0.01, 0.15), (0.01, 0.04, 0.75), (0.04, 0.05, 0.10))
# How many trials, and how often.
_TRIALS = ((7, 7, 0.3), (8, 12, 0.55), (13, 20, 0.1), (21, 30, 0.05))
# A refit takes the place of the others: nobody could find them.
_MEANT = tuple(name for name in MECHANISMS if name not in (Name.TEMPERATURE, Name.PHOSPHATE))


class Spec(NamedTuple):
    """What a case is to be.

    Attributes:
        kind: a key of `SHARES`, or of a `Part`.
        labels: effects that are concealed: mechanisms, then ``outside:`` and a name.
        sizes: of a single, the RMS that all leave after a refit; of a composite, the unique contribution of each, F0.
        model: that the tool is given.
        artefacts: of the measurement, of different families.
    """

    kind: str
    labels: tuple[str, ...]
    sizes: tuple[float, ...]
    model: str
    artefacts: tuple[str, ...] = ()
    trials: int = TRIALS

    @property
    def size(self) -> float | None:
        """Of a single; None where there is none to reach."""
        return self.sizes[0] if self.sizes else None


def singles(cases: int, seed: int) -> list[Spec]:
    """All singles in the order of their numbers, which says nothing."""
    random = np.random.default_rng([seed, 0])
    counts = dict(zip(SHARES, _counts(list(SHARES.values()), cases), strict=True))
    made = [Spec(NULL, (), (), drawn_model(random, tuple(MODEL_SHARES))) for _ in range(counts[NULL])]
    for name in _turns(random, list(MEASUREMENT), counts[ARTEFACT]):
        made.append(Spec(ARTEFACT, (), (), drawn_model(random, tuple(MODEL_SHARES)), (name,)))
    for kind, labels in ((SINGLE, list(MECHANISMS)), (OUTSIDE_KIND, list(OUTSIDE))):
        for label, size in _sized(random, labels, counts[kind]):
            made.append(Spec(kind, (label,), (size,), drawn_model(random, EFFECTS[label].models)))
    made += [_pair(random, size) for size in _turns(random, SIZES, counts[PAIR])]
    return [made[i] for i in random.permutation(len(made))]


def spikes(cases: int, seed: int, model: str) -> list[Spec]:
    """Cases for recordings of one fibre: one in five as recorded, else a mechanism that the model can have."""
    random = np.random.default_rng([seed, 0])
    bare = round(0.2 * cases)
    possible = [name for name in MECHANISMS if model in EFFECTS[name].models]
    if not possible:
        raise UserError(f"model {model} can have no effect of the generator; allowed are {', '.join(MODEL_SHARES)}")
    made = [Spec(NULL, (), (), model) for _ in range(bare)]
    made += [Spec(SINGLE, (label,), (size,), model) for label, size in _sized(random, possible, cases - bare)]
    return [made[i] for i in random.permutation(len(made))]


def composites(cases: int, seed: int) -> list[Spec]:
    """All composites in the order of their numbers, which says nothing."""
    random = np.random.default_rng([seed, 0])
    used: Counter[str] = Counter()
    made = []
    for part, count in zip(PARTS, _counts([part.share for part in PARTS], cases), strict=True):
        for _ in range(count):
            outside = _least_used(random, OUTSIDE, used, 1) if part.kind == OUTSIDE_KIND else []
            labels = [*_least_used(random, _MEANT, used, part.mechanisms, outside), *outside]
            artefacts = _least_used(random, tuple(ARTEFACTS), used, part.artefacts)
            used.update([*labels, *artefacts])
            sizes = tuple(_size(random) for _ in labels)
            model = drawn_model(random, _models_of(labels))
            low, high = _among(random, _TRIALS)
            trials = int(random.integers(int(low), int(high) + 1))
            made.append(Spec(part.kind, tuple(labels), sizes, model, tuple(artefacts), trials))
    return [made[i] for i in random.permutation(len(made))]


def _counts(shares: Sequence[float], cases: int) -> list[int]:
    """Numbers of each part by largest remainder."""
    wanted = [share * cases for share in shares]
    counts = [int(number + 1e-9) for number in wanted]
    by_rest = sorted(range(len(shares)), key=lambda i: counts[i] - wanted[i])
    for i in by_rest[: cases - sum(counts)]:
        counts[i] += 1
    return counts


def _turns(random: np.random.Generator, what: Sequence[Any], count: int) -> list[Any]:
    """So many of them, each as often as the others, in random order."""
    taken: list[Any] = []
    while len(taken) < count:
        taken += [what[i] for i in random.permutation(len(what))]
    return taken[:count]


def _sized(random: np.random.Generator, labels: Sequence[str], count: int) -> list[tuple[str, float]]:
    """Labels by turns; over a label's turns its sizes go round, and over a turn's labels they are balanced."""
    place = dict(zip(labels, _turns(random, range(len(SIZES)), len(labels)), strict=True))
    out = []
    for label in _turns(random, labels, count):
        out.append((label, SIZES[place[label] % len(SIZES)]))
        place[label] += 1
    return out


def _pair(random: np.random.Generator, size: float) -> Spec:
    """Two mechanisms of different families that one model can have, and that a refit does not hide."""
    while True:
        pair = tuple(_MEANT[i] for i in random.choice(len(_MEANT), 2, replace=False))
        both = tuple(m for m in EFFECTS[pair[0]].models if m in EFFECTS[pair[1]].models)
        if len(_families(pair)) == 2 and both:
            return Spec(PAIR, pair, (size,), drawn_model(random, both))


def drawn_model(random: np.random.Generator, allowed: Sequence[str]) -> str:
    """One of the models, by their shares."""
    weights = np.array([MODEL_SHARES[model] for model in allowed])
    return str(random.choice(list(allowed), p=weights / weights.sum()))


def _least_used(
    random: np.random.Generator, names: Sequence[str], used: Counter[str], count: int, beside: Sequence[str] = ()
) -> list[str]:
    """Names of different families that go together, those first that were used least; among equals by chance."""
    while True:
        order = [names[i] for i in random.permutation(len(names))]
        order.sort(key=lambda name: used[name])
        chosen: list[str] = []
        for name in order:
            other = _families([name]).isdisjoint(_families(chosen))
            if len(chosen) < count and other and _models_of([*beside, *chosen, name]):
                chosen.append(name)
        if len(chosen) == count:
            return chosen


def _families(labels: Iterable[str]) -> set[str]:
    return {FAMILY[label] for label in labels if label not in OUTSIDE}


def _models_of(labels: Iterable[str]) -> tuple[str, ...]:
    """Models that can have all of these effects; every model where there are none."""
    possible = [EFFECTS[label].models for label in labels if label in EFFECTS]
    return tuple(model for model in MODEL_SHARES if all(model in models for models in possible))


def _size(random: np.random.Generator) -> float:
    low, high = _among(random, _SIZES)
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _among(random: np.random.Generator, rows: Sequence[tuple[float, float, float]]) -> tuple[float, float]:
    """Bounds of one of the rows, by their shares."""
    low, high, _ = rows[int(random.choice(len(rows), p=[share for _, _, share in rows]))]
    return low, high
