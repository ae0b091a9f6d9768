"""The paper's grid against trials simulated one by one, and against the authors' output."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.evaluate import grid
from xb_muscle_ros.evaluate.sets import gather
from xb_muscle_ros.evaluate.srs_scores import RELEASED, TEXT, score
from xb_muscle_ros.evaluate.srs_table import SrsTable, read_table, read_tables
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.redevelopment import redevelopment, restretch_end
from xb_muscle_ros.scores.stiffness import short_range_stiffness
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.work.plain import from_plain

FIBRES = ("13Dec2017a", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a")


def simulated(model: str, fibres: tuple[str, ...] = FIBRES, settle_s: float | None = None) -> SrsTable:
    (models,) = gather(fibres, [model], None)
    tasks = grid.tasks([models], settle_s=settle_s)
    cells = [from_plain(grid.Cells, grid.simulate(task)) for task in tasks]
    return grid.table(model, list(models.fibres.values()), tasks, cells)


@pytest.mark.parametrize("model", ["3state_coop", "hill_se"])
def test_cells_are_those_of_whole_trials(model: str) -> None:
    """The shared parts of the protocol give what each trial gives when it is simulated from its begin."""
    muscle = Muscle(load_fibre("18Dec2017a", model))
    (models,) = gather(["18Dec2017a"], [model], None)
    (task,) = grid.tasks([models], pcas=[6.2], recoveries_s=[0.001, 0.316], amplitudes_l0=[0.0, 0.0121, 0.0383])
    found = grid.simulate(task)
    calcium = 10.0**-0.2
    settled = muscle.settle(0.0, calcium)
    for i, recovery in enumerate(task["recoveries_s"]):
        for j, amplitude in enumerate(task["amplitudes_l0"]):
            protocol = StretchShortenStretch(amplitude, recovery)
            corner_s, length = protocol.corners()
            test = next(p for p in protocol.phases if p.name == "test_stretch")
            samples = test.start_s + np.arange(1, 11) * 1e-3
            states = muscle.follow(settled, corner_s, length, np.full(corner_s.size, calcium), samples)
            force = muscle.outputs_of(states)["force_f0"]
            whole = short_range_stiffness(samples, np.interp(samples, corner_s, length), force, test.start_s).value
            assert found["srs_test"][i][j] == pytest.approx(whole, rel=2e-4)
    assert found["srs_conditioning"] == pytest.approx(found["srs_test"][0][0], rel=1e-3)
    assert found["isometric_f0"] == pytest.approx(muscle.outputs(settled).force_f0, abs=1e-12)


def test_k_tr_is_that_of_a_recorded_release() -> None:
    """The manoeuvre as a record with 1 kHz samples, through the search and fit that recordings go through."""
    muscle = Muscle(load_fibre("18Dec2017a", "3state_coop"))
    (models,) = gather(["18Dec2017a"], ["3state_coop"], None)
    (task,) = grid.tasks([models], pcas=[4.5], recoveries_s=[0.001], amplitudes_l0=[0.0])
    calcium = 10.0**1.5
    time_s = np.arange(5500) * 1e-3
    corner_s, length = np.array([0.0, 0.1, 0.101, 0.121, 0.122, 5.5]), np.array([0.0, 0.0, -0.2, -0.2, 0.0, 0.0])
    states = muscle.follow(muscle.settle(0.0, calcium), corner_s, length, np.full(6, calcium), time_s)
    restretched = restretch_end(time_s, np.interp(time_s, corner_s, length))
    assert restretched == pytest.approx(0.122)
    found = redevelopment(time_s, muscle.outputs_of(states)["force_f0"], 0.122, 5.122)
    assert found is not None
    assert from_plain(grid.Cells, grid.simulate(task)).k_tr.value == pytest.approx(found.k_per_s, rel=1e-3)


def test_a_result_is_plain_json() -> None:
    import json

    (models,) = gather(["18Dec2017a"], ["2state"], None)
    (task,) = grid.tasks([models], pcas=[9.0], recoveries_s=[0.001], amplitudes_l0=[0.0, 0.0383])
    assert json.loads(json.dumps(task)) == task
    assert json.loads(json.dumps(grid.simulate(task), allow_nan=False))["k_tr"]["value"] is None


@pytest.fixture(scope="module")
def measured(shared_data: Path) -> SrsTable:
    return read_table(shared_data / "empirical_srs.json", "measured")


@pytest.fixture(scope="module")
def golden(shared_data: Path) -> dict[str, SrsTable]:
    return read_tables(shared_data / "golden_srs.json", "released")


def test_golden_output_gives_the_papers_large_reductions(golden: dict[str, SrsTable], measured: SrsTable) -> None:
    hill = score(golden["hill_se"], measured, TEXT, 7)
    assert hill.conditions == {"large": 6, "small": 78, "all": 84}
    assert hill.rmsd["large"] == pytest.approx(0.31, abs=0.01)
    assert (score(golden["3state_coop"], measured, TEXT, 11).rmsd["large"] or 1.0) < 0.15


def test_golden_output_gives_the_papers_all_conditions_as_released(
    golden: dict[str, SrsTable], measured: SrsTable
) -> None:
    for name in ("3state_coop", "4state_coop"):
        found = score(golden[name], measured, RELEASED, 11)
        assert found.conditions == {"large": 12, "small": 72, "all": 84}
        assert found.rmsd["all"] == pytest.approx(0.1035, abs=0.01)


@pytest.mark.parametrize("model", ["hill_se", "3state_coop"])
def test_our_simulation_gives_the_same(model: str, golden: dict[str, SrsTable], measured: SrsTable) -> None:
    ours, theirs = score(simulated(model), measured, TEXT, 7), score(golden[model], measured, TEXT, 7)
    assert ours.rmsd["large"] == pytest.approx(theirs.rmsd["large"], abs=0.01)


@pytest.mark.slow
def test_how_long_a_fibre_settles_does_not_matter_to_the_scores(measured: SrsTable) -> None:
    """The authors settled for 2 s, which is not yet equilibrium at low calcium."""
    short, full = (score(simulated("3state_coop", FIBRES, settle_s=s), measured, TEXT, 11) for s in (2.0, None))
    for name in ("large", "small", "all"):
        assert short.rmsd[name] == pytest.approx(full.rmsd[name], abs=0.002)
