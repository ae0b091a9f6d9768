"""A Dask cluster that carries out tasks; it runs again what a lost worker leaves."""

from __future__ import annotations

import contextlib
import math
import queue
import sys
import time
import uuid
from collections.abc import Callable
from concurrent.futures import CancelledError
from typing import TYPE_CHECKING, Any

from xb_muscle_ros import plugins
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.work.backend import Backend, Function
from xb_muscle_ros.work.identity import describe, environment
from xb_muscle_ros.work.outcome import Outcome
from xb_muscle_ros.work.scheduler import PATIENCE_S, connect

if TYPE_CHECKING:
    from distributed import Future

_RETRIES = 3
_LOOK_S = 1.0
# So long nobody may be connected before the user is told that the work waits.
_ALONE_S = 5.0


class Cluster(Backend):
    """See `backend.Backend`. A task's function is looked up on the worker, under its module's name."""

    def __init__(self, function: Function, address: str, progress: Progress, quiet: bool) -> None:
        """Connect to a scheduler.

        Raises:
            UserError: see `connect`.
        """
        self._function, self._address, self._progress, self._quiet = function, address, progress, quiet
        self._client = connect(address)
        self._perform, self._mechanisms = _performer(), plugins.texts()
        self._name = f"xb_muscle-{uuid.uuid4().hex}"
        self._flying: dict[str, tuple[int, object, Future]] = {}
        self._finished: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._workers = 0
        self._advised = False
        self._looked_s = -math.inf
        self._alone_since_s = time.monotonic()

    def busy(self) -> int:
        return len(self._flying)

    def full(self) -> bool:
        self._look()
        # The next task is to be there when a worker ends one.
        return len(self._flying) >= 2 * max(self._workers, 1)

    def submit(self, index: int, task: object) -> None:
        import cloudpickle

        key = f"{self._name}-{index}"
        # In bytes: Dask would look into a task for names of its own. And functions of a script go as what they are.
        payload = cloudpickle.dumps((self._function, task))
        future = self._client.submit(
            self._perform, payload, environment(), self._mechanisms, key=key, pure=False, retries=_RETRIES
        )
        # With the future: Dask drops the work of one that nobody holds.
        self._flying[key] = index, task, future
        future.add_done_callback(self._finished.put)

    def collect(self) -> list[tuple[int, Outcome]]:
        while True:
            # With an end, so that an interrupt and a missing worker are noticed.
            with contextlib.suppress(queue.Empty):
                futures = [self._finished.get(timeout=_LOOK_S)]
                futures += [self._finished.get() for _ in range(self._finished.qsize())]
                return self._outcomes(futures)
            self._look()

    def _outcomes(self, futures: list[Future]) -> list[tuple[int, Outcome]]:
        # Results that are there come in one go: one by one, the way there and back would limit a large cluster.
        there = [future for future in futures if future.status == "finished"]
        results: dict[str, Any] = {}
        # What fails on the way is asked for again below, by itself.
        with contextlib.suppress(Exception):
            results = {future.key: result for future, result in zip(there, self._client.gather(there), strict=True)}
        found = []
        for future in futures:
            index, task, _ = self._flying.pop(future.key)
            result = results.get(future.key)
            found.append((index, Outcome(*result) if result is not None else self._read(future, task)))
        return found

    def _read(self, future: Future, task: object) -> Outcome:
        from distributed import KilledWorker

        try:
            return Outcome(*future.result())
        except KilledWorker as error:
            text = (
                f"{describe(self._function, task)} was on {error.allowed_failures + 1} Dask workers that died, the "
                f"last was {error.last_worker.address}: it ended them, or what ran beside it did; see the worker's "
                "log, and give workers more memory if that ran out"
            )
        except CancelledError:
            text = (
                f"Dask scheduler {self._address} was lost; start it and its workers again, then this command: what a "
                "journal has kept is not computed again"
            )
        except Exception as error:
            text = (
                f"Dask scheduler {self._address} gave up {describe(self._function, task)} "
                f"({type(error).__name__}: {error}); see its log and start again"
            )
        return Outcome("user_error", text)

    def _look(self) -> None:
        """See now and then who is connected, and tell the user what is amiss with that, once."""
        now = time.monotonic()
        if now - self._looked_s < _LOOK_S:
            return
        self._looked_s = now
        # A scheduler that is gone makes itself heard in the futures.
        with contextlib.suppress(OSError):
            threads = self._client.nthreads()
            self._workers = len(threads)
            crowded = next((address for address, count in threads.items() if count > 1), None)
            if crowded is not None and not self._advised:
                self._advised = True
                self._say(
                    f"Dask worker {crowded} has {threads[crowded]} threads, but one process does one task at a time; "
                    "to use all cores, start it with --nthreads 1 --nworkers N"
                )
        if self._workers:
            self._alone_since_s = now
        elif now - self._alone_since_s > _ALONE_S:
            self._alone_since_s = math.inf
            self._say(
                f"waiting: Dask scheduler {self._address} has no workers; start some with: "
                f"dask worker {self._address} --nthreads 1 --nworkers N"
            )

    def _say(self, line: str) -> None:
        if not self._quiet:
            self._progress.write(f"xb_muscle: {line}", sys.stderr)

    def __exit__(self, *_: object) -> None:
        # What is under way is of no use to anybody once its client has gone.
        self._client.close(timeout=PATIENCE_S)


def _performer() -> Callable[[bytes, dict[str, str], dict[str, str]], tuple[str, ...]]:
    """The function that carries out a task on a worker, if the worker would come to the caller's result.

    It takes what `attempt` takes, the caller's `environment`, and its mechanisms as `plugins.texts` gives them, which a
    worker takes with its first task; it gives kind and text of the `Outcome`. It is a local function, because those
    travel whole instead of by name: so it can speak even on a worker that lacks this package, and the scheduler need
    not have it.
    """

    def perform(payload: bytes, environment: dict[str, str], mechanisms: dict[str, str]) -> tuple[str, ...]:
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
