"""Writing a trial as an MCAP bag in rosbag2's layout."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_files import check_replaceable
from xb_muscle_ros.trials.bag_writer import BagWriter
from xb_muscle_ros.trials.custom_data import facts_to_custom_data
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.stamps import not_after, to_ns
from xb_muscle_ros.trials.trial import Array, Trial


class _Series(NamedTuple):
    """Messages of one topic: stamps in ns and a function from sample index to the serialized message."""

    topic: str
    stamps_ns: list[int]
    message: Callable[[int], bytes]


def write_trial(
    path: Path, trial: Trial, simulated: Simulated | None = None, more: Mapping[str, str] | None = None
) -> None:
    """Write a trial, and with it what a model answered, as a bag folder.

    The folder appears whole or not at all; an older bag of that name is replaced.

    Args:
        path: the bag folder; it gets ``metadata.yaml`` and ``<name>_0.mcap``.
        trial: at least one length and one calcium sample.
        simulated: force and moments to write beside it.
        more: strings to keep in the bag's ``custom_data`` beside the trial's facts.

    Raises:
        UserError: the path holds something that is not a bag, or the trial cannot be a bag (empty, non-finite,
            times negative or not increasing by at least 1 ns).
    """
    path = Path(path)
    check_replaceable(path)
    series = _series(trial, simulated, str(path))
    custom_data = {**(more or {}), **facts_to_custom_data(trial.facts)}
    temporary = path.parent / f".{path.name}.{os.getpid()}.tmp"
    old = path.parent / f".{path.name}.{os.getpid()}.old"
    shutil.rmtree(temporary, ignore_errors=True)  # of a run that was killed
    try:
        _write(temporary, path.name, series, custom_data)
        if path.exists():
            path.rename(old)
        try:
            temporary.rename(path)
        except BaseException:
            if old.exists():
                old.rename(path)
            raise
    except OSError as problem:
        raise UserError(f"bag {path} cannot be written: {problem.strerror or problem}") from problem
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _write(folder: Path, name: str, series: list[_Series], custom_data: dict[str, str]) -> None:
    with BagWriter(folder, name, custom_data) as writer:
        connections = [
            writer.add_connection(
                each.topic,
                ros_types.JOINT_STATE,
                typestore=ros_types.typestore(),
                offered_qos_profiles=ros_types.qos(each.topic),
            )
            for each in series
        ]
        order = sorted((stamp, s, i) for s, each in enumerate(series) for i, stamp in enumerate(each.stamps_ns))
        for stamp, s, i in order:
            writer.write(connections[s], stamp, series[s].message(i))


def _series(trial: Trial, simulated: Simulated | None, where: str) -> list[_Series]:
    """The trial's topics in the order of `ros_types.TOPICS`."""
    fibre = [trial.facts.fibre]
    if not trial.facts.fibre:
        raise UserError(f"bag {where}: the trial's fibre has no name; give it one")
    inputs = [
        (ros_types.CALCIUM, trial.calcium_time_s, trial.calcium_um),
        (ros_types.LENGTH, trial.time_s, trial.length_m),
        (ros_types.MEASURED_FORCE, trial.force_time_s, trial.force_n),
    ]
    series = []
    for topic, time_s, values in inputs:
        if topic != ros_types.MEASURED_FORCE or (time_s.size and trial.force_is_measured):
            series.append(
                _Series(topic, _stamps(time_s, (values,), topic, where), _one_value(topic, time_s, values, fibre))
            )
    if simulated is not None:
        series += _simulated_series(simulated, trial.facts.fibre, where)
    return series


def _one_value(topic: str, time_s: Array, values: Array, names: list[str]) -> Callable[[int], bytes]:
    stamps = to_ns(time_s)
    if ros_types.VALUE_FIELD[topic] == "effort":
        return lambda i: ros_types.joint_state(int(stamps[i]), names, effort=values[i : i + 1])
    return lambda i: ros_types.joint_state(int(stamps[i]), names, position=values[i : i + 1])


def _simulated_series(simulated: Simulated, fibre: str, where: str) -> list[_Series]:
    moments = np.column_stack([simulated.moments[name] for name in MOMENTS])
    columns = (simulated.force_n, simulated.ce_length_m, simulated.ce_velocity_m_per_s)
    stamps = _stamps(simulated.time_s, columns, ros_types.FORCE, where)
    _stamps(simulated.time_s, tuple(simulated.moments.values()), ros_types.MOMENTS, where)
    moment_names = [f"{fibre}/{name}" for name in MOMENTS]

    def force(i: int) -> bytes:
        effort, position, velocity = (column[i : i + 1] for column in columns)
        return ros_types.joint_state(stamps[i], [fibre], position, velocity, effort)

    def moment(i: int) -> bytes:
        return ros_types.joint_state(stamps[i], moment_names, position=moments[i])

    return [_Series(ros_types.FORCE, stamps, force), _Series(ros_types.MOMENTS, stamps, moment)]


def _stamps(time_s: Array, columns: tuple[Array, ...], topic: str, where: str) -> list[int]:
    """Stamps of a topic in ns, after looking at everything that would make the bag unreadable."""
    if time_s.ndim != 1 or time_s.size == 0:
        raise UserError(f"bag {where}: no samples for {topic}; at least one is needed")
    for values in (time_s, *columns):
        if values.shape != time_s.shape:
            raise UserError(f"bag {where}: {topic} has {values.size} values at {time_s.size} times; one each is needed")
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise UserError(f"bag {where}: {topic}, sample {bad[0]} is {values[bad[0]]}; allowed are finite numbers")
    if time_s[0] < 0.0 or time_s[-1] * 1e9 > ros_types.LAST_STAMP_NS:
        raise UserError(
            f"bag {where}: {topic} runs from {time_s[0]:.9g} to {time_s[-1]:.9g} s; a message stamp goes from 0 to "
            f"{ros_types.LAST_STAMP_NS // 10**9} s; shift the times"
        )
    stamps = to_ns(time_s)
    for i in not_after(stamps)[:1].tolist():
        raise UserError(
            f"bag {where}: {topic}, sample {i} at {time_s[i]:.9f} s does not come after {time_s[i - 1]:.9f} s; "
            "stamps have to increase by at least 1 ns"
        )
    return [int(stamp) for stamp in stamps]
