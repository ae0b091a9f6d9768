"""OpenSim's process: what is sent to it, what is said where it is not there, and OpenSim itself where it is."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path as FilePath

import numpy as np
import pytest

from xb_muscle_ros.bench import papers_trial
from xb_muscle_ros.bench.peers import opensim_muscles
from xb_muscle_ros.bench.peers.conditions import Path, onset_stiffness, path_of
from xb_muscle_ros.bench.peers.muscle import F0_N, L0_M, Peer
from xb_muscle_ros.bench.peers.opensim_muscles import OpenSim, default_python
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.conditions import CONDITIONS, Condition

# Stands for OpenSim: answers as the program does, and writes down what it is asked.
_STAND_IN = """
import json, sys
for line in sys.stdin:
    request = json.loads(line)
    with open(sys.argv[0] + ".asked", "a") as asked:
        asked.write(line)
    if request["do"] == "about":
        answer = {"opensim": "9.9-made", "python": "3"}
    elif request["do"] == "muscle":
        answer = {"least_activation": 0.01, "parameters": {"tendon_strain": 0.05, "vmax_l0_per_s": 10.0}}
    elif request["do"] == "trial":
        answer = {"force_f0": request["sample_s"]}
    else:
        answer = {"error": "std::exception: no such thing"}
    print(json.dumps(answer), flush=True)
"""


@pytest.fixture
def stand_in(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> FilePath:
    """A program in OpenSim's place; what it was asked is beside it."""
    program = tmp_path / "program.py"
    program.write_text(_STAND_IN, encoding="utf-8")
    monkeypatch.setattr(opensim_muscles, "PROGRAM", program)
    return program


def _asked(program: FilePath) -> list[dict[str, object]]:
    return [json.loads(line) for line in program.with_suffix(".py.asked").read_text(encoding="utf-8").splitlines()]


@pytest.mark.parametrize("condition", [CONDITIONS[0], Condition(0.0383, 0.1)], ids=str)
def test_lengths_that_are_sent_are_those_of_the_protocol(stand_in: FilePath, condition: Condition) -> None:
    """To the last bit: JSON keeps doubles."""
    path = path_of(condition)
    with OpenSim(FilePath(sys.executable)) as opensim:
        assert opensim.version == "9.9"
        muscle = opensim.peers()[1].take({"tendon_strain": 0.02})
        assert muscle.force_f0(0.5, path).tolist() == path.sample_s.tolist()
    *_, taken, trial = _asked(stand_in)
    assert taken["parameters"] == {"tendon_strain": 0.02}
    assert (taken["l0_m"], taken["f0_n"]) == (L0_M, F0_N)
    assert trial["corner_s"] == path.corner_s.tolist()
    assert trial["corner_l0"] == path.corner_l0.tolist()
    assert (trial["activation"], trial["accuracy"]) == (0.5, 1e-8)


def test_rows_are_of_every_muscle_rigid_as_it_comes_and_fitted(stand_in: FilePath) -> None:
    """Thelen's has no rigid tendon in OpenSim."""
    with OpenSim(FilePath(sys.executable)) as opensim:
        peers = opensim.peers()
    assert [peer.key for peer in peers] == [
        *("millard_rigid", "millard", "millard_fitted", "millard_fitted_vmax"),
        *("thelen", "thelen_fitted", "thelen_fitted_vmax"),
        *("degroote_rigid", "degroote", "degroote_fitted", "degroote_fitted_vmax"),
    ]
    assert peers[3].fitted == "tendon strain at F0 and vmax"
    assert peers[0].defaults == {"vmax_l0_per_s": 10.0}


def test_what_opensim_cannot_do_is_said(stand_in: FilePath) -> None:
    """In its own words."""
    with (
        OpenSim(FilePath(sys.executable)) as opensim,
        pytest.raises(UserError, match="OpenSim: std::exc"),
    ):
        opensim.peers()[0].take({}).isometric_f0(0.5)


def test_without_the_environment_one_line_says_how_to_get_it(tmp_path: FilePath) -> None:
    """No such file."""
    with pytest.raises(UserError, match=r"no Python with OpenSim at .*/python; make one with scripts/setup_peers"):
        OpenSim(tmp_path / "python")


def test_a_python_without_opensim_is_refused_with_its_reason() -> None:
    """The NumPy of ROS's wheels is too old for it."""
    with pytest.raises(UserError, match=r"cannot run OpenSim \(.*No module named 'opensim'\); make one with"):
        OpenSim(FilePath(sys.executable))


def test_the_environment_names_the_python(monkeypatch: pytest.MonkeyPatch, repo_root: FilePath) -> None:
    """Else it is that of the checkout."""
    monkeypatch.setenv(opensim_muscles.PYTHON_VARIABLE, "/somewhere/python")
    assert default_python() == FilePath("/somewhere/python")
    monkeypatch.delenv(opensim_muscles.PYTHON_VARIABLE)
    assert default_python() == repo_root / ".venv_peers" / "bin" / "python"


@pytest.fixture(scope="module")
def opensim() -> Iterator[OpenSim]:
    """The real one."""
    if not default_python().is_file():
        pytest.skip(f"no OpenSim at {default_python()}; scripts/setup_peers makes it")
    with OpenSim(default_python()) as made:
        yield made


@pytest.fixture(scope="module")
def peers(opensim: OpenSim) -> dict[str, Peer]:
    """Rows by key."""
    return {peer.key: peer for peer in opensim.peers()}


@pytest.mark.slow
def test_opensim_isometric_force_and_defaults(peers: dict[str, Peer]) -> None:
    """A rigid Millard muscle at its optimal length has force in proportion to activation and no passive force."""
    muscle = peers["millard_rigid"].take({})
    assert [muscle.isometric_f0(a) for a in (0.1, 0.5, 1.0)] == pytest.approx([0.1, 0.5, 1.0], rel=1e-6)
    assert muscle.least_activation == 0.01
    assert peers["millard"].defaults == pytest.approx({"tendon_strain": 0.049, "vmax_l0_per_s": 10.0})
    assert peers["thelen"].defaults["tendon_strain"] == pytest.approx(0.04)


@pytest.mark.slow
def test_opensim_follows_the_lengths(peers: dict[str, Peer]) -> None:
    """A rigid muscle has no memory: force through a path depends on activation, length and velocity alone."""
    muscle = peers["millard_rigid"].take({})
    path = path_of(Condition(0.0383, 0.001))
    after, straight = muscle.force_f0(0.5, path), muscle.force_f0(0.5, path_of(CONDITIONS[0]))
    np.testing.assert_allclose(after, straight, rtol=1e-6)
    # Eccentric: more than isometric, as the muscle is stretched at the speed of the protocol and none other.
    assert 0.5 < after[0] < 0.7


@pytest.mark.slow
@pytest.mark.parametrize("key", ["millard", "thelen", "degroote"])
def test_opensim_elastic_tendons_have_short_range_stiffness(peers: dict[str, Peer], key: str) -> None:
    """A stiffer tendon at the same vmax makes another SRS; a wait of 10 s brings it back to the unconditioned one."""
    muscle = peers[key].take({})
    fresh, rested = (path_of(c) for c in (CONDITIONS[0], Condition(0.0383, 10.0)))
    srs = onset_stiffness(fresh, muscle.force_f0(0.5, fresh))
    assert 3.0 < srs < 60.0
    assert onset_stiffness(rested, muscle.force_f0(0.5, rested)) == pytest.approx(srs, rel=0.02)


@pytest.mark.slow
def test_opensim_manager_without_an_accuracy_takes_1e_3(opensim: OpenSim, peers: dict[str, Peer]) -> None:
    """The words of the table say so; forces are the same to the last bit."""
    peers["degroote"].take({})
    path = path_of(Condition(0.0383, 0.001))
    corners = {"corner_s": path.corner_s.tolist(), "corner_l0": path.corner_l0.tolist()}
    asked = {"do": "trial", "activation": 0.5, "sample_s": path.sample_s.tolist(), **corners}
    default, given, finer = (opensim.ask({**asked, "accuracy": a})["force_f0"] for a in (None, 1e-3, 1e-6))
    assert default == given != finer


@pytest.mark.slow
def test_opensim_costs_are_told_with_their_errors(peers: dict[str, Peer]) -> None:
    """The accurate one errs by at most 0.1 % F0."""
    path = Path(*papers_trial.corners(), papers_trial.sample_s())
    default, accurate = peers["degroote"].take({}).cost(0.5, path, 1)
    assert default.default
    assert not accurate.default
    assert accurate.error_f0 <= 1e-3 < default.error_f0
    assert len(accurate.seconds) == 1
