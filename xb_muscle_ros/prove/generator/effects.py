"""What can be concealed: mechanisms, each in another form than the tool has, and effects that no tool knows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.prove.generator import beside
from xb_muscle_ros.prove.generator.layout import At, Series, Thick
from xb_muscle_ros.prove.generator.truth import Truth
from xb_muscle_ros.prove.generator.world import Acting, Stimulus
from xb_muscle_ros.trials.trial import Array

Shape = dict[str, float]

_COMPLIANT = ("3state_coop", "2state_coop", "2state")
_ALL = (*_COMPLIANT, "3state_coop_rigid")


class Effect(NamedTuple):
    """One row of the table.

    Attributes:
        label: a name of `diagnose.names`, or ``outside:`` and a name.
        meaning: of the scale, with its unit.
        models: worlds that can have it, by the name of the model that is given to the tool.
        start: a usual scale.
        most: scale beyond which it is no more plausible.
        draw: the constants that give it its form.
        apply: the truth with the effect of a scale and form; at scale 0 as it was.
    """

    label: str
    meaning: str
    models: tuple[str, ...]
    start: float
    most: float
    draw: Callable[[np.random.Generator], Shape]
    apply: Callable[[Truth, float, Shape], Truth]


def _between(**bounds: tuple[float, float]) -> Callable[[np.random.Generator], Shape]:
    """Draws each constant evenly on a log scale where its bounds are positive, else evenly."""

    def draw(random: np.random.Generator) -> Shape:
        return {
            name: float(np.exp(random.uniform(*np.log([low, high]))) if low > 0.0 else random.uniform(low, high))
            for name, (low, high) in bounds.items()
        }

    return draw


def _set(place: At, **shaped: At) -> Callable[[Truth, float, Shape], Truth]:
    """An effect that is an entry of the loop's vector; its form is other entries."""

    def apply(truth: Truth, scale: float, shape: Shape) -> Truth:
        return truth.changed({place: scale, **{at: shape[name] for name, at in shaped.items()}})

    return apply


def _middle(values: Array) -> Array:
    """Means over sample intervals."""
    return np.asarray(0.5 * (values[1:] + values[:-1]))


def _on_input(what: str, change: Callable[[Stimulus, float, Shape], Array]) -> Callable[[Truth, float, Shape], Truth]:
    """An effect that acts on the input by its stimulus alone: a field of `Acting`, one value per sample interval."""

    def apply(truth: Truth, scale: float, shape: Shape) -> Truth:
        def act(study: Sequence[Stimulus], i: int) -> Acting:
            return replace(Acting.plain(study[i].length.size - 1), **{what: change(study[i], scale, shape)})

        return truth.acting(act)

    return apply


def _beside(force: Callable[..., Array]) -> Callable[[Truth, float, Shape], Truth]:
    """An effect that is an element beside the heads, whose force is a function of the stimulus, scale and form."""
    return lambda truth, scale, shape: truth.adding(lambda stimulus, _: force(stimulus, scale, **shape))


def _sensitivity(s: Stimulus, scale: float, shape: Shape) -> Array:
    return np.asarray(10.0 ** (scale * _middle(s.length)))


def _recruited(s: Stimulus, scale: float, shape: Shape) -> Array:
    late = beside.leaky(np.maximum(s.length, 0.0), shape["delay_s"]) / shape["delay_s"]
    return scale * _middle(np.expm1(shape["steepness"] * late) / shape["steepness"])


def _slipping(truth: Truth, scale: float, shape: Shape) -> Truth:
    way, unevenness, release_s = shape["way"], shape["unevenness"], shape["release_s"]
    return truth.adding(
        lambda s, answer: scale * answer.bound * beside.slipping_friction(s.length, way, unevenness, release_s)
    )


def _persistent(truth: Truth, scale: float, shape: Shape) -> Truth:
    # Going to rest is slowed a little more or less than waking.
    values = {**_USUAL, **truth.world.values}
    return truth.changed({At.J1: values["J1"] * np.exp(-scale), At.J2: values["J2"] * np.exp(-scale * shape["uneven"])})


def _draw_spread(random: np.random.Generator) -> Shape:
    count = int(random.integers(3, 6))
    z = random.standard_normal(count)
    z = (z - z.mean()) / z.std()
    tie = float(np.exp(random.uniform(*np.log([0.002, 0.01]))))
    return {"tie": tie, **{f"unit_{m}": float(value) for m, value in enumerate(z)}}


def _spread(truth: Truth, scale: float, shape: Shape) -> Truth:
    strength = tuple(1.0 + scale * z for name, z in shape.items() if name != "tie")
    # Ties bear differences only: what stretches the whole fibre is its parallel spring, with and without a spread.
    return truth.changed({At.UNIT_STIFFNESS: shape["tie"]}, strength)


def _compliance(truth: Truth, scale: float, shape: Shape) -> Truth:
    return truth.changed({At.SERIES: float(Series.QUADRATIC), At.SERIES_LENGTH: scale, At.SERIES_FORCE: shape["force"]})


def _cooperative(truth: Truth, scale: float, shape: Shape) -> Truth:
    # What heads do for each other's sites, sites need not do among themselves.
    return truth.changed({At.AFFINITY: scale, At.N: truth.world.values["n"] / (1.0 + 1.5 * scale)})


def _regulated(truth: Truth, scale: float, shape: Shape) -> Truth:
    # As many heads at full activation as before, or the fibre would be too weak to be kept.
    recruiting = 6.17 * (1.0 + shape["JF"] * 0.4 / (1.0 + 0.4 / shape["half_force"]))
    changes = {At.F: truth.world.values["f"] * (1.0 + scale / recruiting), At.THICK: float(Thick.FORCE_DEPENDENT)}
    return truth.changed({**changes, At.J2: scale, At.JF: shape["JF"], At.J_SATURATION: shape["half_force"]})


# Q10 of the rates: attachment and detachment of heads, both filaments.
_Q10 = {"f": 2.6, "k11": 2.1, "k21": 2.4, "kon": 1.4, "koff": 2.2, "J1": 4.0, "J2": 1.6, "tau_act": 0.5}
_USUAL = {"koff": 80.0, "J1": 6.17, "J2": 200.0, "tau_act": 0.005}


def _warm(truth: Truth, scale: float, shape: Shape) -> Truth:
    degrees = scale if shape["sign"] > 0.0 else -scale
    values = {**_USUAL, **truth.world.values}
    warm = {name: values[name] * q10 ** (0.1 * degrees) for name, q10 in _Q10.items() if name in values}
    return Truth(truth.world.with_values(warm), truth.acts, truth.adds)


def _inactivated(s: Stimulus, scale: float, shape: Shape) -> Array:
    stretching = np.maximum(beside.velocity(s.length), 0.0)
    return np.asarray(np.exp(-scale * _middle(beside.leaky(stretching, shape["decay_s"]))))


def _switched_off(s: Stimulus, scale: float, shape: Shape) -> Array:
    moving = beside.leaky(np.abs(beside.velocity(s.length)), shape["decay_s"]) / shape["decay_s"]
    return 1.0 + scale * _middle(moving)


def _buffered(s: Stimulus, scale: float, shape: Shape) -> Array:
    return np.asarray(np.exp(-scale * _middle(beside.leaky(beside.velocity(s.length), shape["decay_s"]))))


def _damaged(truth: Truth, scale: float, shape: Shape) -> Truth:
    def stretched(stimulus: Stimulus) -> Array:
        # Harm is done by stretch beyond rest, and the more so the more calcium is there.
        active = stimulus.calcium / (1.0 + stimulus.calcium)
        longer = np.maximum(np.diff(np.maximum(stimulus.length, 0.0), prepend=stimulus.length[0]), 0.0)
        return np.asarray(active * np.cumsum(longer))

    def act(study: Sequence[Stimulus], i: int) -> Acting:
        before = sum(float(stretched(earlier)[-1]) for earlier in study[:i])
        left = np.exp(-scale * (before + _middle(stretched(study[i]))))
        return replace(Acting.plain(left.size), attachment=left)

    return truth.acting(act)


_TITIN = {"half_pca": (6.0, 6.4), "hill": (2.0, 4.0)}
_ROWS = (
    Effect(
        Name.VISCOUS_DRAG, "drag at low speed, s", _ALL, 0.01, 0.1, _between(bend=(0.3, 2.0)),
        _beside(beside.saturating_drag),
    ),
    Effect(
        Name.PASSIVE_VISCOELASTICITY, "stiffness, F0/L0", _ALL, 1.0, 15.0,
        _between(exponent=(0.1, 0.4), steepness=(10.0, 30.0)), _beside(beside.power_law_relaxation),
    ),
    Effect(
        Name.WEAKLY_BOUND_HEADS, "stiffness, cross-bridge force per power stroke", _ALL, 0.05, 0.5,
        _between(rate=(100.0, 2000.0), strain=(2.0, 6.0), lag=(0.005, 0.02)),
        _set(At.WEAK_STIFFNESS, rate=At.WEAK_RATE, strain=At.WEAK_STRAIN, lag=At.WEAK_LAG),
    ),
    Effect(
        Name.FILAMENT_FRICTION, "friction if all heads were bound, F0", _ALL, 0.5, 4.0,
        _between(way=(0.004, 0.02), unevenness=(0.1, 0.4), release_s=(0.01, 0.3)), _slipping,
    ),
    Effect(
        Name.ACTIVE_TITIN, "stiffness when bound, F0/L0", _ALL, 2.0, 20.0,
        _between(contour=(0.12, 0.25), rebind_s=(0.03, 0.3), **_TITIN), _beside(beside.bound_titin),
    ),
    Effect(
        Name.STATIC_CALCIUM_STIFFNESS, "stiffness, F0/L0", _ALL, 2.0, 20.0,
        _between(steepness=(5.0, 20.0), **_TITIN), _beside(beside.stiffened_titin),
    ),
    Effect(
        Name.LENGTH_DEPENDENT_ACTIVATION, "pCa50 per length, 1/L0", _ALL, 1.5, 12.0, _between(),
        _on_input("calcium", _sensitivity),
    ),
    Effect(
        Name.LATTICE_SPACING, "attachment per length at rest, 1/L0", _ALL, 2.0, 12.0, _between(best=(0.85, 0.95)),
        _set(At.LATTICE_SLOPE, best=At.LATTICE_BEST),
    ),
    Effect(
        Name.FILAMENT_OVERLAP, "loss of overlap per length beyond the edge, 1/L0", _ALL, 1.5, 8.0,
        _between(edge=(-0.03, 0.0)), _set(At.OVERLAP_SLOPE, edge=At.OVERLAP_EDGE),
    ),
    Effect(
        Name.STRAIN_RECRUITED_HEADS, "J1's factor per length, 1/L0", ("3state_coop", "3state_coop_rigid"), 100.0,
        5000.0, _between(steepness=(5.0, 25.0), delay_s=(0.003, 0.02)), _on_input("recruitment", _recruited),
    ),
    Effect(
        Name.PERSISTENT_THICK_FILAMENT, "logarithm of slowing, 1", ("3state_coop", "3state_coop_rigid"), 1.5, 4.0,
        _between(uneven=(0.85, 1.15)), _persistent,
    ),
    Effect(
        Name.FORCIBLE_DETACHMENT, "rate of tearing off, 1/s", ("3state_coop", "2state_coop", "3state_coop_rigid"),
        500.0, 6000.0, _between(strain=(1.0, 3.0), steepness=(4.0, 10.0), rebind=(500.0, 3000.0)),
        _set(At.TEAR_RATE, strain=At.TEAR_STRAIN, steepness=At.TEAR_STEEPNESS, rebind=At.REBIND_RATE),
    ),
    Effect(Name.NONLINEAR_CROSSBRIDGE, "curvature, 1", _ALL, 0.1, 0.8, _between(), _set(At.HEAD_CURVATURE)),
    Effect(Name.HALF_SARCOMERE_SPREAD, "SD of strength, 1", _COMPLIANT, 0.05, 0.2, _draw_spread, _spread),
    Effect(
        Name.SERIES_COMPLIANCE, "length scale of the spring, power strokes",
        ("3state_coop_rigid", "2state_coop_rigid"), 1.0, 8.0, _between(force=(0.1, 0.4)), _compliance,
    ),
    Effect(
        Name.THIN_FILAMENT_COOPERATIVITY, "affinity per bound head, decades", ("2state",), 0.5, 3.0, _between(),
        _cooperative,
    ),
    Effect(
        Name.THICK_FILAMENT_COOPERATIVITY, "J2, 1/s", ("2state_coop",), 40.0, 600.0,
        _between(JF=(100.0, 500.0), half_force=(0.4, 1.2)), _regulated,
    ),
    Effect(
        Name.TEMPERATURE, "change, °C", ("3state_coop", "2state_coop"), 4.0, 10.0, _between(sign=(-1.0, 1.0)),
        _warm,
    ),
    Effect(
        Name.PHOSPHATE, "detachment before the stroke, 1/s", ("3state_coop", "2state_coop"), 30.0, 400.0,
        _between(), _set(At.PHOSPHATE_RATE),
    ),
)  # fmt: skip
_OUTSIDE = (
    Effect(
        "outside:inactivation_after_stretch", "attachment lost per stretch, 1/L0", _ALL, 2.0, 20.0,
        _between(decay_s=(1.0, 2.0)), _on_input("attachment", _inactivated),
    ),
    Effect(
        "outside:movement_switches_off", "rise of koff per speed, s/L0", _COMPLIANT, 1.0, 60.0,
        _between(decay_s=(0.03, 0.08)), _on_input("switch_off", _switched_off),
    ),
    Effect(
        "outside:calcium_after_movement", "calcium lost per stretch, 1/L0", _ALL, 3.0, 30.0,
        _between(decay_s=(0.2, 0.8)), _on_input("calcium", _buffered),
    ),
    Effect(
        "outside:series_creep", "creep per force, power strokes", _COMPLIANT, 6.0, 15.0, _between(tau_s=(0.4, 2.0)),
        _set(At.CREEP, tau_s=At.CREEP_TIME),
    ),
    Effect("outside:damage_by_stretch", "heads lost per stretch, 1/L0", _ALL, 0.5, 8.0, _between(), _damaged),
)  # fmt: skip

EFFECTS: Mapping[str, Effect] = MappingProxyType({row.label: row for row in (*_ROWS, *_OUTSIDE)})
"""All effects by label."""
OUTSIDE: tuple[str, ...] = tuple(row.label for row in _OUTSIDE)
"""Effects that no mechanism of the tool describes."""
