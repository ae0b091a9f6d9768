"""Small made studies through the whole diagnosis: what is concealed is found, and errors are no physics."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from made_trials import FIBRE, PCAS, given_fibre, study_of, trials_of, truth

from xb_muscle_ros.diagnose.component import NAMED, Component, Kind
from xb_muscle_ros.diagnose.outputs import Files
from xb_muscle_ros.diagnose.result import Diagnosis, Verdict
from xb_muscle_ros.diagnose.run import diagnose
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

# What its tests share takes long to make.
pytestmark = pytest.mark.slow

SEVEN = (4.5, 5.8, 6.0, 6.2, 6.4, 6.6, 9.0)
DRAG, STIFFNESS, HALF = 0.04, 2.0, 1.0


class Done(NamedTuple):
    """A diagnosis and what goes into files beside it."""

    found: Diagnosis
    files: Files

    def component(self, name: str) -> Component:
        found = next((c for c in self.found.components if name in (c.name, *c.members)), None)
        assert found is not None
        return found

    def holds(self, name: str, value: float) -> bool:
        """Whether a parameter's interval holds a value."""
        (row,) = [p for c in self.found.components for p in c.parameters if p.name == name]
        low, high = row.interval
        return low < value < high


def diagnosed(given: Fibre, trials: list[Trial]) -> Done:
    return Done(*diagnose([study_of(given, trials)], True, 1, Options(processes=0, quiet=True)))


@pytest.fixture(scope="module")
def null() -> Done:
    """Other parameters, and ordinary errors: SD 0.04 of pCa, 0.4 % F0 of force zero, 0.5 ms, 1 % of L0."""
    return diagnosed(given_fibre(), trials_of(truth()))


@pytest.fixture(scope="module")
def drag() -> Done:
    """The same with a drag."""
    return diagnosed(given_fibre(), trials_of(truth("3state_coop+viscous_drag", drag=DRAG)))


@pytest.fixture(scope="module")
def two() -> Done:
    """Drag and stiffness of titin."""
    model = "3state_coop+viscous_drag+static_calcium_stiffness"
    fibre = truth(model, drag=DRAG, calcium_stiffness=STIFFNESS, stiffness_calcium=HALF)
    longer = StretchShortenStretch(0.0383, 0.2, lead_s=0.1, hold_s=0.3)
    return diagnosed(given_fibre(), trials_of(fibre, SEVEN, protocol=longer))


@pytest.fixture(scope="module")
def thin() -> Done:
    """Cooperative thin filament, to a base without."""
    return diagnosed(given_fibre("2state"), trials_of(given_fibre("2state_coop"), SEVEN))


@pytest.fixture(scope="module")
def wrong() -> Done:
    """One solution was made up wrongly."""
    return diagnosed(given_fibre(), trials_of(truth(), ordinary=False, shifts={6.2: 0.3}))


def test_ordinary_errors_and_other_parameters_are_nothing_to_name(null: Done) -> None:
    found = null.found
    assert found.verdict in (Verdict.NONE, Verdict.PARAMETERS)
    assert found.answer == found.named == found.mismatch == ()
    assert all(c.inclusion_probability < 0.2 for c in found.components)
    assert found.described
    assert found.before == found.after
    assert found.explained_fraction == 0.0
    assert null.files.augmented == {}
    assert found.next_experiment is null.files.protocol is None
    # The errors that were made are among the nuisances, about as large as they were.
    offsets = [n for n in found.nuisance_parameters if n.name == "force_offset"]
    assert len(offsets) == len(PCAS)
    assert {n.name for n in found.nuisance_parameters} == {
        "pca_shift",
        "length_gain",
        "run_down",
        "force_offset",
        "time_shift",
    }


def test_a_drag_is_physics_and_its_interval_holds_the_truth(drag: Done) -> None:
    found = drag.found
    # Five trials name it; of what is real they would have to say more to be sure.
    assert found.verdict in (Verdict.PHYSICS, Verdict.AMBIGUOUS)
    assert found.answer == ("viscous_drag",)
    assert found.components[0].inclusion_probability > 0.55
    assert found.components[0].name == "viscous_drag"
    assert drag.holds("drag", DRAG)
    assert found.p_value < 0.02
    assert found.mismatch
    gain = drag.component("viscous_drag").heldout_gain
    assert gain is not None
    assert gain.beyond_error
    assert gain.conditions == len(PCAS)
    assert found.heldout_gain == gain
    before, after = found.before.heldout_rmsd_f0, found.after.heldout_rmsd_f0
    assert before is not None
    assert after is not None
    assert after < 0.5 * before
    assert found.explained_fraction > 0.95
    assert drag.component("viscous_drag").ablation_loss == pytest.approx(found.explained_fraction, abs=0.02)


def test_words_and_traces_agree_with_what_a_drag_does(drag: Done) -> None:
    words = drag.component("viscous_drag").direction
    assert "raises force in the test stretch" in words or "raises force in the conditioning stretch" in words
    assert "lowers it in the shortening" in words
    for t in drag.files.traces:
        adds = t.adds_f0("viscous_drag")
        speed = np.gradient(t.length_l0, t.time_s)
        assert adds[speed > 0.4].mean() > 0.005
        assert adds[speed < -0.4].mean() < -0.005
        assert t.after_f0 - t.measured_f0 == pytest.approx(0.0, abs=0.02)
        assert t.heldout_after_f0 is not None
    rows = {row.trial: row for row in drag.found.trials}
    for t in drag.files.traces:
        left = float(np.sqrt(np.mean((t.after_f0 - t.measured_f0) ** 2)))
        assert rows[t.trial].after_rmsd_f0 == pytest.approx(left)


def test_the_augmented_fibre_is_one_that_a_user_can_run(drag: Done) -> None:
    (fibre,) = drag.files.augmented.values()
    assert fibre.model == "3state_coop+viscous_drag"
    assert "viscous_drag (diagnosed)" in fibre.source
    (row,) = drag.component("viscous_drag").parameters
    assert fibre.values["drag"] == pytest.approx(row.value)
    muscle = Muscle(fibre)
    state = muscle.settle(0.0, 1.0, 1.0)
    moving = muscle.outputs(muscle.step(state, 1e-3, 1.0, 1e-3)).force_pe_f0
    resting = muscle.outputs(muscle.step(state, 0.0, 1.0, 1e-3)).force_pe_f0
    assert moving - resting == pytest.approx(row.value, rel=0.05)


def test_the_sets_are_those_that_were_averaged_over(drag: Done) -> None:
    sets = drag.found.sets
    assert sets[0].log_evidence == 0.0
    assert sum(s.probability for s in sets) <= 1.0 + 1e-9
    assert list(sets) == sorted(sets, key=lambda s: -s.log_evidence)
    assert () in [s.names for s in sets]
    assert any(not s.fitted for s in sets)


def test_two_mechanisms_are_two_components(two: Done) -> None:
    found = two.found
    assert found.verdict in (Verdict.PHYSICS, Verdict.AMBIGUOUS)
    assert found.answer[0] == "viscous_drag"
    elastic = [c for c in found.named if c.family == "calcium_dependent_elasticity"]
    assert len(elastic) == 1
    assert "static_calcium_stiffness" in (*elastic[0].members, *elastic[0].not_separable_from)
    assert {c.family for c in found.named} == {"parallel_viscoelasticity", "calcium_dependent_elasticity"}
    assert two.holds("drag", DRAG)
    assert all(0.05 < c.ablation_loss < 1.0 for c in found.named)
    assert all(c.heldout_gain is not None and c.heldout_gain.beyond_error for c in found.named)
    assert found.explained_fraction > 0.95


def test_cooperativity_that_the_base_lacks_is_found(thin: Done) -> None:
    found = thin.found
    assert found.verdict is Verdict.PHYSICS
    assert found.answer[0] == "thin_filament_cooperativity"
    assert found.after.train_rmsd_f0 < 0.2 * found.before.train_rmsd_f0
    (fibre,) = thin.files.augmented.values()
    assert fibre.model.startswith("2state+thin_filament_cooperativity")


def test_a_solution_of_another_calcium_is_a_fault_of_the_measurement(wrong: Done) -> None:
    found = wrong.found
    assert found.verdict is Verdict.MEASUREMENT
    assert found.answer == ()
    assert [c.name for c in found.named] == ["pca_shift"]
    assert found.named[0].kind is Kind.ARTEFACT
    rows = {n.group: n.value for n in found.nuisance_parameters if n.name == "pca_shift"}
    # Calcium of all solutions together is the thin filament's to take up; that of one against the others is not.
    others = 0.5 * (rows["pCa 6"] + rows["pCa 6.4"])
    assert rows["pCa 6.2"] - others == pytest.approx(0.3, abs=0.06)
    assert wrong.files.augmented == {}


def test_forces_of_chance_have_no_physics() -> None:
    random = np.random.default_rng(0)
    trials = [replace(t, force_n=random.normal(0.5, 0.2, t.force_n.size)) for t in trials_of(truth(), (4.5, 6.2, 9.0))]
    found = diagnosed(given_fibre(), trials).found
    assert found.verdict is Verdict.UNEXPLAINED
    assert found.answer == ()
    assert not found.described
    assert any("hides what is looked for" in line for line in found.missing)


def test_one_trial_gives_no_sure_physics() -> None:
    trials = trials_of(truth("3state_coop+viscous_drag", drag=DRAG), (6.2,))
    found = diagnosed(given_fibre(), trials).found
    assert found.verdict not in (Verdict.PHYSICS,)
    assert found.before.heldout_rmsd_f0 is None
    assert any("at least three trials" in line for line in found.missing)
    assert any("nothing could be left out of the fit: there is 1 trial" in line for line in found.notes)


def test_probabilities_are_never_certain(drag: Done, two: Done, null: Done) -> None:
    for done in (drag, two, null):
        for c in done.found.components:
            assert 0.0 <= c.inclusion_probability < 1.0
            assert (c.inclusion_probability >= NAMED) == (c in done.found.named)
            assert len(c.by_fibre) == 1
            assert c.by_fibre[0].fibre == FIBRE
            assert c.by_fibre[0].inclusion_probability == c.inclusion_probability
