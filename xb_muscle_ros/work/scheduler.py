"""The way to a Dask scheduler."""

from __future__ import annotations

import importlib.metadata
import logging
import platform
import threading
import warnings
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as Unanswered
from typing import TYPE_CHECKING

from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    from distributed import Client

PATIENCE_S = 10.0


def connect(address: str) -> Client:
    """Connect to a scheduler.

    Raises:
        UserError: Dask is not installed, nobody answers within 10 s, or the scheduler has other versions.
    """
    try:
        from distributed import Client
        from distributed.versions import VersionMismatchWarning
    except ImportError as error:
        raise UserError(
            f"--scheduler needs Dask, which cannot be loaded ({error}); type: pip install 'xb_muscle_ros[dask]'"
        ) from error
    # Other versions and a scheduler that is lost are told here, in one line.
    warnings.simplefilter("ignore", VersionMismatchWarning)
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    answer: Future[Client] = Future()

    def ask() -> None:
        try:
            client = Client(address, timeout=PATIENCE_S, set_as_default=False)
            _compare(client, address)
            answer.set_result(client)
        except Exception as error:
            answer.set_exception(error)

    # In a thread that can be left behind: Dask may wait for ever for a server of another kind.
    threading.Thread(target=ask, daemon=True).start()
    try:
        return answer.result(PATIENCE_S + 1.0)
    except UserError:
        raise
    except Exception as error:
        reason = str(error) or type(error).__name__
        if isinstance(error, Unanswered):
            reason = "what listens there does not answer as one"
        raise UserError(
            f"Dask scheduler {address!r} cannot be reached within {PATIENCE_S:g} s ({reason}); start one with "
            "'dask scheduler', or correct the address (host:8786, say)"
        ) from error


def _compare(client: Client, address: str) -> None:
    """Refuse a scheduler of other versions; workers look for themselves, with each task."""
    theirs, ours = _versions(client.run_on_scheduler), _versions(_here)
    for name, version in ours.items():
        if theirs[name] != version:
            client.close(timeout=PATIENCE_S)
            raise UserError(
                f"Dask scheduler {address} has {name} {theirs[name]}, this process {version}; give both the same"
            )


def _versions(call: Callable[..., str]) -> dict[str, str]:
    """What client and scheduler must have in common; `call` calls a function where the versions are asked for."""
    python = ".".join(call(platform.python_version).split(".")[:2])
    return {"Python": python, "distributed": call(importlib.metadata.version, "distributed")}


def _here(function: Callable[..., str], *arguments: str) -> str:
    return function(*arguments)
