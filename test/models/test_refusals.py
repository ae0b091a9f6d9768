"""A block that is incomplete, in another one's way or wrong is refused in one line that says what to do."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import pytest

from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.mechanisms import Entry, Extra, Needs, Parameter, State, ThinFilament, Values
from xb_muscle_ros.models import checking, compiled, registry
from xb_muscle_ros.models.registry import BLOCKS, MODELS, SWAPS

DRAG = Parameter("own_drag", "F0 s/L0", "drag", 0.0, 10.0, 0.0, "this test")
ENTRY = Entry("own_family", "own drag", "a drag", "own_drag", 0.02, starts=({"own_drag": 0.01},))


def made(of: type = Extra, **members: Any) -> Any:
    """A mechanism, whole but for what is given; None takes a member away."""

    def force(self: Any, q: Any) -> Any:
        return q.own_drag * q.velocity

    own = {"name": "own", "parameters": (DRAG,), "entry": ENTRY, "force": force, "__module__": __name__} | members
    return type("Own", (of,), {name: value for name, value in own.items() if value is not None})


def refused(block: Any) -> str:
    def check() -> None:
        checking.refuse_incomplete((*BLOCKS, block))
        tried(block)

    with pytest.raises(UserError) as error:
        check()
    line = str(error.value)
    assert line.startswith(f"mechanism '{vars(block).get('name', 'Own')}' (")
    assert "test_refusals.py): " in line
    assert "\n" not in line
    return line


def tried(block: Any, *models: str) -> None:
    pairs = []
    for model in models or ("3state_coop", "hill_se"):
        other = replace(MODELS[model], extras=(block,))
        if block.needs in other.has:
            pairs.append((MODELS[model].composed(model, Gaussian), other.composed(model, Gaussian)))
    checking.refuse_wrong(block, pairs)


def test_a_whole_one_is_taken() -> None:
    checking.refuse_incomplete((*BLOCKS, made()))
    tried(made())


def row(**changes: Any) -> Parameter:
    return DRAG._replace(**changes)


def entry(**changes: Any) -> Entry:
    return replace(ENTRY, **changes)


INCOMPLETE: Mapping[str, tuple[dict[str, Any], str]] = {
    "no name": ({"name": None}, "its name is None; give the class a name of small letters"),
    "a name with a plus": ({"name": "a+b"}, "its name is 'a+b'; give"),
    "a name like a version": ({"name": "own_v2"}, "its name is 'own_v2'; give"),
    "no entry": ({"entry": None}, "it has no entry; add entry = Entry"),
    "no family": ({"entry": entry(family=" ")}, "its entry has no family"),
    "a family in words": ({"entry": entry(family="My family")}, "family 'My family' of its entry is no name"),
    "no title": ({"entry": entry(title="")}, "its entry has no title; reports need it"),
    "no meaning": ({"entry": entry(meaning="")}, "its entry has no meaning"),
    "another one's name": ({"name": "viscous_drag"}, "the name 'viscous_drag' is that of mechanism 'viscous_drag'"),
    "a swapped block's name": ({"name": "series_compliance"}, "the name 'series_compliance' is that of"),
    "needs in words": ({"needs": "heads"}, "needs is 'heads'; allowed are Needs.NOTHING"),
    "no row": ({"parameters": ("own_drag",)}, "'own_drag' is no Parameter; give a tuple of Parameter(name, unit"),
    "no tuple": ({"parameters": "drag"}, "'drag' is no Parameter"),
    "no unit": ({"parameters": (row(unit=""),)}, "parameter 'own_drag' has no unit; say it"),
    "no source": ({"parameters": (row(source=""),)}, "parameter 'own_drag' has no source"),
    "no range": ({"parameters": (row(upper=0.0),)}, "parameter 'own_drag' is bounded by 0 and 0"),
    "default outside": ({"parameters": (row(default=11.0),)}, "default 11; allowed is 0 to 10"),
    "no identifier": ({"parameters": (row(name="own drag"),)}, "parameter name 'own drag' is no name"),
    "a name of the code": ({"parameters": (row(name="h"),)}, "'h' has a name that every model uses"),
    "a name of a quantity": ({"parameters": (row(name="velocity"),)}, "'velocity' has a name that every model"),
    "a clash": ({"parameters": (DRAG, row(name="drag"))}, "parameter 'drag' is that of mechanism 'viscous_drag'"),
    "a clash with common ones": ({"parameters": (DRAG, row(name="gamma"))}, "'gamma' is that of every model"),
    "a clash of states": (
        {"states": (State("titin_stretch", "L0", "stretch since titin took hold of actin", -100.0, 100.0),)},
        "state 'titin_stretch' is that of mechanism 'active_titin'",
    ),
    "an effect of none": ({"entry": entry(effect="drag")}, "names parameter 'drag', which it does not have"),
    "a shape of none": ({"entry": entry(shape={"titin_hill": 1.0})}, "names parameter 'titin_hill'"),
    "size as text": ({"entry": entry(size="30")}, "size of its entry is '30'; give a number"),
    "a start without its tuple": ({"entry": entry(starts={"own_drag": 0.01})}, "give a tuple of mappings, ({...},)"),
    "a start as text": ({"entry": entry(starts=({"own_drag": "1"},))}, "its entry gives own_drag = '1'; give a number"),
    "no effect": ({"entry": entry(effect=None, frame=True)}, "its entry names no effect"),
    "no null": ({"entry": entry(effect=None)}, "nothing says where it is absent"),
    "not absent by default": ({"parameters": (row(default=1.0),)}, "must have 0 as its default"),
    "no size": ({"entry": entry(size=0.0)}, "size of its entry is 0; give a positive number"),
    "no starts": ({"entry": entry(starts=())}, "has no starts"),
    "starts that differ": ({"entry": entry(starts=(ENTRY.starts[0], {}))}, "starts that differ in their parameters"),
    "a start of nothing": ({"entry": entry(starts=({"own_drag": 0.0},))}, "a start of its entry has no 'own_drag'"),
    "a start outside": ({"entry": entry(starts=({"own_drag": 20.0},))}, "own_drag = 20; allowed is 0 to 10"),
    "a start of no parameter": (
        {"entry": entry(starts=({"own_drag": 0.1, "own_dreg": 1.0},))}, "'own_dreg', which is no parameter",
    ),
    "starts that fail": ({"entry": entry(start_from=lambda base: base["?"])}, "its starts cannot be computed"),
}  # fmt: skip


@pytest.mark.parametrize("what", INCOMPLETE)
def test_what_is_incomplete_or_in_the_way_is_refused(what: str) -> None:
    members, told = INCOMPLETE[what]
    assert told in refused(made(**members))


def test_a_hook_that_is_missing_is_named() -> None:
    assert "hook 'available_sites' of its family is missing" in refused(made(ThinFilament))


def test_a_block_in_another_one_s_place_is_a_frame() -> None:
    members = {
        "available_sites": lambda self, q: 1.0,
        "entry": entry(effect=None, starts=({"own_drag": 1.0},), shape={"own_drag": 1.0}, off={"own_drag": 0.0}),
    }
    assert "it takes another block's place" in refused(made(ThinFilament, **members))


def test_two_mechanisms_in_one_place_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    other = type("Other", (SWAPS["thin_filament_cooperativity"],), {"name": "other_cooperativity"})
    monkeypatch.setattr(registry, "SWAPS", {**SWAPS, "other_cooperativity": other})
    with pytest.raises(UserError, match="'thin_filament_cooperativity' and 'other_cooperativity' take the same place"):
        registry.row_of("2state+thin_filament_cooperativity+other_cooperativity")


def formula(value: Any) -> dict[str, Any]:
    return {"force": lambda self, q: value(q)}


MEMORY = State("own_memory", "L0", "memory", -1.0, 1.0)
WRONG: Mapping[str, tuple[dict[str, Any], str]] = {
    "an unknown quantity": (
        formula(lambda q: q.own_drag * q.velocty), "asks for 'velocty', which no block of this model provides; did you",
    ),
    "no null": (formula(lambda q: q.own_drag * q.velocity + 0.1), "with own_drag = 0 it is not absent: force f0 is"),
    "no effect": (formula(lambda q: 0), "it changes nothing at its start values"),
    "a state without a rate": ({"states": (MEMORY,)}, "state 'own_memory' has no rate; return it from the hook"),
    "an error": (formula(lambda q: {}["x"]), "its formulas fail (KeyError: 'x')"),
    "no number": (formula(lambda q: math.nan * q.own_drag), "force f0 is nan; its formulas must give finite numbers"),
}  # fmt: skip


STRETCH = State("own_stretch", "1", "stretch of a spring between the filaments, power strokes", -1e3, 1e3)


@pytest.mark.parametrize(
    ("kinetics", "told"),
    [
        (lambda self, q: (0, q.own_drag), None),
        (lambda self, q: (0, 2 * q.own_drag), "at a ce_velocity of 5 power strokes/s its states change inner_force by"),
        (lambda self, q: (q.own_drag, q.own_drag), "at a ce_velocity of 0 power strokes/s"),
    ],
)
def test_kinetics_of_an_inner_force_are_those_of_its_states(kinetics: Any, told: str | None) -> None:
    block = made(
        needs=Needs.HEADS,
        states=(STRETCH,),
        inner_force=lambda self, q: q.own_drag * q.own_stretch,
        inner_kinetics=kinetics,
        derivatives=lambda self, q: {"own_stretch": q.ce_velocity},
    )
    if told is None:
        tried(block)
    else:
        with pytest.raises(UserError, match=told):
            tried(block)


def test_an_inner_force_of_the_length_itself_is_refused() -> None:
    block = made(
        needs=Needs.HEADS,
        inner_force=lambda self, q: q.own_drag * q.length_change,
        inner_kinetics=lambda self, q: (0, q.own_drag / q.gamma),
    )
    with pytest.raises(UserError, match="its states change inner_force by 0 1/s"):
        tried(block)


def test_an_inner_force_of_the_half_sarcomeres_length_is_taken_if_its_stiffness_is_right() -> None:
    def block(factor: float) -> Any:
        return made(
            needs=Needs.SEPARATE_LENGTHS,
            force=None,
            inner_force=lambda self, q: q.own_drag * q.sarcomere_change,
            inner_kinetics=lambda self, q: (0, factor * q.own_drag / q.gamma),
        )

    tried(block(1.0), "3state_coop_slack", "hill_se")
    with pytest.raises(UserError, match="at a ce_velocity of 5 power strokes/s its states change inner_force"):
        tried(block(2.0), "3state_coop_slack", "hill_se")


@pytest.mark.parametrize(
    ("share", "told"),
    [
        (lambda self, q: (1 - q.own_drag * q.sarcomere_change**2, -2 * q.own_drag * q.sarcomere_change), None),
        (lambda self, q: (1 - q.own_drag * q.sarcomere_change**2, 0), "force_share changes by"),
        (lambda self, q: (1 + q.own_drag * q.sarcomere_change, q.own_drag), "force_share is 1.0003; give 0 to 1"),
        (lambda self, q: (1 - q.own_drag * q.q0, 0), "asks for 'q0'.*force_share may ask for sarcomere_change and"),
    ],
)
def test_a_share_of_force_is_one_and_its_slope_its_own(share: Any, told: str | None) -> None:
    block = made(needs=Needs.SEPARATE_LENGTHS, force=None, force_share=share)
    if told is None:
        tried(block, "3state_coop_slack", "hill_se")
    else:
        with pytest.raises(UserError, match=told):
            tried(block, "3state_coop_slack", "hill_se")


def test_geometry_has_no_entry_and_needs_none() -> None:
    members = {"geometry": True, "parameters": (DRAG._replace(default=0.1),)}
    block = made(entry=None, **members)
    checking.refuse_incomplete((*BLOCKS, block))
    tried(block)
    assert "it says geometry = True and has an entry" in refused(made(**members))


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_is_refused(what: str) -> None:
    members, told = WRONG[what]
    assert told in refused(made(**members))


def test_a_mechanism_without_a_model_is_refused() -> None:
    with pytest.raises(UserError, match="it goes with no model; see 'needs'"):
        tried(made(needs=Needs.HEADS), "hill_se")


def test_formulas_that_only_numbers_go_through_are_refused_where_code_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    block = made(**formula(lambda q: q.own_drag * (q.velocity if q.velocity > 0.0 else 0.0)))
    checking.refuse_incomplete((*BLOCKS, block))
    tried(block)
    model = replace(MODELS["3state_coop"], extras=(block,)).composed("own", Gaussian)
    with pytest.raises(UserError, match=r"no code can be made of mechanism 'own' .*TypeError.* no if and no math"):
        compiled._text(model, False)


class Held(Extra):
    """A spring between the heads and what they have forgotten, with a shape that must not matter at no effect."""

    name = "held"
    parameters = (DRAG, DRAG._replace(name="own_rate", default=1.0, upper=100.0, unit="1/s"))
    states = (MEMORY,)
    entry = replace(ENTRY, shape={"own_rate": 1.0}, starts=({"own_drag": 1.0, "own_rate": 9.0},))

    def force(self, q: Any) -> Any:
        """As any."""
        return q.own_drag * q.own_memory

    def derivatives(self, q: Any) -> Values:
        """As any."""
        return {"own_memory": q.velocity - q.own_rate * q.own_memory}


def test_a_mechanism_with_states_and_shapes_is_taken() -> None:
    checking.refuse_incomplete((*BLOCKS, Held))
    tried(Held)


@pytest.fixture(autouse=True)
def nothing_stays() -> Iterator[None]:
    """Blocks of a test are in no table."""
    yield
    assert not [block for block in BLOCKS if block.__module__ == __name__]
