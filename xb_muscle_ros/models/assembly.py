"""From blocks to one set of equations: who asks whom, and in which order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from xb_muscle_ros.distribution.base import Representation, Ways
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.mechanisms import Chain, Expr, Extra, Moments, Quantities, Unit, ops
from xb_muscle_ros.models.composition import OUTPUTS, Composition, Equations, other_states


def equations(model: Composition, smooth: bool) -> Equations:
    """Write a composition out; `smooth` picks the released sets' smooth functions.

    Raises:
        AttributeError: a block asks for a quantity that no block provides; the message names both.
    """
    import sympy

    from xb_muscle_ros.models.factoring import replaced

    symbols = model.symbols()
    shift = sympy.Symbol("shift", real=True)
    fixed = Moments(symbols["q0"], symbols["q1"], symbols["q2"])
    moved = _moved(fixed, shift)
    values = {**symbols, "q0": moved.m0, "q1": moved.m1, "q2": moved.m2}
    parts = rates(model, Quantities(values, "composition", symbols["smoothing"] if smooth else None))
    # In the frame fixed at the start of the step a head's strain is x - shift, whatever the velocity.
    in_fixed = _moved(parts.kinetics, -shift)
    others = [parts.others[s.name] for s in model.states[3:]]
    derivatives = [*in_fixed, *others, parts.own_velocity, symbols["velocity"]]
    at_start = {shift: sympy.Integer(0)}
    return Equations(
        states=model.states,
        parameters=model.parameters,
        symbols=symbols,
        shift=shift,
        derivatives=derivatives,
        arrival=[*moved, *(symbols[s.name] for s in model.states[3:])],
        rest=[0, 0, 0, *rest_of_states(model, symbols)],
        outputs=[replaced(sympy.sympify(e), at_start) for e in parts.outputs],
        # The smooth form never divides by less than ln 2 / K heads.
        shares=() if smooth else ("q0", "q1", "q2"),
    )


def evaluated(model: Composition, values: Mapping[str, float]) -> dict[str, float]:
    """See `Model.evaluated`."""
    parts = rates(model, Quantities(values, "composition", None))
    of_states = {**dict(zip(("q0", "q1", "q2"), parts.kinetics, strict=True)), **parts.others}
    found = {f"rate of {name}": rate for name, rate in of_states.items()} | {"velocity": parts.own_velocity}
    return found | dict(zip(OUTPUTS, parts.outputs, strict=True))


def rest_of_states(model: Composition, symbols: Mapping[str, Any]) -> list[Expr]:
    """Values of the states beside the model's own moments in a fibre at rest without calcium."""
    q = Quantities(symbols, "composition", None)
    found: dict[str, Expr] = {"q0": 0, "q1": 0, "q2": 0}
    for block in model.blocks:
        found.update(block.rest(q.for_block(block.name)))
    own = [found[s.name] for block in model.blocks for s in block.states]
    return [*own, *(found[name] for _, name in other_states(model))]


def _moved(m: Moments, shift: Expr) -> Moments:
    """Moments about a point that lies `shift` lower: every strain has grown by `shift`."""
    return Moments(m.m0, m.m1 + shift * m.m0, m.m2 + 2 * shift * m.m1 + shift**2 * m.m0)


class Parts(NamedTuple):
    """What `rates` puts together.

    Attributes:
        kinetics: moments of the heads per second that come and go, at constant strain.
        others: rates of change of the blocks' own states, by name.
        ways: how heads come and go, in terms of strain.
        own_velocity: at which the model's own heads are carried along, power strokes/s.
        outputs: values of `OUTPUTS`.
    """

    kinetics: Moments
    others: Mapping[str, Expr]
    ways: Ways
    own_velocity: Expr
    outputs: list[Expr]


def rates(model: Composition, q: Quantities) -> Parts:
    """Put the blocks together, from moments and states to rates of change and velocity.

    The order is fixed by who needs what: force and sites before heads, heads before fluxes, fluxes before velocity.
    """
    q = q.for_block("composition", recruitment=0)
    q = q.for_block("composition", sarcomere_change=_sarcomere_change(model, q))
    own = _heads(model, model.representation, _modified(model, q))
    # What mechanisms changed for the model's blocks they do not see themselves.
    shown = {name: getattr(own.q, name) for name in ("force_xb", "available_sites", "ready_heads", "forcibly_detached")}
    q = q.for_block("composition", **shown)
    others = dict(own.others)
    chain: Chain | None = None
    if model.in_series is None:
        unit = _shared(model, own.unit, q)
    else:
        mine = q.for_block(model.in_series.name)
        values = {name: getattr(q, row.name) for row, name in other_states(model)}
        other = _heads(model, Gaussian(), _modified(model, q.for_block("composition", **values)))
        apart = model.in_series.apart(mine) / q.gamma
        chain = model.in_series.chain(
            mine, _shared(model, own.unit, _longer(q, apart)), _shared(model, other.unit, _longer(q, -apart))
        )
        unit = Unit(chain.force, chain.force_rate, chain.stiffness)
    for extra in model.extras:
        unit = _with_inner(unit, extra, q.for_block(extra.name))
    q = q.for_block(
        model.series.name, force_xb=unit.force, kinetic_force_rate=unit.force_rate, stiffness_xb=unit.stiffness
    )
    velocity = model.series.ce_velocity(q)
    q = q.for_block("composition", ce_velocity=velocity)
    own_velocity = velocity if chain is None else chain.own_velocity(velocity)
    if chain is not None:
        others.update(chain.derivatives(velocity))
        others.update(_carried(model, other, chain.other_velocity(velocity), values))
    others.update(model.series.derivatives(q.for_block(model.series.name)))
    for extra in model.extras:
        others.update(extra.derivatives(q.for_block(extra.name)))
    return Parts(own.kinetics, others, own.ways, own_velocity, _outputs(model, q))


def _shared(model: Composition, unit: Unit, q: Quantities) -> Unit:
    """What of the heads' force is borne at a length: by the product rule the share's slope is a stiffness too."""
    for extra in (extra for extra in model.extras if extra.limits_force):
        share, slope = extra.force_share(q.for_block(extra.name))
        stiffness = share * unit.stiffness + slope * unit.force / q.gamma
        # At the very end of a falling limb, with a thousandth of the force left, the share falls faster than heads are
        # stiff, and a soft enough spring would have them give way without end: there they count as not stiff.
        unit = Unit(share * unit.force, share * unit.force_rate, ops.positive(stiffness))
    return unit


def _longer(q: Quantities, by: Expr) -> Quantities:
    """The same at another length of the half-sarcomeres, L0."""
    return q.for_block("composition", sarcomere_change=q.sarcomere_change + by)


def _with_inner(unit: Unit, extra: Extra, q: Quantities) -> Unit:
    rate, stiffness = extra.inner_kinetics(q)
    return Unit(unit.force + extra.inner_force(q), unit.force_rate + rate, unit.stiffness + stiffness)


class _Heads(NamedTuple):
    """One half-sarcomere's heads: see `Parts` and `Unit`."""

    q: Quantities
    kinetics: Moments
    ways: Ways
    others: Mapping[str, Expr]
    unit: Unit


def _modified(model: Composition, q: Quantities) -> Quantities:
    """Quantities as the blocks of the families see them: parameters and inputs changed by the extra mechanisms."""
    for extra in model.extras:
        q = q.for_block("composition", **extra.modified(q.for_block(extra.name)))
    return q


def _sarcomere_change(model: Composition, q: Quantities) -> Expr:
    """Length change of the half-sarcomeres, L0: the fibre's without that of the series element.

    Of a chain of two, the force of the model's own heads counts.
    """
    if not model.series.follows_force:
        return q.length_change - model.series.extension(q.for_block(model.series.name)) / q.gamma
    force = _borne(model, q, _moments(q)) + sum(extra.inner_force(q.for_block(extra.name)) for extra in model.extras)
    extension = model.series.extension(q.for_block(model.series.name, force_xb=force))
    return q.length_change - extension / q.gamma


def _borne(model: Composition, q: Quantities, m: Moments) -> Expr:
    """What heads bear, power-stroke units; rates may stand for heads."""
    return m.m0 + m.m1 + sum(extra.head_force(q.for_block(extra.name), m) for extra in model.extras)


def _moments(q: Quantities) -> Moments:
    return Moments(q.q0, q.q1, q.q2)


def _heads(model: Composition, representation: Representation, q: Quantities) -> _Heads:
    """Kinetics of one half-sarcomere, from its moments and states."""
    thin, thick, detach = model.thin_filament, model.thick_filament, model.detachment

    q = q.for_block(detach.name, force_xb=_borne(model, q, _moments(q)))
    q = q.for_block(thin.name, forcibly_detached=detach.forcibly_detached(q))
    sites = thin.available_sites(q)
    for extra in model.extras:
        sites = sites * extra.overlap(q.for_block(extra.name))
    q = q.for_block(thick.name, available_sites=sites)
    q = q.for_block(model.attachment.name, ready_heads=thick.ready_heads(q))
    of_detachment = q.for_block(detach.name)
    further = tuple(rate for extra in model.extras for rate in extra.detachment(q.for_block(extra.name)))
    ways = Ways(
        attach=model.attachment.spread(q),
        detach=(*detach.rates(of_detachment), *further),
        tear=detach.forcible_rates(of_detachment),
        reattach=detach.reattachment(of_detachment),
    )
    kinetics, torn, back = representation.fluxes(q, ways)
    others: dict[str, Expr] = {}
    others.update(detach.derivatives(q.for_block(detach.name, torn_off=torn, reattached=back)))
    others.update(thin.derivatives(q.for_block(thin.name)))
    # Heads between attached and torn off stay out of the thick filament's balance: dQ0 + dR.
    net = kinetics.m0 + torn - back
    others.update(thick.derivatives(q.for_block(thick.name, attachment_rate_net=net)))
    # Strain grows by one power stroke with every power stroke of movement: Q1 by Q0, Q2 by 2 Q1.
    stiffness = _borne(model, q, Moments(0, q.q0, 2 * q.q1))
    if stiffness != q.q0:
        # Heads whose force bends lose their stiffness where they are compressed far: it does not go below zero.
        stiffness = ops.positive(stiffness)
    unit = Unit(q.force_xb, _borne(model, q, kinetics), stiffness)
    return _Heads(q, kinetics, ways, others, unit)


def _carried(model: Composition, heads: _Heads, velocity: Expr, values: Mapping[str, Expr]) -> dict[str, Expr]:
    """Rates of the other half-sarcomere's states: its moments move along with it, the rest is its own."""
    rates_of = {
        **heads.others,
        "q0": heads.kinetics.m0,
        "q1": heads.kinetics.m1 + velocity * values["q0"],
        "q2": heads.kinetics.m2 + 2 * velocity * values["q1"],
    }
    return {row.name: rates_of[name] for row, name in other_states(model)}


def _outputs(model: Composition, q: Quantities) -> list[Expr]:
    """Expressions of `OUTPUTS`."""
    extension = model.series.extension(q.for_block(model.series.name))
    force_pe = model.parallel.force(q.for_block(model.parallel.name))
    force_pe = force_pe + sum(extra.force(q.for_block(extra.name)) for extra in model.extras)
    force_ce = q.Fscale * model.series.force(q.for_block(model.series.name))
    return [
        force_ce + force_pe,
        force_ce,
        force_pe,
        q.length_change - extension / q.gamma,
        q.ce_velocity / q.gamma,
        q.q0,
        q.q1,
        q.q2,
        q.available_sites,
        q.ready_heads,
        q.forcibly_detached,
    ]
