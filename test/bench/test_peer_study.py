"""The study of peers: what it is given, what it leaves out, what it writes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.bench import peer_study
from xb_muscle_ros.bench.measure import Setting
from xb_muscle_ros.bench.peers import ours
from xb_muscle_ros.bench.peers.muscle import Cost
from xb_muscle_ros.bench.peers.rows import Row, cost_text, table
from xb_muscle_ros.bench.peers.scoring import Score
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle

FIBRE = "18Dec2017a"


def _one_fibre(shared_data: Path, folder: Path) -> Path:
    """The measured table with one fibre."""
    tree = json.loads((shared_data / "empirical_srs.json").read_text(encoding="utf-8"))
    tree["fibres"] = {FIBRE: tree["fibres"][FIBRE]}
    path = folder / "one.json"
    path.write_text(json.dumps(tree), encoding="utf-8")
    return path


def test_without_a_measured_table_the_remedy_is_said(tmp_path: Path) -> None:
    """The package has none of its own."""
    with pytest.raises(UserError, match="study peers needs measured SRS: give --empirical"):
        peer_study.study(Setting(load_fibre(FIBRE), tmp_path / "bench.json"))


def test_fibres_are_those_with_all_sets(shared_data: Path) -> None:
    """Seven of eleven; the measurement is taken of the same."""
    data, models = peer_study.measured(shared_data / "empirical_srs.json")
    assert len(data.fibres) == 7
    assert [each.name for each in models] == list(peer_study.MODELS)
    assert all(set(data.fibres) <= set(each.fibres) for each in models)


def test_a_table_of_strangers_is_refused(tmp_path: Path, shared_data: Path) -> None:
    """It names them."""
    tree = json.loads((shared_data / "empirical_srs.json").read_text(encoding="utf-8"))
    tree["fibres"] = {"nobody": tree["fibres"][FIBRE]}
    (tmp_path / "table.json").write_text(json.dumps(tree), encoding="utf-8")
    with pytest.raises(UserError, match="none of the fibres nobody has a file"):
        peer_study.measured(tmp_path / "table.json")


@pytest.mark.slow
def test_without_opensim_its_rows_are_left_out_and_a_line_says_how_to_get_them(
    tmp_path: Path, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """MuJoCo and ours remain; table, figure and JSON are written."""
    pytest.importorskip("mujoco", reason="the extra mujoco is not installed")
    setting = Setting(
        load_fibre(FIBRE), tmp_path / "out" / "bench.json", empirical=_one_fibre(shared_data, tmp_path),
        peers_python=tmp_path / "no_python",
    )  # fmt: skip
    figures = peer_study.study(setting)
    lines = capsys.readouterr().err.splitlines()
    assert [line for line in lines if "OpenSim" in line] == [
        f"xb_muscle: rows of OpenSim are left out: no Python with OpenSim at {tmp_path / 'no_python'}; make one with "
        "scripts/setup_peers, or name another with --peers-python or XB_MUSCLE_PEERS_PYTHON"
    ]
    rows = json.loads((tmp_path / "out" / "peers.json").read_text(encoding="utf-8"))["rows"]
    assert [row["key"] for row in rows] == ["mujoco", *peer_study.MODELS]
    by_key = {row["key"]: row for row in rows}
    large = {key: row["score"]["relative"]["released"]["large"] for key, row in by_key.items()}
    assert large["3state_coop"] < min(large["mujoco"], large["hill_se"])
    assert by_key["mujoco"]["score"]["isometric"] < 0.01
    assert len(figures) == 2 * len(rows)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"peers.json", "peers.md", "peers.png", "peers.pdf"}


def test_costs_of_ours_are_at_the_default_and_at_the_loosest_accurate_tolerance() -> None:
    """Errors of force are told with them."""
    default, accurate = ours.cost(Muscle(load_fibre(FIBRE, "hill_se")), 2)
    assert default.integrator == "Rosenbrock, tolerance 1e-06"
    assert default.error_f0 < accurate.error_f0 <= 1e-3
    assert len(default.seconds) == 2


def test_the_table_says_what_was_fitted_and_what_is_not_known() -> None:
    """A dash where there is no score; parameters with their units; values at bounds counted."""
    score = Score({name: {"large": None, "small": 0.25, "all": 0.3} for name in ("released", "text")},
                  {"large": 1.0, "small": None, "all": 1.0}, 3.21, 0.012)  # fmt: skip
    costs = [Cost("made, by default", [0.010, 0.012, 0.020], 15.0, True), Cost("made", [0.03], 5e-4, False)]
    row = Row("x", "Muscle", "Package 1", "elastic", "tendon strain at F0",
              {"tendon_strain": 0.031, "vmax_l0_per_s": 10.0}, {}, 2, score, costs)  # fmt: skip
    head, cells = table([row])
    found = dict(zip(head, cells[0], strict=True))
    assert found["parameters"] == "tendon strain 0.031, vmax 10 L0/s (2 at a bound)"
    assert found["relative SRS, large"] == "–"
    assert found["small"] == "0.250"
    assert found["isometric force, error (% F0)"] == "1.2"
    assert found["trial by default"] == "12 ms, 1.5e+03 % F0 (made, by default)"
    assert cost_text(costs[1]) == "30 ms, 0.05 % F0 (made)"
    assert len(peer_study.figures(row)) == 1
    np.testing.assert_allclose(peer_study.figures(row)[0].value, 30.0)
