"""Hill-type models: an activation and a force-velocity relation in place of cross-bridges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from xb_muscle_ros.mechanisms import (
    Activation,
    Contractile,
    Expr,
    Extra,
    ForceVelocity,
    Mechanism,
    Parallel,
    Quantities,
    Series,
    State,
    ops,
)
from xb_muscle_ros.models.composition import OUTPUTS, Equations, Model

# Least strength by which a force is divided, as a share of all heads' force: where a length has no active force a
# series element at rest still finds 0.01 % of it. With less, passive force would move it faster than steps resolve.
_LEAST = 1e-4


@dataclass(frozen=True)
class Hill(Model):
    """One block of each family. Nothing is distributed over strain: every method means the same.

    The integrated state is the series element's length, if there is one, and the contractile element's follows from the
    fibre's: force and both lengths fit each other by construction. In `Outputs` the activation stands as ``n_on``; the
    moments, ready and torn-off heads are 0.
    """

    name: str
    activation: Activation
    force_velocity: ForceVelocity
    series: Series
    parallel: Parallel
    extras: tuple[Extra, ...] = ()

    @property
    def blocks(self) -> tuple[Mechanism, ...]:
        """All blocks, in the order in which their states stand."""
        return (self.activation, self.force_velocity, self.series, self.parallel, *self.extras)

    @property
    def states(self) -> tuple[State, ...]:
        """States that are integrated, without the inputs."""
        further = (s for extra in self.extras for s in extra.states)
        return (*self.activation.states, *self.series.length_states, *further)

    def _written(self, values: Mapping[str, Expr]) -> tuple[dict[str, Expr], Expr, dict[str, Expr]]:
        """Rates of the states, velocity of the contractile element, and outputs by name, where they are not 0."""
        extension = sum(values[state.name] for state in self.series.length_states)
        sarcomere = values["length_change"] - extension / values["gamma"]
        plain = q = Quantities({**values, "sarcomere_change": sarcomere}, self.name, None)
        for extra in self.extras:
            q = q.for_block(self.name, **extra.modified(q.for_block(extra.name)))
        level = self.activation.level(q.for_block(self.activation.name))
        for extra in self.extras:
            level = level * extra.overlap(q.for_block(extra.name))
        element = self._element(q, plain, level)
        balance = self.series.balance(q.for_block(self.series.name), element)
        rates = {**self.activation.derivatives(q.for_block(self.activation.name)), **balance.derivatives}
        force_ce = q.Fscale * balance.force
        force_pe = self.parallel.force(q.for_block(self.parallel.name))
        for extra in self.extras:
            mine = plain.for_block(extra.name, available_sites=level, ce_velocity=balance.ce_velocity)
            force_pe = force_pe + extra.force(mine)
            rates.update(extra.derivatives(mine))
        shown = {
            "force_f0": force_ce + force_pe,
            "force_ce_f0": force_ce,
            "force_pe_f0": force_pe,
            "ce_length_change_l0": q.length_change - balance.extension / q.gamma,
            "ce_velocity_l0_per_s": balance.ce_velocity / q.gamma,
            "n_on": level,
        }
        return rates, balance.ce_velocity, shown

    def _element(self, q: Quantities, plain: Quantities, level: Expr) -> Contractile:
        """The relation, as strong as activation and length make it, and beside it what bears force within."""
        strength, inner = level, 0
        for extra in self.extras:
            strength = strength * extra.force_share(plain.for_block(extra.name))[0]
            inner = inner + extra.inner_force(plain.for_block(extra.name, available_sites=level))
        divisor = level
        if any(extra.limits_force for extra in self.extras):
            divisor = _LEAST + ops.positive(strength - _LEAST)
        relation = q.for_block(self.force_velocity.name)
        return Contractile(
            force_at=lambda velocity: strength * self.force_velocity.force(relation, velocity) + inner,
            velocity_at=lambda force: self.force_velocity.velocity(relation, (force - inner) / divisor),
        )

    def evaluated(self, values: Mapping[str, float]) -> dict[str, float]:
        rates, velocity, shown = self._written(values)
        return {**{f"rate of {name}": rate for name, rate in rates.items()}, "velocity": velocity, **shown}

    def equations(self, smooth: bool) -> Equations:
        """Write the model out; there is nothing to smooth."""
        import sympy

        symbols = self.symbols()
        rates, velocity, shown = self._written(symbols)
        rest: dict[str, Expr] = {}
        for block in self.blocks:
            rest.update(block.rest(Quantities(symbols, block.name, None)))
        return Equations(
            states=self.states,
            parameters=self.parameters,
            symbols=symbols,
            shift=sympy.Symbol("shift", real=True),
            derivatives=[*(rates[s.name] for s in self.states), velocity, symbols["velocity"]],
            arrival=[symbols[s.name] for s in self.states],
            rest=[rest.get(s.name, 0) for s in self.states],
            outputs=[shown.get(name, 0) for name in OUTPUTS],
        )

    def module_text(self, smooth: bool) -> str:
        """Every state is a symbol, whatever the method."""
        from xb_muscle_ros.models.codegen import flat_module

        return flat_module(self, smooth)
