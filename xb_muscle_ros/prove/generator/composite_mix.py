"""Which composites a benchmark has: a fixed share of each kind, every mechanism about equally often."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.names import FAMILY, MECHANISMS, Name
from xb_muscle_ros.prove.generator.effects import EFFECTS, OUTSIDE
from xb_muscle_ros.prove.generator.mix import MODEL_SHARES, drawn_model
from xb_muscle_ros.prove.generator.ordinary import ARTEFACTS

NULL, FAULT, COMPOSITE, OUTSIDE_KIND = "null", "fault", "composite", "outside"


class Part(NamedTuple):
    """A share of the cases.

    Attributes:
        kind: ``null``: ordinary errors only; ``fault``: artefacts as well; ``composite``: mechanisms; ``outside``: an
            effect that has no name, perhaps beside a mechanism.
        share: of all cases.
        mechanisms, artefacts: how many.
    """

    kind: str
    share: float
    mechanisms: int = 0
    artefacts: int = 0


PARTS = (
    Part(NULL, 0.15), Part(FAULT, 0.08, artefacts=1), Part(FAULT, 0.07, artefacts=2), Part(COMPOSITE, 0.2, 1),
    Part(COMPOSITE, 0.2, 2), Part(COMPOSITE, 0.12, 3), Part(COMPOSITE, 0.08, 4), Part(OUTSIDE_KIND, 0.05),
    Part(OUTSIDE_KIND, 0.05, 1),
)  # fmt: skip
# What an effect is to leave beside the rest, F0, and how often.
_SIZES = ((0.003, 0.01, 0.15), (0.01, 0.04, 0.75), (0.04, 0.05, 0.10))
# How many trials, and how often.
_TRIALS = ((7, 7, 0.3), (8, 12, 0.55), (13, 20, 0.1), (21, 30, 0.05))
# A refit takes the place of these: nobody could find them.
_MEANT = tuple(name for name in MECHANISMS if name not in (Name.TEMPERATURE, Name.PHOSPHATE))


class CompositeSpec(NamedTuple):
    """What a composite is to be.

    Attributes:
        kind: of its `Part`.
        labels: effects that are concealed: mechanisms of different families, then ``outside:`` and a name.
        sizes: what each is to leave beside the rest, F0.
        artefacts: of the measurement, of different families.
        model: that the tool is given.
        trials: of the study.
    """

    kind: str
    labels: tuple[str, ...]
    sizes: tuple[float, ...]
    artefacts: tuple[str, ...]
    model: str
    trials: int


def composite_specs(cases: int, seed: int) -> list[CompositeSpec]:
    """All cases in the order of their numbers, which tells nothing."""
    random = np.random.default_rng([seed, 0])
    used: Counter[str] = Counter()
    made = []
    for part, count in zip(PARTS, _counts(cases), strict=True):
        for _ in range(count):
            outside = _least_used(random, OUTSIDE, used, 1) if part.kind == OUTSIDE_KIND else []
            labels = [*_mechanisms(random, part.mechanisms, outside, used), *outside]
            artefacts = _least_used(random, tuple(ARTEFACTS), used, part.artefacts)
            used.update([*labels, *artefacts])
            sizes = tuple(_size(random) for _ in labels)
            model = drawn_model(random, _models_of(labels))
            made.append(CompositeSpec(part.kind, tuple(labels), sizes, tuple(artefacts), model, _trials(random)))
    return [made[i] for i in random.permutation(len(made))]


def _counts(cases: int) -> list[int]:
    """Numbers of each part by largest remainder."""
    wanted = [part.share * cases for part in PARTS]
    counts = [int(number + 1e-9) for number in wanted]
    by_rest = sorted(range(len(PARTS)), key=lambda i: counts[i] - wanted[i])
    for i in by_rest[: cases - sum(counts)]:
        counts[i] += 1
    return counts


def _mechanisms(random: np.random.Generator, count: int, beside: Sequence[str], used: Counter[str]) -> list[str]:
    """So many mechanisms that one model can have, beside others."""
    return _least_used(random, [name.value for name in _MEANT], used, count, beside)


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
    return {FAMILY[Name(label)] for label in labels if label not in OUTSIDE}


def _models_of(labels: Iterable[str]) -> tuple[str, ...]:
    """Models that can have all of these effects; every model where there are none."""
    possible = [EFFECTS[label].models for label in labels if label in EFFECTS]
    return tuple(model for model in MODEL_SHARES if all(model in models for models in possible))


def _size(random: np.random.Generator) -> float:
    low, high = _among(random, _SIZES)
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _trials(random: np.random.Generator) -> int:
    low, high = _among(random, _TRIALS)
    return int(random.integers(int(low), int(high) + 1))


def _among(random: np.random.Generator, rows: Sequence[tuple[float, float, float]]) -> tuple[float, float]:
    """Bounds of one of the rows, by their shares."""
    low, high, _ = rows[int(random.choice(len(rows), p=[share for _, _, share in rows]))]
    return low, high
