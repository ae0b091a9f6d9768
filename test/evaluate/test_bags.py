"""One bag through the models, and what a run keeps of many."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.evaluate import bags
from xb_muscle_ros.evaluate.curves import force_pca_of_trials
from xb_muscle_ros.evaluate.enhancement import Pair, enhancement_pairs, enhancement_task, evaluate_enhancement
from xb_muscle_ros.evaluate.request import Request
from xb_muscle_ros.evaluate.trials import MEASURED, Evaluated, Facts, Trials, srs_table
from xb_muscle_ros.scores.estimate import Estimate, Missing
from xb_muscle_ros.scores.force_pca import ForcePca
from xb_muscle_ros.trials.trial import Phase, Trial
from xb_muscle_ros.work.plain import from_plain

Maker = Callable[..., Path]


def found_in(*paths: Path, models: tuple[str, ...] | None = ("3state_coop",), **options: Any) -> list[Evaluated]:
    made = bags.tasks(Request(Path("out"), models=models, **options), list(paths), None)
    assert json.loads(json.dumps(made)) == made
    return [evaluated(task) for task in made]


def evaluated(task: dict[str, Any]) -> Evaluated:
    return from_plain(Evaluated, json.loads(json.dumps(bags.evaluate_bag(task), allow_nan=False)))


def rmsd(found: Evaluated, model: str = "3state_coop") -> dict[str, float | None]:
    return {name: found.scores[model][f"rmsd_{name}"].value for name in ("whole", "conditioning", "test")}


def compared(pair: Pair, path: Path) -> dict[str, Any]:
    (shared,) = bags.tasks(Request(Path("out"), measured_only=True), [path], None)
    return evaluate_enhancement(enhancement_task(pair, shared))


def test_a_constant_error_is_the_rmsd_of_every_window(make: Maker) -> None:
    (found,) = found_in(make(error_f0=0.02))
    assert rmsd(found) == pytest.approx({"whole": 0.02, "conditioning": 0.02, "test": 0.02}, abs=1e-9)
    model, measured = found.scores["3state_coop"], found.scores[MEASURED]
    assert measured["srs_test"].value == pytest.approx(model["srs_test"].value)
    assert measured["isometric_f0"].value == pytest.approx(model["isometric_f0"].value + 0.02)
    assert measured["k_tr"] == Estimate(None)


def test_reference_trials_have_no_conditioning_stretch(make: Maker) -> None:
    (found,) = found_in(make(amplitude_l0=0.0))
    assert rmsd(found)["conditioning"] is None
    assert found.scores[MEASURED]["srs_conditioning"].value is None
    assert found.scores[MEASURED]["srs_test"].value > 0.0


def test_models_without_a_set_are_named(make: Maker) -> None:
    (found,) = found_in(make(), models=("2state_coop", "2state"))
    assert (list(found.scores), found.missing) == ([MEASURED, "2state"], ["2state_coop"])


@pytest.mark.slow
def test_all_sets_of_the_fibre_file_without_a_choice(make: Maker) -> None:
    (found,) = found_in(make(), models=None)
    assert set(found.scores) == {MEASURED, "hill_se", "2state", "3state_coop", "3state_coop_v3", "4state_coop"}


def test_measured_only_needs_no_fibre_file(make: Maker, recorded: Callable[..., Trial]) -> None:
    trial = recorded()
    path = make(replace(trial, facts=replace(trial.facts, fibre="nobody")))
    assert list(found_in(path, measured_only=True)[0].scores) == [MEASURED]
    (found,) = found_in(path)
    assert found.problem == f"bag {path}: " + found.problem.partition(": ")[2]
    assert "fibre 'nobody' is not known" in found.problem


def test_a_bag_of_a_fibre_that_was_not_given(make: Maker, repo_root: Path) -> None:
    path = make()
    names = ("13Dec2017a", "7Aug2018a")
    files = {name: repo_root / "config" / "fibers" / f"{name}.yaml" for name in names}
    (task,) = bags.tasks(Request(Path("out")), [path], files)
    assert (
        "the bag's fibre is '18Dec2017a', the fibre files given are of 13Dec2017a, 7Aug2018a; give its file too"
        in evaluated(task).problem
    )


@pytest.mark.parametrize("name", ["mine", "7Aug2018a"])
def test_a_bag_of_another_fibre_takes_the_one_file_given(
    make: Maker, recorded: Callable[..., Trial], repo_root: Path, name: str
) -> None:
    """As a replay does; with two files there is nothing to choose by."""
    trial = recorded()
    path = make(replace(trial, facts=replace(trial.facts, fibre=name)))
    folder = repo_root / "config" / "fibers"
    files = {each: folder / f"{each}.yaml" for each in ("18Dec2017a", "13Dec2017a")}
    asked = Request(Path("out"), models=("3state_coop",))
    (task,) = bags.tasks(asked, [path], {"18Dec2017a": files["18Dec2017a"]})
    found = evaluated(task)
    assert found.facts is not None
    assert found.facts.fibre == name
    assert rmsd(found)["whole"] == pytest.approx(0.02, abs=1e-6)
    (task,) = bags.tasks(asked, [path], files)
    assert evaluated(task).unserved == name
    (task,) = bags.tasks(asked, [path], None)
    assert evaluated(task).unserved == ("mine" if name == "mine" else "")


def test_nan_in_a_bag_is_told_with_topic_and_time(make: Maker, recorded: Callable[..., Trial]) -> None:
    path = make()
    _poison(path)
    (found,) = found_in(path)
    assert found.problem.startswith(f"bag {path}: /muscle/measured_force, message ")
    assert "has the value nan; allowed are finite numbers" in found.problem


def _poison(path: Path) -> None:
    """Put a run of NaN into the stored forces of a bag: bytes of the effort, 8 at a time."""
    import struct

    from mcap.reader import make_reader
    from mcap.writer import Writer

    from xb_muscle_ros.trials import ros_types

    (file,) = path.glob("*.mcap")
    with file.open("rb") as stream:
        reader = make_reader(stream)
        entries = [(s, c, m) for s, c, m in reader.iter_messages()]
        metadata = list(reader.iter_metadata())
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "test")
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        count = 0
        for schema, channel, message in entries:
            assert schema is not None
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id], dict(channel.metadata)
                )
            data = message.data
            if channel.topic == ros_types.MEASURED_FORCE:
                count += 1
                if 50 <= count < 60:
                    data = data[:-8] + struct.pack("<d", float("nan"))
            writer.add_message(channels[channel.id], message.log_time, data, message.publish_time, message.sequence)
        for record in metadata:
            writer.add_metadata(record.name, record.metadata)
        writer.finish()


def test_a_mended_bag_is_another_task(make: Maker) -> None:
    path = make(error_f0=0.02)
    asked = Request(Path("out"))
    before = bags.tasks(asked, [path], None)
    assert bags.tasks(asked, [path], None) == before
    make(error_f0=0.03)
    assert bags.tasks(asked, [path], None) != before


def test_a_table_of_srs_is_made_of_trials(make: Maker) -> None:
    found = found_in(make(), make(amplitude_l0=0.0), make(pca=6.3), make(error_f0=0.1, recovery_s=0.1))
    trials = Trials(found)
    table = srs_table(trials, MEASURED, "measured")
    assert table is not None
    assert table.pca.tolist() == [6.1, 6.3]
    assert table.recovery_s.tolist() == [0.05, 0.1]
    assert table.amplitude_l0.tolist() == [0.0, 0.0383]
    test = table.fibres["18Dec2017a"].test
    assert test[0, 0, 1] == found[0].scores[MEASURED]["srs_test"].value
    assert test[0, 1, 1] == found[3].scores[MEASURED]["srs_test"].value
    assert np.isnan(test[1, 1]).all()
    assert srs_table(trials, "3state_coop", "m") is not None


def test_repeats_of_a_condition_are_averaged(make: Maker, recorded: Callable[..., Trial]) -> None:
    other = recorded(model="2state")
    found = found_in(make(), make(replace(other, facts=replace(other.facts, trial="again"))))
    table = srs_table(Trials(found), MEASURED, "measured")
    assert table is not None
    expected = 0.5 * (found[0].scores[MEASURED]["srs_test"].value + found[1].scores[MEASURED]["srs_test"].value)
    assert table.fibres["18Dec2017a"].test[0, 0, 0] == pytest.approx(expected)


def test_too_many_levels_leave_the_common_conditions() -> None:
    found = []
    for i in range(101):
        amplitude = 0.0383 if i == 100 else 0.01 + 1e-4 * i
        facts = Facts("", "f", str(i), 6.1, amplitude, 0.1, 1.0, 0.0, None, True, str(i))
        found.append(Evaluated(str(i), facts=facts, scores={MEASURED: {"srs_test": Estimate(float(i))}}))
    table = srs_table(Trials(found), MEASURED, "measured")
    assert table is not None
    assert table.amplitude_l0.tolist() == [0.0, 0.0012, 0.0038, 0.0121, 0.0383]
    assert table.fibres["f"].test[0, 0, 4] == 100.0


def test_duplicates_are_named(make: Maker, recorded: Callable[..., Trial]) -> None:
    trial = recorded()
    same_name = make(recorded(error_f0=0.05), name="b_same_name")
    same_samples = make(replace(trial, facts=replace(trial.facts, trial="other")), name="c_same_samples")
    paths = [make(trial, name="a"), same_name, same_samples]
    trials = Trials(found_in(*paths))
    lines = trials.problems
    told = f"bag {same_name}: trial {trial.facts.trial} of fibre 18Dec2017a is in {paths[0]} already"
    assert told in lines[str(same_name)]
    assert trials.good.tolist() == [True, False, False]
    assert lines[str(same_samples)] == f"bag {same_samples} holds the same samples as {paths[0]}; give every trial once"


def test_force_pca_needs_five_levels(make: Maker) -> None:
    short = Trials(found_in(*(make(pca=pca) for pca in (4.5, 6.1, 6.3, 9.0))))
    assert {row.fit for row in force_pca_of_trials(short)} == {
        Missing("isometric force is known at 4 levels of pCa; 5 are needed")
    }
    rows = force_pca_of_trials(Trials(found_in(*(make(pca=pca) for pca in (4.5, 6.1, 6.3, 6.6, 9.0)))))
    by = {row.of: row.fit for row in rows}
    assert set(by) == {"measured", "3state_coop"}
    measured, model = by["measured"], by["3state_coop"]
    assert isinstance(measured, ForcePca)
    assert isinstance(model, ForcePca)
    assert measured.pca50 == pytest.approx(model.pca50, abs=1e-3)
    assert measured.passive_f0 == pytest.approx(model.passive_f0 + 0.02, abs=1e-3)


def test_enhancement_of_a_made_pair(make: Maker, held: Callable[..., Trial]) -> None:
    paths = [
        make(held(0.1, 0.8, "iso_long")),
        make(held(0.0, 0.9, "iso_short")),
        make(held(0.1, 1.0, "ramp", stretched_s=2.0)),
        make(held(0.1, 0.85, "iso_long_again")),
    ]
    trials = Trials(found_in(*paths, measured_only=True))
    (pair,) = enhancement_pairs(trials)
    # The isometric trial at the final length, and the one before the stretch rather than the one after it.
    assert [facts.trial for facts in pair] == ["ramp", "iso_long"]
    found = compared(pair, paths[0])
    assert found["at_s"] == pytest.approx(5.0)
    forces = ("stretched_f0", "isometric_f0", "enhancement_f0", "relative")
    assert {key: found["found"][MEASURED][key] for key in forces} == (
        pytest.approx({"stretched_f0": 1.0, "isometric_f0": 0.8, "enhancement_f0": 0.2, "relative": 0.25})
    )


def test_no_enhancement_once_activation_has_ended(make: Maker, held: Callable[..., Trial]) -> None:
    ended = {"calcium_time_s": np.array([0.0, 1.0, 4.0]), "calcium_um": np.array([0.05, 8.0, 0.05])}
    paths = [
        make(replace(held(0.1, 0.8, "iso"), **ended)),
        make(replace(held(0.1, 1.0, "ramp", stretched_s=2.0), **ended)),
    ]
    trials = Trials(found_in(*paths, measured_only=True))
    (pair,) = enhancement_pairs(trials)
    assert compared(pair, paths[0])["found"][MEASURED] == {
        "why": "calcium has fallen, or a trial ended, by 3 s after the stretch"
    }


def test_clocks_are_set_by_activation(make: Maker, held: Callable[..., Trial]) -> None:
    """An isometric trial activated a second later is read a second later."""
    iso = held(0.1, 0.8, "iso")
    late = replace(iso, calcium_time_s=np.array([0.0, 2.0]), force_n=iso.force_time_s)
    paths = [make(late), make(held(0.1, 1.0, "ramp", stretched_s=1.9))]
    (pair,) = enhancement_pairs(Trials(found_in(*paths, measured_only=True)))
    assert compared(pair, paths[0])["found"][MEASURED]["isometric_f0"] == pytest.approx(4.9 + 1.0)


def test_a_recorded_release_gives_k_tr(make: Maker, recorded: Callable[..., Trial]) -> None:
    trial = recorded(amplitude_l0=0.0)
    time_s = np.arange(4001) * 1e-3
    phases = (Phase("isometric", 0.0, 1.0), Phase("release", 1.0, 1.001), Phase("stretch", 1.02, 1.021))
    length = np.where((time_s > 1.0) & (time_s < 1.0205), 0.8, 1.0)
    force = np.where(time_s < 1.0, 0.9, np.where(time_s < 1.0205, 0.0, 0.9 - 0.7 * np.exp(-4.0 * (time_s - 1.0205))))
    made = replace(
        trial,
        facts=replace(trial.facts, amplitude_l0=None, recovery_s=None, phases=phases, pca=4.5),
        time_s=time_s,
        length_m=length,
        calcium_um=np.array([10.0**1.5]),
        force_time_s=time_s,
        force_n=force,
    )
    (found,) = found_in(make(made))
    assert found.scores[MEASURED]["k_tr"].value == pytest.approx(4.0, rel=1e-4)
    assert found.scores["3state_coop"]["k_tr"].value > 0.0


@pytest.mark.slow
def test_models_that_push_are_told_once_each(make: Maker, recorded: Callable[..., Trial]) -> None:
    """A release by a fifth of the length within 2 ms: a tendon would be slack, the models' spring is not."""
    slack = recorded()
    released = np.interp(slack.time_s, [0.03, 0.032], [1.0, 0.8])
    trial = replace(slack, length_m=released, facts=replace(slack.facts, amplitude_l0=None, recovery_s=None, phases=()))
    # The same samples twice would be one trial.
    other = replace(trial, facts=replace(trial.facts, trial="other"), force_n=trial.force_n + 0.01)
    paths = [make(trial, "one"), make(other, "two")]
    trials = Trials(found_in(*paths, models=("2state", "hill_se", "2state_slack")))
    assert trials.good.all()
    (line,) = [line for line in trials.warnings if "pushes" in line]
    assert "model 2state pushes, force falls to -0." in line
    assert line.endswith("in model 2state_slack the series spring goes slack (docs/model.md); likewise in 1 more trial")
