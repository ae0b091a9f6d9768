"""What keeps a block from being used, told in one line before anything is computed."""

from __future__ import annotations

import keyword
import math
import random
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from xb_muscle_ros.distribution.grid import BINS, RANGE, REGRID
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.mechanisms import Entry, Extra, Family, Needs, Parameter, Quantities, State
from xb_muscle_ros.mechanisms.discovery import Block, is_outside, place
from xb_muscle_ros.models.composition import COMMON, Model

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_MODEL_VERSION = re.compile(r"_v\d+$")
# What generated code counts with and calls, and what every model has: an own parameter of that name would be mistaken.
_TAKEN = re.compile(
    r"[tdmf]\d+|f0_\d+|[aeky]\d*(_\d+)+|n_\d+|q[012]|kin[012]|s|p|h|z|c|i|x|y|t|out|work|error|share|per_h|diagonal|shift|"
    r"slack|room|table|math|np|max|abs|float|rates|rhs|attempt|slope|outputs|rest|violation|prepare|regrid|factors|spreads|"
    r"others|couplings|decay|logistic|softplus|unit_step|positive_part|hyperbolic_tangent|tangent_sinh|tangent_cosh|"
    r"deviation|limited|limited_slope|smooth_series_extension|length_change|velocity|calcium|torn_off|reattached|"
    r"grid_shift|force_xb|sarcomere_change|recruitment|available_sites|ready_heads|forcibly_detached|ce_velocity|"
    r"attachment_rate_net|kinetic_force_rate|stiffness_xb|positive|divisor|variance|limit|smooth|for_block|EMPTY|"
    r"reference_length_m|f0_n|.*_f0|.*_l0|.*_l0_per_s"
)
# Numbers agree so far where two models are the same.
_EXACT = 1e-9
_STATES = 6
# For slopes by central differences.
_STEP_S = 1e-6
_STEP_L0 = 1e-6


def refuse_incomplete(blocks: Sequence[Block]) -> None:
    """Refuse the first block that lacks something, or is in the way of another one.

    Raises:
        UserError: names block, file, what is amiss and the remedy.
    """
    rows: dict[str, tuple[Parameter | State, str]] = {row.name: (row, "every model") for row in COMMON}
    rows |= {row.name: (row, "a strain grid") for row in (BINS, RANGE, REGRID)}
    names: dict[tuple[Family | None, str], str] = {}
    for block in blocks:
        where = place(block)
        _refuse_first(where, _lacking(block))
        added = isinstance(block.entry, Entry)
        named = (None, block.entry.name or block.name) if block.entry else (block.family, block.name)
        for key in {named, (block.family, block.name)}:
            if key in names:
                raise UserError(f"{where}: the name '{key[1]}' is that of {names[key]}; choose another one")
            names[key] = where
        own: list[Parameter | State] = [*block.parameters, *block.states]
        for row in own:
            known, owner = rows.setdefault(row.name, (row, where))
            own_state = added and block.family is Family.EXTRA and isinstance(row, State)
            if known != row or (own_state and owner != where):
                kind = "state" if isinstance(row, State) else "parameter"
                raise UserError(f"{where}: {kind} '{row.name}' is that of {owner} already; give it another name")
    table = {name: row for name, (row, _) in rows.items() if isinstance(row, Parameter)}
    for block in blocks:
        if block.entry is not None:
            _refuse_first(place(block), _amiss(block, block.entry, table))


def _refuse_first(where: str, faults: Iterable[str]) -> None:
    for fault in faults:
        raise UserError(f"{where}: {fault}")


def _lacking(block: Block) -> Iterator[str]:
    """What a block has not, or has in a wrong form."""
    if not isinstance(getattr(block, "family", None), Family):
        yield "it belongs to no family; derive its class from Extra, or from one of the families of a model's blocks"
    name = vars(block).get("name")
    if not isinstance(name, str) or not _NAME.fullmatch(name) or _MODEL_VERSION.search(name):
        yield f"its name is {name!r}; give the class a name of small letters, digits and underscores"
    missing = sorted(getattr(block, "__abstractmethods__", ()))
    if missing:
        yield f"hook '{missing[0]}' of its family is missing; define it (docs/mechanisms.md says what it returns)"
    geometry = issubclass(block, Extra) and block.geometry
    if geometry and block.entry is not None:
        yield "it says geometry = True and has an entry; what no diagnosis looks for has none: leave one of them out"
    if block.family is Family.EXTRA and block.entry is None and not geometry:
        yield "it has no entry; add entry = Entry(family=..., title=..., meaning=..., effect=..., size=..., starts=...)"
    if issubclass(block, Extra) and not isinstance(block.needs, Needs):
        yield f"needs is {block.needs!r}; allowed are {', '.join(str(n) for n in Needs)}"
    hints = {
        Parameter: "name, unit, meaning, lower, upper, default, source",
        State: "name, unit, meaning, lower, upper",
    }
    for kind, rows in ((Parameter, block.parameters), (State, block.states)):
        for row in rows if isinstance(rows, tuple) else [rows]:
            if not isinstance(row, kind):
                yield f"{row!r} is no {kind.__name__}; give a tuple of {kind.__name__}({hints[kind]})"
            else:
                yield from _of_row(row)


def _of_row(row: Parameter | State) -> Iterator[str]:
    kind = type(row).__name__.lower()
    if not row.name.isidentifier() or keyword.iskeyword(row.name):
        yield f"{kind} name {row.name!r} is no name; letters, digits and underscores are allowed"
    if _TAKEN.fullmatch(row.name):
        yield f"{kind} '{row.name}' has a name that every model uses for something else; give it another name"
    for field in ("unit", "meaning", "source"):
        if not str(getattr(row, field, "there")).strip():
            yield f"{kind} '{row.name}' has no {field}; say it ('1' is the unit of a pure number)"
    if not (math.isfinite(row.lower) and math.isfinite(row.upper) and row.lower < row.upper):
        yield f"{kind} '{row.name}' is bounded by {row.lower:g} and {row.upper:g}; give a range"
    default = getattr(row, "default", None)
    if default is not None and not row.lower <= default <= row.upper:
        yield f"parameter '{row.name}' has the default {default:g}; allowed is {row.lower:g} to {row.upper:g}"


def _amiss(block: Block, entry: Entry, table: Mapping[str, Parameter]) -> Iterator[str]:
    """What a fit or a diagnosis could not do with an entry."""
    own = {row.name: row for row in block.parameters}
    for field, text in (("family", entry.family), ("title", entry.title), ("meaning", entry.meaning)):
        if not text.strip():
            yield f"its entry has no {field}; reports need it"
    if not _NAME.fullmatch(entry.family):
        yield f"family {entry.family!r} of its entry is no name of small letters and underscores"
    for name in (*entry.parameters, *entry.off):
        if name not in own:
            yield f"its entry names parameter '{name}', which it does not have; its parameters are {', '.join(own)}"
    if entry.effect is not None and block.family is Family.EXTRA:
        row = own[entry.effect]
        if not row.lower <= 0.0 < row.upper or row.default != 0.0:
            yield f"its effect '{row.name}' must have 0 as its default and within its bounds: there it is absent"
    if block.family is not Family.EXTRA and is_outside(block) and not entry.frame:
        yield "it takes another block's place, so that a diagnosis needs a model of its own for it; say frame=True"
    if entry.effect is None and not entry.off and not entry.frame:
        yield "nothing says where it is absent; name its effect, or say frame=True where no value leaves it absent"
    if block.family is Family.EXTRA and entry.effect is None:
        yield "its entry names no effect; name the parameter that is 0 where it is absent"
    sizes = {"size": entry.size, "reach": entry.reach, **{f"shape of '{n}'": sd for n, sd in entry.shape.items()}}
    for what, size in sizes.items():
        if not isinstance(size, (int, float)):
            yield f"{what} of its entry is {size!r}; give a number"
        elif not (math.isfinite(size) and size > 0.0):
            yield f"{what} of its entry is {size:g}; give a positive number"
    try:
        starts = entry.starting_values({name: row.default or 1.0 for name, row in table.items()})
    except Exception as error:
        yield f"its starts cannot be computed ({type(error).__name__}: {error}); mend start_from"
        return
    if not isinstance(starts, (tuple, list)) or not all(isinstance(start, Mapping) for start in starts):
        yield f"starts of its entry is {starts!r}; give a tuple of mappings, ({{...}},) for a single one"
        return
    if not starts or any(start.keys() != starts[0].keys() for start in starts):
        yield "its entry has no starts, or starts that differ in their parameters; give each the same"
    if entry.effect is not None and any(not start.get(entry.effect) for start in starts):
        yield f"a start of its entry has no '{entry.effect}', or 0; give the effect to begin a fit with"
    for name, value in [(n, v) for values in (*starts, entry.off) for n, v in values.items()]:
        if name not in table:
            yield f"its entry gives a value for '{name}', which is no parameter; correct the name"
        elif not isinstance(value, (int, float)):
            yield f"its entry gives {name} = {value!r}; give a number"
        elif not table[name].lower <= value <= table[name].upper:
            row = table[name]
            yield f"its entry gives {name} = {value:g}; allowed is {row.lower:g} to {row.upper:g}"


def refuse_wrong(block: Block, models: Sequence[tuple[Model, Model]]) -> None:
    """Refuse a mechanism whose formulas fail, that is not absent where it should be, or that does nothing.

    Args:
        block: of the mechanism.
        models: one without and one with it, for each kind of model that it goes with.

    Raises:
        UserError: names mechanism, file, what is amiss and the remedy.
    """
    where, entry = place(block), block.entry
    if not models:
        raise UserError(f"{where}: it goes with no model; see 'needs' and the families in docs/mechanisms.md")
    acts = False
    for without, model in models:
        usual = {row.name: min(max(1.0, row.lower), row.upper) for row in (*without.parameters, *model.parameters)}
        usual |= {row.name: row.default for row in model.parameters if row.default is not None}
        started = usual | (dict(entry.starting_values(usual)[0]) if entry else {})
        for state in _some_states(without, model):
            base, on = (_evaluated(where, m, started | state) for m in (without, model))
            acts = acts or any(on[name] != value for name, value in base.items() if name in on)
            _refuse_untrue(where, block, started | state)
            if entry is None or entry.frame or block.family is not Family.EXTRA:
                continue
            # Its own states stay at rest where they do not move; others may be anywhere.
            rest = dict(block().rest(Quantities(started, block.name, None)))
            there = started | entry.absent | state
            rates = _evaluated(where, model, there | rest)
            off = _evaluated(where, model, there | {n: v for n, v in rest.items() if rates[f"rate of {n}"] == 0.0})
            for name, value in base.items():
                if not math.isclose(off[name], value, rel_tol=_EXACT, abs_tol=_EXACT):
                    raise UserError(
                        f"{where}: with {_listed(entry.absent)} it is not absent: {name.replace('_', ' ')} is "
                        f"{off[name]:.6g}, without it {value:.6g}; make it do nothing there"
                    )
    if not acts:
        raise UserError(f"{where}: it changes nothing at its start values; use its effect in one of the hooks")


def _refuse_untrue(where: str, block: Block, values: Mapping[str, float]) -> None:
    """Refuse slopes that are not those of what they belong to: steps would go wrong without a word."""
    if not issubclass(block, Extra):
        return
    extra = block()
    _refuse_untrue_share(where, extra, values)
    hooks = ("inner_force", "inner_kinetics")
    if all(getattr(block, hook) is getattr(Extra, hook) for hook in hooks):
        return

    def of(hook: str, at: Mapping[str, float]) -> Any:
        return getattr(extra, hook)(Quantities(at, block.name, None))

    values = {**values, "sarcomere_change": values["length_change"]}
    for velocity in (0.0, 5.0):
        at = {**values, "ce_velocity": velocity}
        try:
            rates, (rate, stiffness) = dict(of("derivatives", at)), of("inner_kinetics", values)
            rates["sarcomere_change"] = velocity / values["gamma"]
            ahead, behind = ({**at, **{n: at[n] + h * r for n, r in rates.items()}} for h in (_STEP_S, -_STEP_S))
            found = (of("inner_force", ahead) - of("inner_force", behind)) / (2.0 * _STEP_S)
        except AttributeError:
            # It asks for what other blocks make of the states.
            return
        told = rate + stiffness * velocity
        if not math.isclose(found, told, rel_tol=1e-5, abs_tol=1e-6):
            raise UserError(
                f"{where}: at a ce_velocity of {velocity:g} power strokes/s its states change inner_force by "
                f"{found:.6g} 1/s, by inner_kinetics it is {told:.6g}; return the rate at constant length and the "
                "change per power stroke, of a state that follows ce_velocity"
            )


def _refuse_untrue_share(where: str, extra: Extra, values: Mapping[str, float]) -> None:
    """Refuse a share of force whose slope is another one's, or that is no share."""
    if not extra.limits_force:
        return
    # A change with anything else would have no place in the force balance.
    known = {row.name: values[row.name] for row in (*extra.parameters, *COMMON)}
    for length in (-0.4, -0.2, -0.05, 0.03, 0.15, 0.35, 0.5):
        try:
            (behind, _), (share, told), (ahead, _) = (
                extra.force_share(Quantities({**known, "sarcomere_change": length + by}, extra.name, None))
                for by in (-_STEP_L0, 0.0, _STEP_L0)
            )
        except AttributeError as error:
            raise UserError(f"{where}: {error}; force_share may ask for sarcomere_change and parameters") from error
        found = (ahead - behind) / (2.0 * _STEP_L0)
        if not -_EXACT <= share <= 1.0 + _EXACT:
            raise UserError(f"{where}: at a sarcomere_change of {length:g} L0 force_share is {share:.6g}; give 0 to 1")
        if not math.isclose(found, told, rel_tol=1e-4, abs_tol=1e-4):
            raise UserError(
                f"{where}: at a sarcomere_change of {length:g} L0 force_share changes by {found:.6g} per L0, by its "
                f"second value it is {told:.6g}; return the slope of the first"
            )


def _listed(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in values.items())


def _some_states(*models: Model) -> Iterator[dict[str, float]]:
    """States and inputs that a fibre may have, always the same."""
    numbers = random.Random(1)
    for _ in range(_STATES):
        heads, mean, sd = numbers.uniform(0.05, 0.4), numbers.uniform(-0.4, 0.6), numbers.uniform(0.2, 0.8)
        state = {
            row.name: numbers.uniform(max(row.lower, 0.0), min(row.upper, 0.25)) for m in models for row in m.states
        }
        yield state | {
            "q0": heads, "q1": heads * mean, "q2": heads * (sd**2 + mean**2), "n_on": numbers.uniform(heads, 1.0),
            "length_change": numbers.uniform(-0.03, 0.06), "velocity": numbers.uniform(-0.5, 0.5),
            "calcium": 10.0 ** numbers.uniform(-1.0, 1.5),
        }  # fmt: skip


def _evaluated(where: str, model: Model, values: Mapping[str, float]) -> dict[str, float]:
    try:
        found = model.evaluated(values)
    except AttributeError as error:
        raise UserError(f"{where}: {error}") from error
    except Exception as error:
        raise UserError(
            f"{where}: its formulas fail ({type(error).__name__}: {error}); see docs/mechanisms.md"
        ) from error
    for state in model.states:
        if f"rate of {state.name}" not in found:
            raise UserError(f"{where}: state '{state.name}' has no rate; return it from the hook 'derivatives'")
    for name, value in found.items():
        if not isinstance(value, (int, float)) or not math.isfinite(value):
            raise UserError(f"{where}: {name.replace('_', ' ')} is {value!r}; its formulas must give finite numbers")
    return found
