"""Local processes: killed, interrupted, left alone."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import work_tasks
from conftest import child_environment, wait_until
from interruptible import TASKS, tasks

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work import Options, TaskFailed, run, stream
from xb_muscle_ros.work.local import Pool, _uninterrupted

HERE = Path(__file__).resolve().parent
SLEEP_S = 0.2


def test_a_killed_worker_loses_nothing(tmp_path: Path) -> None:
    tasks = [{"folder": str(tmp_path), "i": i, "killed_at": 3} for i in range(8)]
    assert run(work_tasks.killed_once, tasks, Options(processes=2)) == [i**2 for i in range(8)]
    assert (tmp_path / "killed").exists()


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("SIGKILL", "with signal SIGKILL; .* memory"),
        ("SIGSEGV", "with signal SIGSEGV; .* --processes 0"),
        ("exit", "with exit code 7; .* --processes 0"),
    ],
)
def test_a_task_that_always_ends_its_worker_is_named(how: str, words: str) -> None:
    with pytest.raises(UserError, match=f"^task work_tasks:always_killed of '{how}' ended .* 3 times, .*{words}"):
        run(work_tasks.always_killed, [how], Options(processes=2))


def test_a_worker_killed_while_idle_is_replaced() -> None:
    with Pool(work_tasks.process, 1) as pool:
        pool.submit(0, 0)
        ((_, outcome),) = pool.collect()
        os.kill(int(outcome.text), signal.SIGKILL)
        pool.submit(1, 0)
        ((index, second),) = pool.collect()
    assert (index, second.kind) == (1, "done")
    assert second.text != outcome.text


def test_workers_are_processes_of_one_thread() -> None:
    before = dict(os.environ)
    ids = run(work_tasks.process, range(6), Options(processes=2))
    assert len(set(ids)) == 2
    assert os.getpid() not in ids
    (told,) = run(work_tasks.threads, [0], Options(processes=1))
    assert set(told.values()) == {"1"}
    assert dict(os.environ) == before


def test_no_more_workers_than_tasks() -> None:
    with Pool(work_tasks.process, 8) as pool:
        pool.submit(0, 0)
        pool.collect()
        pool.submit(1, 0)
        pool.collect()
        assert len(pool.__dict__["_workers"]) == 1


def test_a_stream_that_is_left_ends_its_workers() -> None:
    results = stream(work_tasks.process, range(100), Options(processes=2))
    _, worker = next(results)
    results.close()
    with pytest.raises(ProcessLookupError):
        os.kill(worker, 0)


def test_a_function_the_workers_cannot_find(monkeypatch: pytest.MonkeyPatch) -> None:
    # As in a console, whose functions are in no file.
    monkeypatch.setattr(work_tasks.process, "__module__", "nowhere")
    monkeypatch.setitem(sys.modules, "nowhere", work_tasks)
    with pytest.raises(TaskFailed, match=r"(?s)cannot be loaded where it is to run.*No module named 'nowhere'"):
        run(work_tasks.process, [0], Options(processes=1))


def _script(folder: Path, text: str) -> subprocess.CompletedProcess[str]:
    script = folder / "script.py"
    script.write_text(text)
    return subprocess.run([sys.executable, script], env=child_environment(), capture_output=True, text=True, timeout=60)


def test_a_script_needs_no_guard_for_functions_of_modules(tmp_path: Path) -> None:
    text = "import work_tasks\nfrom xb_muscle_ros.work import run\nprint(len(run(work_tasks.process, range(2))))\n"
    done = _script(tmp_path, text)
    assert (done.stdout, done.returncode) == ("2\n", 0)


def test_a_script_without_a_guard_for_its_own_function_is_told_so(tmp_path: Path) -> None:
    text = "from xb_muscle_ros.work import run\ndef own(task):\n    return task\nrun(own, range(2))\n"
    done = _script(tmp_path, text)
    assert "if __name__ == '__main__'" in done.stderr.splitlines()[-1]


@contextlib.contextmanager
def at_work(tmp_path: Path, sleep_s: float) -> Iterator[subprocess.Popen[str]]:
    """The script in a process group of its own, which is empty at the end or else made so."""
    (tmp_path / "marks").mkdir(exist_ok=True)
    command = [sys.executable, HERE / "interruptible.py", tmp_path / "marks", tmp_path / "journal", str(sleep_s)]
    process = subprocess.Popen(
        command, env=child_environment(), start_new_session=True, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def group_is_gone(group: int) -> bool:
    """Whether no process of a group is left, but for dead ones that the system has yet to clear away."""
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, its_group = stat.read_text().rpartition(") ")[2].split()[:3]
            if int(its_group) == group and state != "Z":
                return False
    return True


def kept(tmp_path: Path) -> int:
    """How many results the journal has."""
    journal = tmp_path / "journal"
    return max(journal.read_bytes().count(b"\n") - 1, 0) if journal.exists() else 0


def resume(tmp_path: Path) -> list[Any]:
    """The rest of the script's work, here."""
    options = Options(processes=0, journal=tmp_path / "journal")
    return run(work_tasks.count, tasks(str(tmp_path / "marks"), SLEEP_S), options)


@pytest.mark.slow
def test_an_interrupt_ends_all_and_keeps_what_is_done(tmp_path: Path) -> None:
    with at_work(tmp_path, SLEEP_S) as process:
        wait_until(lambda: kept(tmp_path) >= 3, "no results")
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(10) == 130
        wait_until(lambda: group_is_gone(process.pid), "processes are left")
        assert process.stderr is not None
        assert process.stderr.read() == ""
    done = kept(tmp_path)
    assert 3 <= done < TASKS
    begun = sum(1 for _ in (tmp_path / "marks").iterdir())
    assert resume(tmp_path) == [i / 7 for i in range(TASKS)]
    assert sum(1 for _ in (tmp_path / "marks").iterdir()) == begun + TASKS - done


@pytest.mark.parametrize("delay_s", [0.0, 0.02, 0.06, 0.1, 0.3, 0.5])
def test_an_interrupt_at_the_start(tmp_path: Path, delay_s: float) -> None:
    with at_work(tmp_path, 30.0) as process:
        # Once it has got past the imports; what happens while Python itself starts is not ours.
        wait_until((tmp_path / "journal").exists, "did not start")
        time.sleep(delay_s)
        os.killpg(process.pid, signal.SIGINT)
        assert process.wait(10) == 130
        wait_until(lambda: group_is_gone(process.pid), "processes are left")
        assert process.stderr is not None
        assert process.stderr.read() == ""


def test_an_interrupt_while_a_worker_is_being_started_comes_afterwards(request: pytest.FixtureRequest) -> None:
    # See interruptible.py.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    request.addfinalizer(lambda: signal.signal(signal.SIGINT, before))
    beside = threading.Thread(target=time.sleep, args=(0.3,))
    beside.start()
    done = []
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 - the interrupt belongs to the block's end
        with _uninterrupted():
            os.kill(os.getpid(), signal.SIGINT)
            beside.join()
            done.append("started")
        done.append("too late")
    assert done == ["started"]


def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    with at_work(tmp_path, 30.0) as process:
        wait_until(lambda: sum(1 for _ in (tmp_path / "marks").iterdir()) == 2, "no task was begun")
        process.kill()
        process.wait()
        wait_until(lambda: group_is_gone(process.pid), "workers are left")
