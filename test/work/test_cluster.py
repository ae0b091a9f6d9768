"""A Dask cluster of real processes on this machine."""

from __future__ import annotations

import importlib.metadata
import os
import re
import socket
import sys
import threading
from pathlib import Path

import pytest
import work_tasks
from conftest import DaskCluster, wait_until

from xb_muscle_ros import plugins
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work import Options, TaskFailed, identity, run, scheduler, stream
from xb_muscle_ros.work import cluster as cluster_module


@pytest.mark.slow
def test_results_are_those_of_local_processes(cluster: DaskCluster) -> None:
    tasks = [{"model": "3state_coop", "calcium_um": 0.1 * i} for i in range(1, 7)]
    # Compiled once, not by four processes at once.
    here = [work_tasks.simulate(task) for task in tasks]
    remote = run(work_tasks.simulate, tasks, Options(scheduler=cluster.address))
    assert remote == run(work_tasks.simulate, tasks, Options(processes=2)) == here
    assert all(0.0 < forces[0] < 1.5 for forces in remote)
    assert len({forces[0] for forces in remote}) == len(tasks)


def test_awkward_floats(cluster: DaskCluster) -> None:
    remote = run(work_tasks.awkward_floats, range(9), Options(scheduler=cluster.address))
    local = run(work_tasks.awkward_floats, range(9), Options(processes=0))
    assert list(map(repr, remote)) == list(map(repr, local))


def test_the_work_is_done_by_the_workers(cluster: DaskCluster) -> None:
    ids = run(work_tasks.process, range(20), Options(scheduler=cluster.address))
    assert len(set(ids)) == 2
    assert os.getpid() not in ids


def test_a_journal_serves_both(cluster: DaskCluster, tmp_path: Path) -> None:
    tasks = [{"folder": str(tmp_path), "i": i} for i in range(6)]
    journal = tmp_path / "journal"
    remote = run(work_tasks.count, tasks[:4], Options(scheduler=cluster.address, journal=journal))
    assert run(work_tasks.count, tasks, Options(processes=2, journal=journal))[:4] == remote
    assert [work_tasks.marks(tmp_path, i) for i in range(6)] == [1] * 6


def test_a_killed_worker_loses_nothing(cluster: DaskCluster, tmp_path: Path) -> None:
    tasks = [{"folder": str(tmp_path), "i": i, "killed_at": 5} for i in range(20)]
    assert run(work_tasks.killed_once, tasks, Options(scheduler=cluster.address)) == [i**2 for i in range(20)]
    assert (tmp_path / "killed").exists()


def test_a_task_that_always_ends_its_worker_is_named(cluster: DaskCluster) -> None:
    with pytest.raises(UserError, match=r"^task work_tasks:always_killed of 'SIGKILL' was on 4 Dask workers that died"):
        run(work_tasks.always_killed, ["SIGKILL"], Options(scheduler=cluster.address))


def test_errors_of_tasks(cluster: DaskCluster, tmp_path: Path) -> None:
    options = Options(scheduler=cluster.address)
    with pytest.raises(UserError, match=r"^fibre x: parameter f is -1; allowed is above 0; correct the file$"):
        run(work_tasks.complain_at_three, range(6), options)
    with pytest.raises(TaskFailed, match=r"(?s)fail_at_three of 3 .*in fail_at_three.*a defect of"):
        run(work_tasks.fail_at_three, range(6), options)


def test_few_tasks_are_on_their_way(cluster: DaskCluster) -> None:
    drawn = []
    results = stream(
        work_tasks.complain_at_three,
        (drawn.append(i) or i for i in range(10, 1000)),
        Options(scheduler=cluster.address),
    )
    for count in range(1, 30):
        next(results)
        # Two for each of two workers, and one in the hand; what finished meanwhile comes on top.
        assert len(drawn) <= count + 10
    results.close()


def test_a_worker_of_another_environment_is_refused(cluster: DaskCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    ours = cluster_module.environment()
    monkeypatch.setattr(cluster_module, "environment", lambda: {**ours, "numpy": "0.1"})
    with pytest.raises(UserError, match=rf"^Dask worker tcp://\S+ has numpy {ours['numpy']} instead of 0\.1; give"):
        run(work_tasks.process, [0], Options(scheduler=cluster.address))


def test_a_scheduler_of_another_version_is_refused(cluster: DaskCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    theirs = importlib.metadata.version("distributed")
    monkeypatch.setattr(scheduler, "_here", lambda function, *of: "1.0" if of else function())
    with pytest.raises(UserError, match=rf"has distributed {theirs}, this process 1\.0; give both the same$"):
        run(work_tasks.process, [0], Options(scheduler=cluster.address))


@pytest.mark.parametrize("address", ["127.0.0.1", "nonsense://127.0.0.1:8786", ""])
def test_an_address_that_is_none(address: str) -> None:
    with pytest.raises(UserError, match=rf"^Dask scheduler '{address}' cannot be reached .* start one with"):
        run(work_tasks.process, [0], Options(scheduler=address))


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half a second to connect."""
    monkeypatch.setattr(scheduler, "PATIENCE_S", 0.5)


@pytest.mark.usefixtures("impatient")
def test_nobody_at_the_address() -> None:
    with socket.socket() as taken:
        # Bound, but nobody listens.
        taken.bind(("127.0.0.1", 0))
        with pytest.raises(UserError, match=r"cannot be reached within 0\.5 s \(Timed out .*start one with"):
            run(work_tasks.process, [0], Options(scheduler=f"127.0.0.1:{taken.getsockname()[1]}"))


@pytest.mark.usefixtures("impatient")
def test_somebody_else_at_the_address() -> None:
    answer = r"cannot be reached within 0\.5 s \(what listens there does not answer"
    with socket.create_server(("127.0.0.1", 0)) as server, pytest.raises(UserError, match=answer):
        run(work_tasks.process, [0], Options(scheduler=f"127.0.0.1:{server.getsockname()[1]}"))


def test_nothing_is_connected_to_where_the_journal_has_all(tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    run(work_tasks.complain_at_three, [1, 2], Options(processes=0, journal=journal))
    assert run(work_tasks.complain_at_three, [1, 2], Options(scheduler="nowhere:1", journal=journal)) == [1, 2]


def test_a_cluster_with_another_package(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "xb_muscle_ros").mkdir()
    (tmp_path / "xb_muscle_ros" / "__init__.py").touch()
    other = DaskCluster(tmp_path, path=[tmp_path], workers=["--nthreads", "2"])
    complaint = r"^Dask worker tcp://\S+ cannot load the package \(.*xb_muscle_ros.*\); install"
    try:
        # The second run meets a worker that is there from the start, and so has something to say of its threads.
        for _ in range(2):
            with pytest.raises(UserError, match=complaint):
                run(work_tasks.process, [0], Options(scheduler=other.address))
    finally:
        other.close()
    said = capsys.readouterr().err
    # Whether the first run meets it as well is a matter of when its worker started.
    # A slow worker is waited for, which is said as well.
    told = [line for line in said.splitlines() if "has no workers" not in line]
    assert 1 <= len(told) <= 2
    for line in told:
        assert re.search(r"^xb_muscle: Dask worker tcp://\S+ has 2 threads, .* with --nthreads 1 --nworkers N$", line)


@pytest.mark.slow
def test_a_cluster_without_workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cluster_module, "_ALONE_S", 0.5)
    empty = DaskCluster(tmp_path, workers=None)
    said = []

    def start_workers_once_asked() -> None:
        wait_until(lambda: said.append(capsys.readouterr().err) or said[-1], "nothing was said")
        empty.start_workers("--nthreads", "1")

    starter = threading.Thread(target=start_workers_once_asked)
    starter.start()
    try:
        assert run(work_tasks.complain_at_three, [1, 2], Options(scheduler=empty.address)) == [1, 2]
    finally:
        starter.join()
        empty.close()
    said.append(capsys.readouterr().err)
    assert "".join(said).startswith(f"xb_muscle: waiting: Dask scheduler {empty.address} has no workers; start some")
    assert "".join(said).count("\n") == 1


def test_without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UserError, match=r"--scheduler needs Dask.*pip install 'xb_muscle_ros\[dask\]'"):
        run(work_tasks.process, [0], Options(scheduler="127.0.0.1:8786"))


MINE = """
from xb_muscle_ros.mechanisms import Entry, Extra, Parameter


class MyDrag(Extra):
    name = "my_drag_of_mine"
    parameters = (Parameter("my_drag", "F0 s/L0", "drag", 0.0, 10.0, 0.0, "this test"),)
    entry = Entry("mine", "my drag", "a drag of my own", "my_drag", 0.02, starts=({"my_drag": 0.01},))

    def force(self, q):
        return q.my_drag * q.velocity
"""


@pytest.mark.slow
def test_mechanisms_from_outside_go_along_to_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "mine.py").write_text(MINE, encoding="utf-8")
    workers = DaskCluster(tmp_path)
    try:
        monkeypatch.setenv(plugins.VARIABLE, str(tmp_path / "mine"))
        identity.environment.cache_clear()
        for options in (Options(scheduler=workers.address), Options(processes=2)):
            assert run(work_tasks.last_mechanism, range(4), options) == ["my_drag_of_mine"] * 4
        monkeypatch.delenv(plugins.VARIABLE)
        identity.environment.cache_clear()
        with pytest.raises(UserError, match=r"has mechanisms from outside \w{16} instead of none; .* start them anew$"):
            run(work_tasks.last_mechanism, range(4), Options(scheduler=workers.address))
    finally:
        identity.environment.cache_clear()
        workers.close()
