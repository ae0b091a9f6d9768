"""The state of one fibre or many in a file, so that another process can go on with it to the bit."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn, Protocol

import numpy as np

from xb_muscle_ros import __version__
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import write_json
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.inputs import Scale
from xb_muscle_ros.node.status import Account, Snapshot

FORMAT = "xb_muscle_ros state 1"
FORMAT_OF_MANY = "xb_muscle_ros states 1"


class Stepping(Protocol):
    """What both modes can do."""

    muscle: Muscle

    def save(self) -> Snapshot:
        """What is needed to go on."""

    def load(self, snapshot: Snapshot) -> None:
        """Go on with it."""


class SteppingOfMany(Protocol):
    """What both modes can do for many fibres."""

    @property
    def muscles(self) -> Sequence[Muscle]:
        """One for each fibre."""

    def save(self) -> Sequence[Snapshot]:
        """What is needed to go on, for each fibre."""

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on with it."""


def save_state(state_file: str, mode: str, stepping: Stepping) -> str:
    """Write the state to a file that appears whole or not at all; returns what was done, in words.

    The file is JSON. Python writes floats with as many digits as it takes to read the same bits back.

    Args:
        state_file: path; ``~`` stands for the home folder.
        mode: of the node.
        stepping: whose state it is.

    Raises:
        UserError: no path, nothing to save, or the file cannot be written.
    """
    path = _path(state_file)
    muscle, snapshot = stepping.muscle, stepping.save()
    _write(path, {"format": FORMAT, "version": __version__, **_tree(muscle, mode, snapshot)})
    return f"state of fibre {muscle.fibre.name} saved to {path} after {snapshot.account}"


def load_state(state_file: str, mode: str, stepping: Stepping) -> str:
    """Go on with the state in a file; returns what was done, in words.

    Args:
        state_file, mode, stepping: see `save_state`.

    Raises:
        UserError: no path, no such file, not a state file, or of another fibre, model, method, mode, or of other
            parameter values (the bounds of a strain grid are among them).
    """
    path = _path(state_file)
    muscle = stepping.muscle
    tree = _read(path, FORMAT)
    snapshot = _checked(path, tree, muscle, mode)
    stepping.load(snapshot)
    done = f"state of fibre {muscle.fibre.name} loaded from {path}, saved after {snapshot.account}"
    return done + _other_version(tree)


def save_states(state_file: str, mode: str, stepping: SteppingOfMany) -> str:
    """As `save_state`, for all fibres of a node in one file."""
    path = _path(state_file)
    muscles, snapshots = stepping.muscles, stepping.save()
    trees = [_tree(muscle, mode, snapshot) for muscle, snapshot in zip(muscles, snapshots, strict=True)]
    _write(path, {"format": FORMAT_OF_MANY, "version": __version__, "fibres": trees})
    return f"states of {len(trees)} fibres saved to {path}"


def load_states(state_file: str, mode: str, stepping: SteppingOfMany) -> str:
    """As `load_state`, for all fibres of a node, or for none where one does not fit."""
    path = _path(state_file)
    muscles = stepping.muscles
    tree = _read(path, FORMAT_OF_MANY)
    trees = tree.get("fibres")
    if not isinstance(trees, list) or not all(isinstance(entry, dict) for entry in trees):
        _damaged(path, "it has no list of fibres")
    found, own = [entry.get("fibre") for entry in trees], [muscle.fibre.name for muscle in muscles]
    _same(path, "fibres", found, own, "load it into a node that has the same, in the same order")
    snapshots = [_checked(path, entry, muscle, mode) for entry, muscle in zip(trees, muscles, strict=True)]
    stepping.load(snapshots)
    return f"states of {len(trees)} fibres loaded from {path}" + _other_version(tree)


def _write(path: Path, tree: Mapping[str, object]) -> None:
    try:
        write_json(path, tree)
    except (OSError, ValueError) as error:
        raise UserError(f"state file {path} cannot be written: {error}; set parameter 'state_file'") from error


def _tree(muscle: Muscle, mode: str, snapshot: Snapshot) -> dict[str, object]:
    return {
        **_identity(muscle, mode),
        "parameters": _parameters(muscle),
        "state": dict(zip(muscle.state_names, snapshot.state.tolist(), strict=True)),
        "scale": snapshot.scale._asdict(),
        "calcium_ns_um": snapshot.calcium,
        "stamp_ns": snapshot.stamp,
        "asked_ns": snapshot.asked,
        "taken": snapshot.account._asdict(),
    }


def _checked(path: Path, tree: Mapping[str, Any], muscle: Muscle, mode: str) -> Snapshot:
    """Snapshot of a fibre, if it is of this one."""
    for what, own in _identity(muscle, mode).items():
        _same(path, what, tree.get(what), own, "load it into a node that has the same")
    own_values, values = _parameters(muscle), tree.get("parameters")
    if not isinstance(values, dict) or values.keys() != own_values.keys():
        _damaged(path, "its parameters are not those of the model")
    for name, value in own_values.items():
        _same(path, name, values[name], value, "set the parameter to the file's value first")
    return _snapshot(path, tree, muscle.state_names, lockstep=mode == "lockstep")


def _other_version(tree: Mapping[str, Any]) -> str:
    if tree.get("version") == __version__:
        return ""
    return f", by version {tree.get('version')}; this is {__version__}, whose forces may differ"


def _path(state_file: str) -> Path:
    if not state_file:
        raise UserError("parameter 'state_file' is empty; set it to the path of the file, for example /tmp/soleus.json")
    try:
        return Path(state_file).expanduser().absolute()
    except RuntimeError as error:
        raise UserError(f"parameter 'state_file' is '{state_file}': {error}; give a path") from error


def _identity(muscle: Muscle, mode: str) -> dict[str, str]:
    fibre = muscle.fibre
    return {"fibre": fibre.name, "model": fibre.model, "method": fibre.method, "mode": mode}


def _parameters(muscle: Muscle) -> dict[str, float]:
    fibre = muscle.fibre
    constants = {"reference_length_m": fibre.reference_length_m, "f0_n": fibre.f0_n}
    return {
        **{f"constants.{name}": value for name, value in constants.items()},
        **{f"models.{fibre.model}.{name}": value for name, value in fibre.values.items()},
    }


def _same(path: Path, what: str, found: object, own: object, remedy: str) -> None:
    if found != own:
        raise UserError(f"state file {path} has {what} = {found}, this node has {own}; {remedy}")


def _read(path: Path, wanted: str) -> Mapping[str, Any]:
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"state file {path} cannot be read: {error.strerror}; call ~/save_state first") from error
    except ValueError as error:
        raise UserError(f"state file {path} is not JSON: {error}; give a file that ~/save_state wrote") from error
    found = tree.get("format") if isinstance(tree, dict) else None
    if found != wanted:
        raise UserError(
            f"state file {path} has format {found!r}, known is '{wanted}'; give one that ~/save_state wrote"
        )
    assert isinstance(tree, dict)
    return tree


def _snapshot(path: Path, tree: Mapping[str, Any], state_names: tuple[str, ...], lockstep: bool) -> Snapshot:
    try:
        state = np.array([float(tree["state"][name]) for name in state_names])
        calcium = tuple((int(stamp), float(value)) for stamp, value in tree["calcium_ns_um"])
        scale = Scale(**{name: float(value) for name, value in tree["scale"].items()})
        stamp, asked = (int(tree[name]) for name in ("stamp_ns", "asked_ns")) if lockstep else (None, None)
        account = Account(**{name: int(count) for name, count in tree["taken"].items()})
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        _damaged(path, f"{type(error).__name__}: {error}")
    numbers = [*state, *scale, *(value for _, value in calcium)]
    if not calcium or len(tree["state"]) != len(state_names) or not all(map(math.isfinite, numbers)):
        _damaged(path, "a number is missing, too many or not finite")
    return Snapshot(state, scale, calcium, stamp, asked, account)


def _damaged(path: Path, how: str) -> NoReturn:
    raise UserError(f"state file {path} is damaged: {how}; give one as ~/save_state wrote it")
