"""Every mechanism beside the families: nothing where its effect is zero, and what it says where it is not."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from mechanism_effects import BESIDE, EFFECT

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.composition import Composition
from xb_muscle_ros.models.fibre_file import Fibre, fibre_from_parameters, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.parameters import complete
from xb_muscle_ros.models.registry import EXTRAS, SWAPS, compose, split_set, with_mechanisms

BASE = "3state_coop"
TIME = np.arange(501) * 1e-3
# Stretch, shortening back, stretch, hold: 3.83 % L0 at the paper's speed.
LENGTH = np.interp(TIME, [0.0, 0.05, 0.134, 0.218, 0.228, 0.312, 0.5], [0.0, 0.0, 0.0383, 0.0, 0.0, 0.0383, 0.0383])


def fibre_with(mechanism: str | None, method: str = "gaussian", base: str = BASE, **values: float) -> Fibre:
    given = load_fibre("18Dec2017a", base, method)
    name = with_mechanisms(base, mechanism) if mechanism else base
    wanted = {row.name for row in compose(name, method).parameters}
    start = {k: v for k, v in given.values.items() if k in wanted} | {"smoothing": 0.0} | values
    return replace(given, model=name, values=MappingProxyType(complete(start, name, "test", method)))


def force(fibre: Fibre, pca: float = 6.1, length: np.ndarray = LENGTH, time_s: np.ndarray = TIME) -> np.ndarray:
    muscle = Muscle(fibre)
    calcium = np.full(time_s.size, 10.0 ** (6.0 - pca))
    start = muscle.settle(float(length[0]), float(calcium[0]), None if fibre.method == "gaussian" else 10.0)
    return muscle.outputs_of(muscle.run(start, np.diff(time_s), length, calcium))["force_f0"]


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return force(fibre_with(None))


def test_every_mechanism_has_its_case_here() -> None:
    assert set(EFFECT) == set(EXTRAS)


@pytest.mark.slow
@pytest.mark.parametrize("mechanism", EXTRAS)
def test_absent_where_its_effect_is_zero_and_felt_where_it_is_not(mechanism: str, plain: np.ndarray) -> None:
    effect, base = EFFECT[mechanism], BESIDE.get(mechanism, BASE)
    if base != BASE:
        plain = force(fibre_with(None, base=base))
    if mechanism != "active_force_length":
        # No value makes every length an optimal one.
        nothing = force(fibre_with(mechanism, base=base, **{**effect, next(iter(effect)): 0.0}))
        # The other half-sarcomere's moments move with the tolerance of a step.
        np.testing.assert_allclose(nothing, plain, atol=2e-5 if mechanism == "half_sarcomere_spread" else 1e-12)
    felt = force(fibre_with(mechanism, base=base, **effect))
    assert np.max(np.abs(felt - plain)) > 1e-3


@pytest.mark.parametrize("mechanism", EXTRAS)
def test_states_stay_within_their_bounds_through_fast_movement(mechanism: str) -> None:
    """One that leaves them would raise; what comes out is finite at any calcium."""
    length = np.interp(TIME, [0.0, 0.05, 0.07, 0.2, 0.22, 0.5], [0.0, 0.0, 0.06, 0.06, -0.02, -0.02])
    for pca in (4.5, 6.3, 9.0):
        fibre = fibre_with(mechanism, base=BESIDE.get(mechanism, BASE), **EFFECT[mechanism])
        assert np.all(np.isfinite(force(fibre, pca, length)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "mechanism", ["nonlinear_crossbridge", "phosphate", "length_dependent_activation", "weakly_bound_heads"]
)
def test_does_the_same_to_the_distribution_as_to_its_moments(mechanism: str, plain: np.ndarray) -> None:
    """By the distribution, the effect is that of the Gaussian form to within what closing the moments costs."""
    method = "characteristics"
    moments = force(fibre_with(mechanism, **EFFECT[mechanism])) - plain
    bins = force(fibre_with(mechanism, method, **EFFECT[mechanism])) - force(fibre_with(None, method))
    assert np.sqrt(np.mean((bins - moments) ** 2)) < 0.05 * np.sqrt(np.mean(moments**2))


def test_half_sarcomeres_bear_one_force_and_share_the_movement() -> None:
    fibre = fibre_with("half_sarcomere_spread", hs_spread=0.15)
    muscle = Muscle(fibre)
    calcium = np.full(TIME.size, 10.0**-0.1)
    states = muscle.run(muscle.settle(0.0, float(calcium[0])), np.diff(TIME), LENGTH, calcium)
    column = {name: states[:, i] for i, name in enumerate(muscle.state_names)}
    tie = fibre.values["hs_stiffness"] * column["hs_difference"] / 2.0
    strong = 1.15 * (column["q0"] + column["q1"]) + tie
    weak = 0.85 * (column["other_q0"] + column["other_q1"]) - tie
    np.testing.assert_allclose(strong, weak, atol=1e-4)
    # The stronger one shortens at the cost of the weaker one, the more the longer they bear force.
    assert np.all(column["hs_difference"][60:] < 0.0)


def test_drag_is_proportional_to_velocity(plain: np.ndarray) -> None:
    velocity = np.concatenate([[0.0], np.diff(LENGTH) / np.diff(TIME)])
    np.testing.assert_allclose(force(fibre_with("viscous_drag", drag=0.02)) - plain, 0.02 * velocity, atol=1e-12)


def test_viscoelastic_arm_relaxes_exponentially(plain: np.ndarray) -> None:
    fibre = fibre_with("passive_viscoelasticity", pv_stiffness=1.0, pv_tau=0.05, pv_ratio=0.0)
    extra = force(fibre) - plain
    # Straight stretch at v from 0.05 s on: k v tau (1 - exp(-t/tau)).
    t, v = TIME[60:134] - 0.05, 0.0383 / 0.084
    np.testing.assert_allclose(extra[60:134], v * 0.05 * (1.0 - np.exp(-t / 0.05)), rtol=2e-3, atol=1e-6)
    decay = extra[400] / extra[350]
    assert decay == pytest.approx(np.exp(-1.0), rel=1e-3)


def test_weakly_bound_heads_reach_a_plateau_in_proportion_to_sites(plain: np.ndarray) -> None:
    fibre = fibre_with("weakly_bound_heads", weak_stiffness=40.0, weak_detachment=500.0)
    muscle = Muscle(fibre)
    calcium = np.full(TIME.size, 10.0**-0.1)
    states = muscle.run(muscle.settle(0.0, float(calcium[0])), np.diff(TIME), LENGTH, calcium)
    out = muscle.outputs_of(states)
    weak_f0 = states[:, muscle.state_names.index("weak_force")]
    at = 120
    expected = 40.0 * out["n_on"][at] * out["ce_velocity_l0_per_s"][at] / 500.0
    assert weak_f0[at] == pytest.approx(expected, rel=2e-2)
    # They bear what the others do not, and both pull on the series spring.
    strong_f0 = fibre.values["Fscale"] * (states[:, 0] + states[:, 1])
    np.testing.assert_allclose(out["force_ce_f0"], strong_f0 + weak_f0, atol=1e-12)
    assert force(fibre)[at] - plain[at] > 0.01


def test_active_titin_keeps_what_an_active_stretch_gave_it_and_is_slack_below(plain: np.ndarray) -> None:
    fibre = fibre_with("active_titin", titin_stiffness=2.0, titin_release=0.0, titin_calcium=1e-3, titin_rebinding=0.0)
    extra = force(fibre) - plain
    np.testing.assert_allclose(extra[320:], 2.0 * 0.0383 / (1.0 + (1e-3 / 10.0**-0.1) ** 2), rtol=1e-9)
    down = force(fibre, length=-LENGTH) - force(fibre_with(None), length=-LENGTH)
    np.testing.assert_allclose(down, 0.0, atol=1e-12)


def test_static_stiffness_follows_length_and_calcium_alone(plain: np.ndarray) -> None:
    fibre = fibre_with("static_calcium_stiffness", calcium_stiffness=2.0, stiffness_calcium=10.0**-0.1)
    np.testing.assert_allclose(force(fibre) - plain, 0.5 * 2.0 * LENGTH, atol=1e-12)


@pytest.mark.parametrize(
    ("mechanism", "value", "instead"),
    [
        ("length_dependent_activation", {"calcium_per_length": 2.0}, "kon"),
        ("lattice_spacing", {"attachment_per_length": 2.0}, "f"),
    ],
)
def test_length_acts_as_another_parameter_would(mechanism: str, value: dict[str, float], instead: str) -> None:
    long, calcium = 0.05, 10.0**-0.2
    fibre = fibre_with(mechanism, **value)
    ours = Muscle(fibre)
    out = ours.outputs(ours.settle(long, calcium))
    # Filaments come closer where half-sarcomeres are longer, whatever the series spring makes of the fibre's length.
    change = out.ce_length_change_l0 if mechanism == "lattice_spacing" else long
    theirs = Muscle(fibre_with(None, **{instead: fibre.values[instead] * float(np.exp(2.0 * change))}))
    assert out.force_ce_f0 == pytest.approx(theirs.outputs(theirs.settle(long, calcium)).force_ce_f0, rel=1e-7)


def test_overlap_changes_beyond_the_edge_of_its_plateau_alone(plain: np.ndarray) -> None:
    on_plateau = force(fibre_with("filament_overlap", overlap_per_length=-5.0, overlap_edge=0.5))
    np.testing.assert_allclose(on_plateau, plain, atol=1e-12)
    # The series spring keeps half-sarcomeres far shorter than the fibre: this edge they pass in the stretch only.
    edge = float(np.max(_sarcomeres()) - 0.005)
    bent = force(fibre_with("filament_overlap", overlap_per_length=-5.0, overlap_edge=edge))
    same = _sarcomeres() < edge
    first = int(np.argmin(same))
    assert 0 < first < TIME.size - 1
    np.testing.assert_allclose(bent[:first], plain[:first], atol=1e-9)
    assert np.min((bent - plain)[first:]) < -1e-3


def _sarcomeres() -> np.ndarray:
    """Length change of the plain fibre's half-sarcomeres, L0."""
    muscle, calcium = Muscle(fibre_with(None)), np.full(TIME.size, 10.0**-0.1)
    states = muscle.run(muscle.settle(float(LENGTH[0]), float(calcium[0])), np.diff(TIME), LENGTH, calcium)
    found: np.ndarray = muscle.outputs_of(states)["ce_length_change_l0"]
    return found


def test_slack_titin_takes_hold_anew(plain: np.ndarray) -> None:
    """Shortened and stretched back to where it was: force only if titin took hold where it was short."""
    time_s = np.arange(0.0, 1.5, 1e-3)
    length = np.interp(time_s, [0.1, 0.2, 1.2, 1.3], [0.0, -0.03, -0.03, 0.0])
    values = {"titin_stiffness": 5.0, "titin_release": 0.0}
    without = force(fibre_with(None), length=length, time_s=time_s)
    stiff = force(fibre_with("active_titin", **values, titin_rebinding=20.0), length=length, time_s=time_s) - without
    never = force(fibre_with("active_titin", **values, titin_rebinding=0.0), length=length, time_s=time_s) - without
    np.testing.assert_allclose(never, 0.0, atol=1e-9)
    held = 1.0 / (1.0 + 10.0**0.2)
    assert stiff[-1] == pytest.approx(5.0 * held * 0.03, rel=1e-3)


def _friction(release: float, slower: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Friction and the share of slipped links, of what `friction_force` says; the force is tested beside."""
    values = {"friction_force": 0.2, "friction_way": 0.02, "friction_release": release}
    fibre = fibre_with("filament_friction", **values)
    muscle, calcium = Muscle(fibre), np.full(TIME.size, 10.0**-0.1)
    states = muscle.run(muscle.settle(0.0, float(calcium[0])), slower * np.diff(TIME), LENGTH, calcium)
    friction, slipped = (states[:, muscle.state_names.index(n)] for n in ("friction", "friction_slipped"))
    outputs = muscle.outputs_of(states)
    spring = fibre.values["kpe"] * fibre.values["gamma"] * np.maximum(LENGTH, 0.0) + fibre.values["Fpe0"]
    np.testing.assert_allclose(outputs["force_pe_f0"] - spring, 0.2 * outputs["q0"] * friction, atol=1e-12, rtol=1e-12)
    return friction, slipped


def test_friction_without_new_links_is_the_same_at_any_speed() -> None:
    """The first links alone: at a strain y a share exp(-y⁴/4) holds, so their force is y exp(-y⁴/4)."""
    found = [_friction(0.0, slower) for slower in (1.0, 10.0)]
    np.testing.assert_allclose(found[0][0], found[1][0], atol=1e-3)
    end = int(np.argmax(LENGTH))
    strain = LENGTH[: end + 1] / 0.02
    np.testing.assert_allclose(found[0][0][: end + 1], strain * np.exp(-(strain**4) / 4.0), atol=1e-2)
    np.testing.assert_allclose(1.0 - found[0][1][: end + 1], np.exp(-(strain**4) / 4.0), atol=1e-2)


def test_friction_turns_with_the_movement_and_is_softer_after_it() -> None:
    friction, slipped = _friction(5.0)
    stretched, shortened = int(np.argmax(LENGTH)), 218
    assert friction[stretched] > 0.05
    assert friction[shortened] < -0.05
    # Links that have slipped are not there for the next stretch.
    start = 51 + int(np.argmax(LENGTH[51:] > 0.0))
    again = shortened + int(np.argmax(np.diff(LENGTH[shortened:]) > 0.0))
    assert slipped[again] > 0.2
    stiffness = [(friction[k + 4] - friction[k]) / (LENGTH[k + 4] - LENGTH[k]) for k in (start, again)]
    assert stiffness[1] < 0.85 * stiffness[0]


def test_friction_lets_go_at_rest() -> None:
    fibre = fibre_with("filament_friction", friction_force=0.2, friction_way=0.01, friction_release=20.0)
    muscle, calcium = Muscle(fibre), np.full(TIME.size, 10.0**-0.1)
    states = muscle.run(muscle.settle(0.0, float(calcium[0])), np.diff(TIME), LENGTH, calcium)
    friction = states[:, muscle.state_names.index("friction")]
    assert friction[400] / friction[350] == pytest.approx(np.exp(-1.0), rel=1e-3)


def test_persistence_leaves_isometric_force_and_slows_the_way_there(plain: np.ndarray) -> None:
    slow = fibre_with("persistent_thick_filament", thick_persistence=2.0)
    ours, theirs = (Muscle(f) for f in (slow, fibre_with(None)))
    for pca in (4.5, 6.2, 6.4):
        calcium = 10.0 ** (6.0 - pca)
        settled = [m.outputs(m.settle(0.0, calcium)) for m in (ours, theirs)]
        assert settled[0].force_f0 == pytest.approx(settled[1].force_f0, rel=1e-6)
        assert settled[0].drx == pytest.approx(settled[1].drx, rel=1e-6)
    # After shortening, heads that were ready still are: force is back sooner.
    assert force(slow)[228] - plain[228] > 0.0
    as_rates = fibre_with(None, J1=slow.values["J1"] * np.exp(-2.0), J2=slow.values["J2"] * np.exp(-2.0))
    np.testing.assert_allclose(force(slow), force(as_rates), atol=1e-9)


def test_stretch_recruits_as_force_would() -> None:
    long, calcium = 0.05, 10.0**-0.2
    fibre = fibre_with("strain_recruited_heads", strain_recruitment=200.0)
    muscle = Muscle(fibre)
    out = muscle.outputs(muscle.settle(long, calcium))
    v = fibre.values
    relaxed = 1.0 - out.q0 - out.drx
    # At rest as many heads come as go: J1 (1 + JF F + kappa ΔL) S = J2 D.
    flow = v["J1"] * (1.0 + v["JF"] * (out.q0 + out.q1) + 200.0 * long) * relaxed
    assert flow == pytest.approx(v["J2"] * out.drx, rel=1e-6)


def test_warmer_is_faster_and_no_stronger(plain: np.ndarray) -> None:
    """All rates twice as fast: the same forces in half the time."""
    fibre = fibre_with("temperature", warmer=10.0, q10=2.0)
    muscle, calcium = Muscle(fibre), np.full(TIME.size, 10.0**-0.1)
    start = muscle.settle(0.0, float(calcium[0]))
    fast = muscle.outputs_of(muscle.run(start, np.diff(TIME) / 2.0, LENGTH, calcium))["force_f0"]
    np.testing.assert_allclose(fast, plain, atol=2e-4)


def test_heads_bear_curved_force_over_strain() -> None:
    fibre = fibre_with("nonlinear_crossbridge", head_curvature=0.1)
    muscle = Muscle(fibre)
    calcium = np.full(TIME.size, 10.0**-0.1)
    out = muscle.outputs_of(muscle.run(muscle.settle(0.0, float(calcium[0])), np.diff(TIME), LENGTH, calcium))
    borne = out["q0"] + out["q1"] + 0.1 * (out["q0"] + 2.0 * out["q1"] + out["q2"])
    np.testing.assert_allclose(out["force_ce_f0"], fibre.values["Fscale"] * borne, rtol=1e-12)


@pytest.mark.slow
def test_mechanisms_add_up_in_one_model(plain: np.ndarray) -> None:
    both = fibre_with("viscous_drag+static_calcium_stiffness", drag=0.02, calcium_stiffness=1.0)
    one = force(fibre_with("viscous_drag", drag=0.02)) - plain
    other = force(fibre_with("static_calcium_stiffness", calcium_stiffness=1.0)) - plain
    np.testing.assert_allclose(force(both) - plain, one + other, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("mechanism", ["viscous_drag", "length_dependent_activation", "filament_overlap"])
def test_hill_type_models_take_what_needs_no_heads(mechanism: str) -> None:
    effect = EFFECT[mechanism]
    bare = force(fibre_with(None, base="hill_se"))
    nothing = fibre_with(mechanism, base="hill_se", **{next(iter(effect)): 0.0})
    np.testing.assert_allclose(force(nothing), bare, atol=1e-9)
    assert np.max(np.abs(force(fibre_with(mechanism, base="hill_se", **effect)) - bare)) > 1e-3


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("hill_se+lattice_spacing", "needs heads"),
        ("hill+weakly_bound_heads", "needs heads"),
        ("2state_coop+strain_recruited_heads", "needs super-relaxed heads"),
        ("2state_coop+persistent_thick_filament", "needs super-relaxed heads"),
        ("3state_coop+thick_filament_cooperativity", "part of this model already"),
        ("3state_coop+viscous_drag+viscous_drag", "named twice"),
        ("3state_coop+viscous_drga", "viscous_drag"),
        ("hill+thick_filament_cooperativity", "needs heads"),
    ],
)
def test_mechanisms_that_do_not_go_with_a_model_are_refused_in_one_line(name: str, why: str) -> None:
    with pytest.raises(UserError, match=why) as caught:
        split_set(name)
    assert "\n" not in str(caught.value)


def test_a_swap_makes_the_model_that_has_the_block() -> None:
    for name, swapped in (("2state_coop+thick_filament_cooperativity", "3state_coop"),
                          ("3state_coop+forcible_detachment", "4state_coop"),
                          ("2state+thin_filament_cooperativity", "2state_coop"),
                          ("3state_coop_rigid+series_compliance", "3state_coop")):  # fmt: skip
        ours, theirs = compose(name), compose(swapped)
        assert isinstance(ours, Composition)
        assert isinstance(theirs, Composition)
        assert [type(b) for b in ours.blocks] == [type(b) for b in theirs.blocks]
    assert set(SWAPS).isdisjoint(EXTRAS)


def test_models_share_code_only_with_models_of_the_same_blocks() -> None:
    names = ("2state", "2state+thick_filament_cooperativity", "2state+thin_filament_cooperativity", "2state_coop",
             "2state_coop+viscous_drag", "2state_coop+viscous_drag+thick_filament_cooperativity",
             "2state_coop+thick_filament_cooperativity+viscous_drag", "3state_coop+viscous_drag")  # fmt: skip
    composed = {name: compose(name) for name in names}
    for a, one in composed.items():
        for b, other in composed.items():
            assert isinstance(one, Composition)
            assert isinstance(other, Composition)
            same = [type(x) for x in one.blocks] == [type(x) for x in other.blocks]
            assert (one.name == other.name) is same, (a, b)


def test_a_set_with_mechanisms_starts_from_the_one_without() -> None:
    flat = {"fibre": "x", "constants.reference_length_m": 1.0, "constants.f0_n": 1.0}
    source = load_fibre("18Dec2017a", BASE)
    flat |= {f"models.{BASE}.{key}": value for key, value in source.values.items()}
    flat |= {f"models.{BASE}+viscous_drag.drag": 0.03}
    fibre = fibre_from_parameters(flat, "test", f"{BASE}+viscous_drag")
    assert fibre.values["drag"] == 0.03
    assert fibre.values["JF"] == source.values["JF"]
