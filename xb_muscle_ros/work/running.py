"""Tasks in, results out."""

from __future__ import annotations

import contextlib
import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from xb_muscle_ros.progress import Progress
from xb_muscle_ros.work.backend import Backend, Function, Here
from xb_muscle_ros.work.identity import Keys, name_of
from xb_muscle_ros.work.journal import Journal

# What JSON can hold; what comes back has lists for sequences and dicts for mappings.
JsonValue: TypeAlias = "bool | int | float | str | Sequence[JsonValue] | Mapping[str, JsonValue] | None"
T = TypeVar("T")
R = TypeVar("R", bound=JsonValue)


@dataclass(frozen=True)
class Options:
    """Where work is done and what is kept of it; results do not depend on it.

    Attributes:
        scheduler: address of a Dask scheduler (``tcp://host:8786``); None for processes of this machine.
        processes: how many processes of this machine; None for one per core this process may use, 0 for this very
            process (to debug or profile a task; it may have several threads for linear algebra, which then may differ
            from that of workers in the last digit).
        journal: file that keeps finished results; a later run takes them from there. Made if need be.
        label: shown before the progress bar.
        quiet: nothing on stderr.
    """

    scheduler: str | None = None
    processes: int | None = None
    journal: Path | None = None
    label: str = ""
    quiet: bool = False


def run(function: Callable[[T], R], tasks: Iterable[T], options: Options | None = None) -> list[R]:
    """Results of a function for many tasks, in the order of the tasks.

    See `stream` for the arguments, what is raised and what a result is.
    """
    results = dict(stream(function, tasks, options))
    return [results[index] for index in range(len(results))]


def stream(function: Callable[[T], R], tasks: Iterable[T], options: Options | None = None) -> Iterator[tuple[int, R]]:
    """Results of a function for many tasks as they finish: pairs of a task's place and its result.

    Memory does not grow with the number of tasks, but for the keys in a journal: tasks may be a generator, and only so
    many are on their way as keep everybody busy.

    Args:
        function: a function of a module whose result depends on its argument alone.
        tasks: plain data (what JSON can hold) that says everything a result depends on. The name of a file is not what
            the file holds: a file that changes under its name meets the journal's old result.
        options: where to work, and where to keep results; default: local processes, nothing is kept.

    Returns:
        results as JSON gives them back (a tuple becomes a list, the keys of a dict strings); floats bit for bit.

    Raises:
        UserError: a task raised it, a task killed its worker again and again, the journal cannot be used, the
            scheduler cannot be reached, or its workers are not as this process. Results finished before are kept.
        TaskFailed: a task raised anything else.
        TypeError: the function or a task is not of the kind asked for.
    """
    name_of(function)
    options = options or Options()
    with contextlib.ExitStack() as stack:
        work = _Run(function, tasks, options, stack)
        yield from work.results()
    work.tell()


class _Run:
    """One call of `stream`: what it has open, and how far it has come."""

    def __init__(self, function: Function, tasks: Iterable[Any], options: Options, stack: contextlib.ExitStack) -> None:
        self._function, self._tasks, self._options, self._stack = function, tasks, options, stack
        self._start_s = time.monotonic()
        self._computed = self._kept = 0
        self._journal = stack.enter_context(Journal(options.journal)) if options.journal is not None else None
        total = len(tasks) if isinstance(tasks, Sized) else None
        self._progress = stack.enter_context(Progress(total, options.label, options.quiet))
        self._keys: dict[int, str] = {}

    def results(self) -> Iterator[tuple[int, Any]]:
        """See `stream`. Nothing is started before there is a task that the journal does not have."""
        keys = Keys(self._function)
        backend: Backend | None = None
        for index, task in enumerate(self._tasks):
            if self._journal is not None:
                key = keys.of(task)
                if key in self._journal:
                    self._progress.skip()
                    self._kept += 1
                    yield index, self._journal[key]
                    continue
                self._keys[index] = key
            backend = backend or self._stack.enter_context(self._backend())
            while backend.full():
                yield from self._collected(backend)
            backend.submit(index, task)
        while backend is not None and backend.busy():
            yield from self._collected(backend)

    def tell(self) -> None:
        """Where there was no bar, say in one line what was done."""
        if self._options.quiet or not self._options.label or self._progress.shown:
            return
        kept = f"{self._kept} from {self._options.journal}, " if self._kept else ""
        took = time.monotonic() - self._start_s
        print(f"{self._options.label}: {kept}{self._computed} computed in {took:.1f} s", file=sys.stderr)

    def _collected(self, backend: Backend) -> Iterator[tuple[int, Any]]:
        """What has finished; all of it is kept before anything is handed out or raised."""
        outcomes = backend.collect()
        done = {index: outcome.text for index, outcome in outcomes if outcome.kind == "done"}
        if self._journal is not None:
            for index, text in done.items():
                self._journal.add(self._keys.pop(index), text)
        for index, text in done.items():
            self._progress.update()
            self._computed += 1
            yield index, json.loads(text)
        for _, outcome in outcomes:
            if outcome.kind != "done":
                raise outcome.error()

    def _backend(self) -> Backend:
        """What the options ask for; loaded only then, since Dask may be missing."""
        if self._options.scheduler is not None:
            from xb_muscle_ros.work.cluster import Cluster

            return Cluster(self._function, self._options.scheduler, self._progress, self._options.quiet)
        if self._options.processes == 0:
            return Here(self._function)
        from xb_muscle_ros.work.local import Pool, cores

        return Pool(self._function, self._options.processes or cores())
