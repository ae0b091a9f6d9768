"""Processes of this machine that carry out tasks; one that is killed is replaced and its task done again."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work.backend import Backend, Function
from xb_muscle_ros.work.identity import describe
from xb_muscle_ros.work.outcome import Outcome, attempt

_PATIENCE_S = 5.0
# A task may lose this many workers; a worker that cannot even start is tried as often.
_LIVES = 3
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass
class _Job:
    index: int
    task: object
    deaths: int = 0


@dataclass
class _Worker:
    process: SpawnProcess
    job: _Job | None = None
    started: bool = False


class Pool(Backend):
    """See `backend.Backend`. Processes are started (spawned, not forked) as there is work for them."""

    def __init__(self, function: Function, processes: int) -> None:
        """An empty pool for a function, of up to so many processes."""
        self._function = function
        self._processes = processes
        self._waiting: deque[_Job] = deque()
        self._workers: dict[Connection, _Worker] = {}
        self._false_starts = 0

    def busy(self) -> int:
        return len(self._waiting) + sum(worker.job is not None for worker in self._workers.values())

    def full(self) -> bool:
        return self.busy() >= self._processes

    def submit(self, index: int, task: object) -> None:
        self._waiting.append(_Job(index, task))
        self._hand_out()

    def collect(self) -> list[tuple[int, Outcome]]:
        found: list[tuple[int, Outcome]] = []
        while not found:
            for pipe in wait(list(self._workers)):
                assert isinstance(pipe, Connection)
                found += self._hear(pipe)
            self._hand_out()
        return found

    def _hand_out(self) -> None:
        """Give every waiting job to an idle worker, and start workers as long as there may be more."""
        while self._waiting:
            idle = next((pipe for pipe, worker in self._workers.items() if worker.job is None), None)
            if idle is None:
                if len(self._workers) >= self._processes:
                    return
                idle = self._start()
            job = self._workers[idle].job = self._waiting.popleft()
            # If it has just died, `collect` hears of that.
            with contextlib.suppress(OSError):
                idle.send_bytes(pickle.dumps((self._function, job.task)))

    def _start(self) -> Connection:
        context = multiprocessing.get_context("spawn")
        # Else the first start would start it, and lift the block on interrupts half-way.
        resource_tracker.ensure_running()
        ours, theirs = context.Pipe()
        process = context.Process(target=serve, args=(theirs,), daemon=True)
        with _uninterrupted(), _one_thread_each(), _without_main(self._function.__module__):
            process.start()
            self._workers[ours] = _Worker(process)
        theirs.close()
        return ours

    def _hear(self, pipe: Connection) -> list[tuple[int, Outcome]]:
        """What a worker that has something to say says: that it is there, an outcome, or that it is no more."""
        worker = self._workers[pipe]
        try:
            outcome: Outcome | None = pipe.recv()
        except (EOFError, OSError):
            return self._bury(pipe)
        if outcome is None:
            worker.started = True
            self._false_starts = 0
            return []
        job, worker.job = worker.job, None
        assert job is not None
        return [(job.index, outcome)]

    def _bury(self, pipe: Connection) -> list[tuple[int, Outcome]]:
        """Let a dead worker go; its job waits again, unless it has lost its workers too often."""
        worker = self._workers.pop(pipe)
        pipe.close()
        _end([worker.process], _PATIENCE_S)
        end = _how_it_ended(worker.process.exitcode)
        job = worker.job
        if not worker.started:
            self._false_starts += 1
            if self._false_starts >= _LIVES:
                raise UserError(
                    f"{_LIVES} worker processes ended before they could work, the last with {end}; what they wrote is "
                    "above; a script that calls this must do so under: if __name__ == '__main__'"
                )
        elif job is not None:
            job.deaths += 1
            if job.deaths >= _LIVES:
                return [(job.index, Outcome("user_error", _complaint(job, self._function, end)))]
        if job is not None:
            self._waiting.appendleft(job)
        return []

    def __exit__(self, *_: object) -> None:
        processes = [worker.process for worker in self._workers.values()]
        for pipe, worker in self._workers.items():
            if worker.job is not None:
                worker.process.terminate()
            pipe.close()
        self._workers.clear()
        _end(processes, _PATIENCE_S)


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def _end(processes: list[SpawnProcess], patience_s: float) -> None:
    """Wait for processes that are to end by themselves, and end by force those that do not."""
    try:
        for process in processes:
            process.join(patience_s)
    finally:
        for process in processes:
            if process.is_alive():
                process.kill()
                process.join()


def _how_it_ended(code: int | None) -> str:
    if code is None or code >= 0:
        return f"exit code {code}"
    try:
        return f"signal {signal.Signals(-code).name}"
    except ValueError:
        return f"signal {-code}"


def _complaint(job: _Job, function: Function, end: str) -> str:
    remedy = "the system kills so when memory runs out: give fewer --processes or more memory"
    if end != "signal SIGKILL":
        remedy = "see what it wrote above, and run the task alone with --processes 0"
    return f"{describe(function, job.task)} ended its worker process {job.deaths} times, the last with {end}; {remedy}"


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Put interrupts off to the end; a process that is started meanwhile blocks them until it says otherwise."""
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    arrived: list[int] = []
    # The block is this thread's: with other threads about, an interrupt still gets through to Python's own handler.
    handled = threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is not None
    handler = signal.signal(signal.SIGINT, lambda number, _: arrived.append(number)) if handled else None
    try:
        yield
    finally:
        if handled:
            signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if arrived:
            signal.raise_signal(signal.SIGINT)


@contextlib.contextmanager
def _without_main(module: str) -> Iterator[None]:
    """Let processes that start in the block leave the user's script alone, unless the function comes from it.

    Else they would run it anew up to its `if __name__ == "__main__"`, which scripts and notebooks may be without.
    """
    main = vars(sys.modules["__main__"])
    names: tuple[str, ...] = ("__file__", "__spec__")
    before = {name: main[name] for name in names if name in main}
    if module != "__main__":
        main.pop("__file__", None)
        main["__spec__"] = None
    try:
        yield
    finally:
        main.update(before)


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Environment for processes of one thread; libraries read it as they are loaded."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def serve(pipe: Connection) -> None:
    """Say that it is there (None), then answer every payload with its outcome.

    An interrupt at the terminal reaches this process too; what is to happen then is the parent's business.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT])
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        pipe.send(None)
        while True:
            pipe.send(attempt(pipe.recv_bytes()))
    except (EOFError, OSError):
        # The parent has closed its end, or is no more.
        return


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        # Even in the middle of a task: nobody is left to take its result.
        os._exit(1)
