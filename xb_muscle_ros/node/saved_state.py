"""The state of one fibre or many in a file, so that another process can go on with it to the bit."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn, Protocol

import numpy as np

from xb_muscle_ros import __version__
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import write_json
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.rules import Scale
from xb_muscle_ros.node.status import Account, Log, Snapshot

# Of one fibre, and of many in a list.
FORMATS = ("xb_muscle_ros state 1", "xb_muscle_ros states 1")


class Stepping(Protocol):
    """What both modes can do."""

    batch: MuscleBatch

    def save(self) -> Sequence[Snapshot]:
        """What is needed to go on, for each fibre."""

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on with it."""


def save_state(state_file: str, mode: str, stepping: Stepping) -> str:
    """Write the states of all fibres to a file that appears whole or not at all; returns what was done, in words.

    The file is JSON. Python writes floats with as many digits as it takes to read the same bits back.

    Args:
        state_file: path; ``~`` stands for the home folder.
        mode: of the node.
        stepping: whose state it is.

    Raises:
        UserError: no path, nothing to save, or the file cannot be written.
    """
    path = _path(state_file)
    muscles, snapshots = stepping.batch.muscles, stepping.save()
    trees = [_tree(muscle, mode, snapshot) for muscle, snapshot in zip(muscles, snapshots, strict=True)]
    alone = len(trees) == 1
    tree = {"format": FORMATS[not alone], "version": __version__, **(trees[0] if alone else {"fibres": trees})}
    try:
        write_json(path, tree)
    except (OSError, ValueError) as error:
        raise UserError(f"state file {path} cannot be written: {error}; set parameter 'state_file'") from error
    if alone:
        return f"state of fibre {muscles[0].fibre.name} saved to {path} after {snapshots[0].account}"
    return f"states of {len(trees)} fibres saved to {path}"


def load_state(state_file: str, mode: str, stepping: Stepping) -> str:
    """Go on with the states in a file, for all fibres or for none; returns what was done, in words.

    Args:
        state_file, mode, stepping: see `save_state`.

    Raises:
        UserError: no path, no such file, not a state file, or of other fibres, another model, method, mode, or of other
            parameter values (the bounds of a strain grid are among them).
    """
    path = _path(state_file)
    muscles = stepping.batch.muscles
    tree = _read(path)
    trees = [tree] if tree["format"] == FORMATS[0] else tree.get("fibres")
    if not isinstance(trees, list) or not all(isinstance(entry, dict) for entry in trees):
        _damaged(path, "it has no list of fibres")
    if len(trees) > 1 or len(muscles) > 1:
        found, own = [entry.get("fibre") for entry in trees], [muscle.fibre.name for muscle in muscles]
        _same(path, "fibres", found, own, "load it into a node that has the same, in the same order")
    snapshots = [_checked(path, entry, muscle, mode) for entry, muscle in zip(trees, muscles, strict=True)]
    stepping.load(snapshots)
    done = f"states of {len(trees)} fibres loaded from {path}"
    if len(trees) == 1:
        done = f"state of fibre {muscles[0].fibre.name} loaded from {path}, saved after {snapshots[0].account}"
    if tree.get("version") != __version__:
        done += f", by version {tree.get('version')}; this is {__version__}, whose forces may differ"
    return done


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


def _read(path: Path) -> Mapping[str, Any]:
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"state file {path} cannot be read: {error.strerror}; call ~/save_state first") from error
    except ValueError as error:
        raise UserError(f"state file {path} is not JSON: {error}; give a file that ~/save_state wrote") from error
    found = tree.get("format") if isinstance(tree, dict) else None
    if found not in FORMATS:
        known = "' and '".join(FORMATS)
        raise UserError(
            f"state file {path} has format {found!r}, known are '{known}'; give one that ~/save_state wrote"
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


class StateFile:
    """Saves and loads what a node steps."""

    def __init__(self, mode: str, name: Callable[[], str], stepping: Callable[[], Stepping | None], log: Log) -> None:
        """Know the mode of the node, and whom to ask for the file's name and what is stepped (None: nothing)."""
        self._mode = mode
        self._name = name
        self._stepping = stepping
        self._log = log

    def on_save(self, request: Any, response: Any) -> Any:
        """Callback of ``~/save_state``."""
        return self._answer(response, save_state)

    def on_load(self, request: Any, response: Any) -> Any:
        """Callback of ``~/load_state``."""
        return self._answer(response, load_state)

    def load_at_start(self) -> None:
        """Go on with the file where there is one; a line says what is done.

        Raises:
            UserError: no file is named, or it does not fit.
        """
        name = self._name()
        if not name:
            raise UserError("parameter 'load_state_at_start' is true, but 'state_file' is empty; name the file there")
        if not Path(name).expanduser().exists():
            self._log.warning(f"state file {name} does not exist yet: the fibre settles anew with its first samples")
            return
        self._log.info(self._done(load_state))

    def _done(self, act: Callable[[str, str, Stepping], str]) -> str:
        stepping = self._stepping()
        if stepping is None:
            raise UserError("the node is not configured; configure it first")
        return act(self._name(), self._mode, stepping)

    def _answer(self, response: Any, act: Callable[[str, str, Stepping], str]) -> Any:
        try:
            response.message = self._done(act)
            response.success = True
            self._log.info(response.message)
        except UserError as error:
            response.message = str(error)
            self._log.error(response.message)
        return response
