"""Functions that other processes can import, and a Dask cluster of real processes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PATIENCE_S = 30.0

# Workers get this path, and so find work_tasks.
sys.path.insert(0, str(HERE))


def child_environment(path: Sequence[Path] = (ROOT, HERE)) -> dict[str, str]:
    """Environment of a process that imports from some folders first: by default the package and work_tasks."""
    paths = [*map(str, path), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def wait_until(holds: Callable[[], object], what: str) -> None:
    """Wait for a condition; fail if it takes too long."""
    end = time.monotonic() + PATIENCE_S
    while not holds():
        assert time.monotonic() < end, what
        time.sleep(0.02)


class DaskCluster:
    """A scheduler and workers on loopback; workers are processes that are replaced when killed.

    Attributes:
        address: of the scheduler.
    """

    def __init__(
        self,
        folder: Path,
        path: Sequence[Path] = (ROOT, HERE),
        workers: Sequence[str] | None = ("--nthreads", "1", "--nworkers", "2"),
    ) -> None:
        """Start them; with `workers` None the scheduler alone."""
        self._folder = folder
        self._environment = child_environment(path)
        self._processes: list[subprocess.Popen[bytes]] = []
        file = folder / "scheduler.json"
        self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
        # The file is there before it is written.
        wait_until(lambda: file.exists() and file.read_text().endswith("}"), "the scheduler did not start")
        self.address: str = json.loads(file.read_text())["address"]
        if workers is not None:
            self.start_workers(*workers)

    def start_workers(self, *options: str) -> None:
        """Start workers."""
        self._start("worker", self.address, "--host", "127.0.0.1", *options)

    def _start(self, program: str, *arguments: str) -> None:
        command = [sys.executable, "-m", f"distributed.cli.dask_{program}", "--no-dashboard", *arguments]
        with (self._folder / f"{program}.log").open("wb") as log:
            self._processes.append(
                subprocess.Popen(
                    command,
                    cwd=self._folder,
                    env=self._environment,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                )
            )

    def close(self) -> None:
        """End workers, then the scheduler."""
        for process in reversed(self._processes):
            process.terminate()
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@pytest.fixture(scope="session")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskCluster]:
    """A Dask cluster that all tests share."""
    made = DaskCluster(tmp_path_factory.mktemp("dask"))
    yield made
    made.close()
