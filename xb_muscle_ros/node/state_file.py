"""The services that write the state to ``state_file`` and go on with what is there, and the same at the start."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.saved_state import load_state, save_state
from xb_muscle_ros.node.status import Log


class StateFile:
    """Saves and loads what a node steps."""

    def __init__(self, mode: str, name: Callable[[], str], stepping: Callable[[], Any], log: Log) -> None:
        """Know the mode of the node, and whom to ask for the file's name and what is stepped (None: nothing)."""
        self._mode = mode
        self._name = name
        self._stepping = stepping
        self._log = log

    def on_save(self, request: Any, response: Any) -> Any:
        """Callback of ``~/save_state``."""
        return self._answer(response, self._save)

    def on_load(self, request: Any, response: Any) -> Any:
        """Callback of ``~/load_state``."""
        return self._answer(response, self._load)

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
        self._log.info(self._load())

    def _save(self) -> str:
        return save_state(self._name(), self._mode, self._known())

    def _load(self) -> str:
        return load_state(self._name(), self._mode, self._known())

    def _known(self) -> Any:
        stepping = self._stepping()
        if stepping is None:
            raise UserError("the node is not configured; configure it first")
        return stepping

    def _answer(self, response: Any, act: Callable[[], str]) -> Any:
        try:
            response.message = act()
            response.success = True
            self._log.info(response.message)
        except UserError as error:
            response.message = str(error)
            self._log.error(response.message)
        return response
