"""The executor that costs least, where this rclpy has it."""

# mypy: allow-untyped-calls

from __future__ import annotations

from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.utilities import get_default_context


def make_executor(context: Any = None) -> Any:
    """Return an executor to be driven by ``spin_once(timeout_sec=...)``, single-threaded.

    The one driven by events answers in two thirds of the time, but early releases of Jazzy do not have it, and its
    ``spin`` without a timeout does not return.
    """
    context = context or get_default_context()
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)
