"""Writing a trial as an MCAP bag in rosbag2's layout."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rosbags.interfaces import Connection

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_files import check_replaceable
from xb_muscle_ros.trials.bag_writer import HEAD_BYTES, BagWriter, Part
from xb_muscle_ros.trials.custom_data import facts_to_custom_data
from xb_muscle_ros.trials.joint_layout import DOUBLE, STAMP_AT, Layout
from xb_muscle_ros.trials.rows import Bytes
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.spool import release
from xb_muscle_ros.trials.stamps import not_after, to_ns
from xb_muscle_ros.trials.trial import Array, Trial

# Of each topic so many messages are made at once.
_AT_ONCE = 16384
_SECOND_NS = 1_000_000_000


class _Series(NamedTuple):
    """Messages of one topic: times in s, names, and one array of shape (messages,) for each name by their field."""

    topic: str
    time_s: Array
    names: list[str]
    fields: dict[str, list[Array]]

    @property
    def columns(self) -> list[Array]:
        """The arrays of all fields."""
        return [column for columns in self.fields.values() for column in columns]


class _Rows:
    """Makes messages of a series, which differ in stamp and numbers alone."""

    def __init__(self, series: _Series, connection: Connection) -> None:
        self._series, self._connection = series, connection
        none = {field: np.zeros(len(columns)) for field, columns in series.fields.items()}
        message = ros_types.joint_state(0, series.names, **none)
        layout = Layout.of(message)
        assert layout is not None  # the message is our own
        self._layout = layout
        self._message = np.frombuffer(bytes(HEAD_BYTES) + message, np.uint8)

    def part(self, which: slice) -> Part:
        """Some of the messages, serialized."""
        stamps = to_ns(self._series.time_s[which])
        rows: Bytes = np.repeat(self._message[np.newaxis], stamps.size, axis=0)
        # Seconds are an int32 and not negative, nanoseconds an uint32.
        stamp = np.column_stack(np.divmod(stamps, _SECOND_NS)).astype("<u4")
        rows[:, HEAD_BYTES + STAMP_AT.start : HEAD_BYTES + STAMP_AT.stop] = stamp.view(np.uint8)
        for field, columns in self._series.fields.items():
            begin = HEAD_BYTES + getattr(self._layout, field).begin
            values = np.column_stack([column[which] for column in columns]).astype(DOUBLE)
            rows[:, begin : begin + DOUBLE.itemsize * len(columns)] = values.view(np.uint8)
        return Part(self._connection, stamps, rows)


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
        made = [_Rows(each, connection) for each, connection in zip(series, connections, strict=True)]
        for parts in _together([each.time_s for each in series]):
            messages = [rows.part(part) for rows, part in zip(made, parts, strict=True)]
            # Of one stamp the topics keep their order.
            order = np.argsort(np.concatenate([part.stamps_ns for part in messages]), kind="stable")
            writer.put(messages, order)
            for each in series:
                release(*each.columns)


def _together(series: list[Array]) -> Iterator[list[slice]]:
    """Parts of all series of times (s) that hold everything up to some stamp, one after another."""
    done = [0] * len(series)
    while any(first < time_s.size for first, time_s in zip(done, series, strict=True)):
        parts = [to_ns(time_s[first : first + _AT_ONCE]) for first, time_s in zip(done, series, strict=True)]
        # A series that goes on beyond its part tells nothing of what comes later.
        going_on = zip(done, parts, series, strict=True)
        until = min((part[-1] for first, part, all_of in going_on if first + part.size < all_of.size), default=None)
        counts = [part.size if until is None else int(np.searchsorted(part, until, side="right")) for part in parts]
        yield [slice(first, first + count) for first, count in zip(done, counts, strict=True)]
        done = [first + count for first, count in zip(done, counts, strict=True)]


def _series(trial: Trial, simulated: Simulated | None, where: str) -> list[_Series]:
    """The trial's topics in the order of `ros_types.TOPICS`."""
    fibre = [trial.facts.fibre]
    if not trial.facts.fibre:
        raise UserError(f"bag {where}: the trial's fibre has no name; give it one")

    def series(topic: str, time_s: Array, names: list[str], **fields: list[Array]) -> _Series:
        made = _Series(topic, time_s, names, fields)
        _check(made, where)
        return made

    found = [
        series(ros_types.CALCIUM, trial.calcium_time_s, fibre, position=[trial.calcium_um]),
        series(ros_types.LENGTH, trial.time_s, fibre, position=[trial.length_m]),
    ]
    if trial.force_time_s.size and trial.force_is_measured:
        found.append(series(ros_types.MEASURED_FORCE, trial.force_time_s, fibre, effort=[trial.force_n]))
    if simulated is not None:
        of_fibre = {"position": [simulated.ce_length_m], "velocity": [simulated.ce_velocity_m_per_s]}
        found.append(series(ros_types.FORCE, simulated.time_s, fibre, effort=[simulated.force_n], **of_fibre))
        names = [f"{fibre[0]}/{name}" for name in MOMENTS]
        moments = [simulated.moments[name] for name in MOMENTS]
        found.append(series(ros_types.MOMENTS, simulated.time_s, names, position=moments))
    return found


def _check(series: _Series, where: str) -> None:
    """Look at everything that would make the bag unreadable."""
    topic, time_s = series.topic, series.time_s
    if time_s.ndim != 1 or time_s.size == 0:
        raise UserError(f"bag {where}: no samples for {topic}; at least one is needed")
    for values in (time_s, *series.columns):
        if values.shape != time_s.shape:
            raise UserError(f"bag {where}: {topic} has {values.size} values at {time_s.size} times; one each is needed")
        bad = np.flatnonzero(~np.isfinite(values))
        release(values)
        if bad.size:
            raise UserError(f"bag {where}: {topic}, sample {bad[0]} is {values[bad[0]]}; allowed are finite numbers")
    if time_s[0] < 0.0 or time_s[-1] * 1e9 > ros_types.LAST_STAMP_NS:
        raise UserError(
            f"bag {where}: {topic} runs from {time_s[0]:.9g} to {time_s[-1]:.9g} s; a message stamp goes from 0 to "
            f"{ros_types.LAST_STAMP_NS // 10**9} s; shift the times"
        )
    for first in range(0, time_s.size, _AT_ONCE):
        for k in not_after(to_ns(time_s[first : first + _AT_ONCE + 1]))[:1].tolist():
            i = first + k
            raise UserError(
                f"bag {where}: {topic}, sample {i} at {time_s[i]:.9f} s does not come after {time_s[i - 1]:.9f} s; "
                "stamps have to increase by at least 1 ns"
            )
