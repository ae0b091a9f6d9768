"""What a Dask worker does with a task."""

from __future__ import annotations

from collections.abc import Callable


def performer() -> Callable[[bytes, dict[str, str], dict[str, str]], tuple[str, ...]]:
    """The function that carries out a task on a worker.

    It is a local function, because those travel whole instead of by name: so it can speak even on a worker that lacks
    this package, and the scheduler need not have it.
    """

    def perform(payload: bytes, environment: dict[str, str], mechanisms: dict[str, str]) -> tuple[str, ...]:
        """Carry out a task, if this worker would come to the result that the caller would come to.

        Args:
            payload: see `attempt`.
            environment: the caller's, see `identity.environment`.
            mechanisms: the caller's own, see `plugins.texts`; a worker takes those of the first task it has.

        Returns:
            kind and text of the `Outcome`.
        """
        from distributed import get_worker

        worker = f"Dask worker {get_worker().address}"
        try:
            from xb_muscle_ros import plugins
            from xb_muscle_ros.work.identity import differences
            from xb_muscle_ros.work.outcome import attempt
        except ImportError as error:
            return (
                "user_error",
                f"{worker} cannot load the package ({error}); install this process's xb_muscle_ros there",
            )
        if mechanisms and not plugins.files():
            plugins.use(mechanisms)
        unlike = differences(environment)
        if unlike:
            return (
                "user_error",
                f"{worker} has {unlike}; give workers the same environment as this process, or start them anew",
            )
        return tuple(attempt(payload))

    return perform
