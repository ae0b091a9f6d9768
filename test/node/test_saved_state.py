"""State files: bits that survive, and one line for every file that does not fit."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros import __version__
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.rules import Scale
from xb_muscle_ros.node.saved_state import load_state, save_state
from xb_muscle_ros.node.status import Account, Snapshot

AWKWARD = (1.0 / 3.0, 5e-324, 0.1 + 0.2, -0.0, 1e300)


class Keeps:
    """Something with a state, and nothing that moves it."""

    def __init__(self, muscle: Muscle, snapshot: Snapshot | None = None) -> None:
        self.batch: Any = SimpleNamespace(muscles=[muscle])
        self.snapshot = snapshot

    def save(self) -> Sequence[Snapshot]:
        """What was put there."""
        assert self.snapshot is not None
        return [self.snapshot]

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Put it there."""
        (self.snapshot,) = snapshots


@pytest.fixture
def snapshot(muscle: Muscle) -> Snapshot:
    """With numbers that only their shortest exact text brings back."""
    state = np.resize(AWKWARD, len(muscle.state_names))
    calcium = ((-(10**18) - 1, 0.1 + 0.7), (1_700_000_000_123_456_789, 5e-324))
    return Snapshot(state, Scale(0.1 + 0.2, 1.0 / 3.0), calcium, 1_700_000_000_123_456_788, 3, Account(5, 2, 1))


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_every_bit_comes_back(muscle: Muscle, snapshot: Snapshot, tmp_path: Path, mode: str) -> None:
    """Through a folder that was not there; the file has names and values to read."""
    if mode == "realtime":
        snapshot = snapshot._replace(stamp=None, asked=None)
    path = tmp_path / "new" / "state.json"
    done = save_state(str(path), mode, Keeps(muscle, snapshot))
    assert done == f"state of fibre 18Dec2017a saved to {path} after 5 length and 2 calcium samples, 1 of them late"
    assert [p.name for p in path.parent.iterdir()] == ["state.json"]
    other = Keeps(muscle)
    assert "loaded from" in load_state(str(path), mode, other)
    found = other.snapshot
    assert found is not None
    assert found.state.tobytes() == snapshot.state.tobytes()
    assert found[1:] == snapshot[1:]
    tree = json.loads(path.read_text(encoding="utf-8"))
    assert (tree["fibre"], tree["model"], tree["version"]) == ("18Dec2017a", "3state_coop", __version__)
    assert tree["parameters"]["models.3state_coop.f"] == muscle.fibre.values["f"]
    assert tree["state"].keys() == set(muscle.state_names)


def test_a_list_of_one_is_one(muscle: Muscle, snapshot: Snapshot, tmp_path: Path) -> None:
    """As a node of many that had a single fibre wrote it; of two it is said which are there."""
    path = tmp_path / "state.json"
    save_state(str(path), "lockstep", Keeps(muscle, snapshot))
    tree = json.loads(path.read_text(encoding="utf-8"))
    tree = {"format": "xb_muscle_ros states 1", "version": tree["version"], "fibres": [tree]}
    path.write_text(json.dumps(tree), encoding="utf-8")
    other = Keeps(muscle)
    load_state(str(path), "lockstep", other)
    assert other.snapshot is not None
    assert other.snapshot.state.tobytes() == snapshot.state.tobytes()
    path.write_text(json.dumps({**tree, "fibres": 2 * tree["fibres"]}), encoding="utf-8")
    with pytest.raises(UserError, match=r"has fibres = \['18Dec2017a', '18Dec2017a'\], this node has \['18Dec2017a'\]"):
        load_state(str(path), "lockstep", other)


def other_value(muscle: Muscle) -> Muscle:
    """With another rate of attachment."""
    fibre = muscle.fibre
    return Muscle(dataclasses.replace(fibre, values={**fibre.values, "f": 1.0}))


OTHERS: dict[str, tuple[Callable[[Muscle], Muscle], str]] = {
    "fibre": (
        lambda m: Muscle(dataclasses.replace(m.fibre, name="left_soleus")),
        "has fibre = 18Dec2017a, this node has left_soleus; load it into a node that has the same",
    ),
    "model": (
        lambda m: Muscle(load_fibre("18Dec2017a", model="2state")),
        "has model = 3state_coop, this node has 2state",
    ),
    "value": (other_value, r"has models.3state_coop.f = .*, this node has 1.0; set the parameter to the file's value"),
    "constant": (
        lambda m: Muscle(dataclasses.replace(m.fibre, f0_n=7.0)),
        r"has constants.f0_n = .*, this node has 7.0",
    ),
}


@pytest.mark.parametrize("case", OTHERS)
def test_a_state_of_something_else_is_refused(muscle: Muscle, snapshot: Snapshot, tmp_path: Path, case: str) -> None:
    """And what was there stays."""
    make, words = OTHERS[case]
    path = str(tmp_path / "state.json")
    save_state(path, "lockstep", Keeps(muscle, snapshot))
    other = Keeps(make(muscle))
    with pytest.raises(UserError, match=words):
        load_state(path, "lockstep", other)
    assert other.snapshot is None


def test_other_method_mode_and_version(muscle: Muscle, snapshot: Snapshot, tmp_path: Path) -> None:
    """The first two are refused, the last is said."""
    path = tmp_path / "state.json"
    save_state(str(path), "lockstep", Keeps(muscle, snapshot))
    with pytest.raises(UserError, match="has mode = lockstep, this node has realtime"):
        load_state(str(path), "realtime", Keeps(muscle))
    tree = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**tree, "version": "0.0.9"}), encoding="utf-8")
    assert f"by version 0.0.9; this is {__version__}" in load_state(str(path), "lockstep", Keeps(muscle))
    path.write_text(json.dumps({**tree, "method": "grid"}), encoding="utf-8")
    with pytest.raises(UserError, match="has method = grid, this node has gaussian"):
        load_state(str(path), "lockstep", Keeps(muscle))


def without(name: str) -> Callable[[dict[str, Any]], object]:
    """Leave an entry out."""
    return lambda tree: tree.pop(name)


DAMAGES: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "no state": (without("state"), "is damaged: KeyError: 'state'"),
    "no parameters": (without("parameters"), "is damaged: its parameters are not those"),
    "one state less": (lambda t: t["state"].pop("length_change"), "is damaged: KeyError: 'length_change'"),
    "one state more": (lambda t: t["state"].update(q9=1.0), "is damaged: a number is missing"),
    "not finite": (lambda t: t["state"].update(length_change=float("nan")), "is damaged: .*not finite"),
    "no calcium": (lambda t: t.update(calcium_ns_um=[]), "is damaged: a number is missing"),
    "no stamp": (lambda t: t.update(stamp_ns=None), "is damaged: TypeError"),
    "words": (lambda t: t.update(scale={"f0_n": "one"}), "is damaged: ValueError"),
    "another format": (lambda t: t.update(format="xb_muscle_ros state 9"), "has format 'xb_muscle_ros state 9', known"),
}


@pytest.mark.parametrize("case", DAMAGES)
def test_a_damaged_file_is_refused_with_one_line(muscle: Muscle, snapshot: Snapshot, tmp_path: Path, case: str) -> None:
    """It names the file and what is wrong with it."""
    damage, words = DAMAGES[case]
    path = tmp_path / "state.json"
    save_state(str(path), "lockstep", Keeps(muscle, snapshot))
    tree = json.loads(path.read_text(encoding="utf-8"))
    damage(tree)
    path.write_text(json.dumps(tree), encoding="utf-8")
    other = Keeps(muscle)
    with pytest.raises(UserError, match=rf"state file {path} {words}"):
        load_state(str(path), "lockstep", other)
    assert other.snapshot is None


def test_no_path_no_file_no_json(muscle: Muscle, snapshot: Snapshot, tmp_path: Path) -> None:
    """What to do is said; a file that cannot be written leaves nothing behind."""
    with pytest.raises(UserError, match="'state_file' is empty"):
        save_state("", "lockstep", Keeps(muscle, snapshot))
    with pytest.raises(UserError, match=r"nowhere.json cannot be read: No such file.*; call ~/save_state first"):
        load_state(str(tmp_path / "nowhere.json"), "lockstep", Keeps(muscle))
    with pytest.raises(UserError, match=r"cannot be written: .*Is a directory"):
        save_state(str(tmp_path), "lockstep", Keeps(muscle, snapshot))
    assert not list(tmp_path.parent.glob(f".{tmp_path.name}*"))
    for text in (b"", b"{", b"\xff\xfe", b"[1, 2]"):
        path = tmp_path / "other.txt"
        path.write_bytes(text)
        with pytest.raises(UserError, match=r"other.txt (is not JSON|has format None)"):
            load_state(str(path), "lockstep", Keeps(muscle))
