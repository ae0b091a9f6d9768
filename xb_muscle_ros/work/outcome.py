"""One task carried out, and what came of it in a form that any process can read."""

from __future__ import annotations

import json
import pickle
import threading
import traceback
from typing import Literal, NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work.identity import describe

# Compiled loops over many fibres may not be entered by two threads at once, and a Dask worker may have several. A task
# may well run tasks of its own where it is.
_ONE_AT_A_TIME = threading.RLock()


class TaskFailed(Exception):
    """A task raised something no user can mend: a defect. The message holds the traceback of where it ran."""


class Outcome(NamedTuple):
    """What came of a task.

    Attributes:
        kind: ``done``, or how it failed: ``user_error``, ``defect``.
        text: the result as JSON, the user's one line, or what failed, with the traceback.
    """

    kind: Literal["done", "user_error", "defect"]
    text: str

    def error(self) -> Exception:
        """The exception that a failure is for the caller."""
        if self.kind == "user_error":
            return UserError(self.text)
        return TaskFailed(self.text)


def attempt(payload: bytes) -> Outcome:
    """Carry out a task.

    Args:
        payload: the pickled pair of function and task.
    """
    try:
        function, task = pickle.loads(payload)
    except Exception:
        return Outcome("defect", f"a task cannot be loaded where it is to run:\n{traceback.format_exc()}")
    try:
        with _ONE_AT_A_TIME:
            return Outcome("done", json.dumps(function(task), separators=(",", ":")))
    except UserError as error:
        return Outcome("user_error", str(error))
    except Exception:
        return Outcome("defect", f"{describe(function, task)} failed where it ran:\n{traceback.format_exc()}")
