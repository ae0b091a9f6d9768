"""What a caller of work sees, wherever the work is done."""

from __future__ import annotations

import itertools
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import pytest
import work_tasks

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.work import Options, TaskFailed, run, stream
from xb_muscle_ros.work.local import cores

PLACES = pytest.mark.parametrize("processes", [0, 2], ids=["here", "processes"])


@PLACES
def test_results_come_in_the_order_of_tasks(processes: int) -> None:
    assert run(work_tasks.complain_at_three, [5, 0, 7, 1], Options(processes=processes)) == [5, 0, 7, 1]


@PLACES
def test_a_task_may_run_tasks_of_its_own(processes: int) -> None:
    assert run(work_tasks.nested, [[1.0, 2.0], [7.0]], Options(processes=processes)) == [[1 / 3, 2 / 3], [7 / 3]]


@PLACES
def test_no_tasks(processes: int) -> None:
    assert run(work_tasks.complain_at_three, [], Options(processes=processes)) == []


@PLACES
def test_floats_are_those_of_the_function(processes: int) -> None:
    results = run(work_tasks.awkward_floats, range(5), Options(processes=processes))
    # As text: NaN equals nothing and -0 equals 0. JSON has no pairs.
    expected = [work_tasks.awkward_floats(i) | {"pair": [i, None]} for i in range(5)]
    assert list(map(repr, results)) == list(map(repr, expected))


@PLACES
def test_kept_results_are_those_of_the_function(processes: int, tmp_path: Path) -> None:
    options = Options(processes=processes, journal=tmp_path / "journal")
    first = run(work_tasks.awkward_floats, range(5), options)
    assert list(map(repr, run(work_tasks.awkward_floats, range(5), options))) == list(map(repr, first))


@PLACES
def test_what_a_user_can_mend_is_the_same_line(processes: int) -> None:
    with pytest.raises(UserError) as caught:
        run(work_tasks.complain_at_three, range(6), Options(processes=processes))
    assert str(caught.value) == "fibre x: parameter f is -1; allowed is above 0; correct the file"


@PLACES
def test_an_error_with_arguments_of_its_own(processes: int) -> None:
    with pytest.raises(UserError, match=r"^fibre x: state n_on became 2 at t = 0\.5 s; .*use a smaller step$"):
        run(work_tasks.leave_allowed_states, [2], Options(processes=processes))


@PLACES
def test_a_defect_shows_where_it_happened(processes: int) -> None:
    with pytest.raises(TaskFailed, match=r"(?s)task work_tasks:fail_at_three of 3 .*in fail_at_three.*a defect of"):
        run(work_tasks.fail_at_three, range(6), Options(processes=processes))


@PLACES
def test_a_result_that_is_no_data_is_a_defect(processes: int) -> None:
    with pytest.raises(TaskFailed, match="not JSON serializable"):
        run(work_tasks.give_no_data, [1], Options(processes=processes))


@PLACES
def test_what_finished_before_an_error_is_kept(processes: int, tmp_path: Path) -> None:
    journal = tmp_path / "journal"
    with pytest.raises(UserError):
        run(work_tasks.complain_at_three, range(4), Options(processes=processes, journal=journal))
    kept = dict(stream(work_tasks.complain_at_three, range(3), Options(processes=0, journal=journal)))
    assert kept == {0: 0, 1: 1, 2: 2}
    # 0 and 1 were there: two processes had ended them before they could be given 3.
    assert len(journal.read_text().splitlines()) >= 1 + 2


@PLACES
def test_an_endless_generator_is_drawn_from_as_needed(processes: int) -> None:
    drawn = []

    def tasks() -> Iterator[int]:
        for i in itertools.count(10):
            drawn.append(i)
            yield i

    results = stream(work_tasks.complain_at_three, tasks(), Options(processes=processes))
    for count in range(1, 20):
        index, value = next(results)
        assert value == index + 10
        assert len(drawn) <= count + 2 + 1
    results.close()


def test_memory_does_not_grow_with_the_number_of_tasks(tmp_path: Path) -> None:
    def peak(number: int) -> int:
        tracemalloc.start()
        for _ in stream(work_tasks.long_text, range(number), Options(processes=0)):
            pass
        try:
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(10)
    # 100 kB a result.
    assert peak(200) < peak(20) + 1_000_000


@pytest.mark.parametrize("function", [lambda i: i, print, list], ids=["lambda", "builtin", "class"])
def test_a_function_that_others_cannot_import(function: object) -> None:
    with pytest.raises(TypeError, match="not a function of a module"):
        run(function, [1])


def test_a_task_that_is_no_data(tmp_path: Path) -> None:
    with pytest.raises(TypeError):
        run(work_tasks.complain_at_three, [{1}], Options(journal=tmp_path / "journal"))


def test_processes_by_default_are_the_cores_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {3, 5, 9})
    assert cores() == 3


def test_one_line_where_there_is_no_terminal(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = Options(processes=0, journal=tmp_path / "journal", label="fit")
    run(work_tasks.complain_at_three, [0, 1], options)
    run(work_tasks.complain_at_three, [0, 1, 2], options)
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("fit: 2 computed in ")
    assert second.startswith(f"fit: 2 from {tmp_path / 'journal'}, 1 computed in ")
    run(work_tasks.complain_at_three, [0], Options(processes=0))
    run(work_tasks.complain_at_three, [0], Options(processes=0, label="fit", quiet=True))
    assert capsys.readouterr().err == ""
