"""Reading trials and simulations from MCAP bags."""

from __future__ import annotations

import dataclasses
import struct
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from rosbags.serde import SerdeError

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import BagContents, open_bag
from xb_muscle_ros.trials.custom_data import facts_from_custom_data
from xb_muscle_ros.trials.ros_types import JointState
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.trial import Array, Trial, TrialFacts


class _Samples(NamedTuple):
    time_s: Array
    values: Array  # shape (n, fields)
    name: str  # of the first joint


def read_trial(path: Path) -> Trial:
    """Read a trial.

    A bag whose file was cut short, or that lost its ``metadata.yaml``, gives what can be read of it and one line in
    ``Trial.warnings``. Times are the messages' header stamps in s.

    Args:
        path: a bag folder or an ``.mcap`` file.

    Raises:
        UserError: no bag, an empty one, one without ``/muscle/length`` or ``/muscle/calcium``, or one whose samples
            are not finite, not in order of time, or not JointState messages.
    """
    bag = open_bag(Path(path))
    length = _samples(bag, ros_types.LENGTH, ("position",))
    calcium = _samples(bag, ros_types.CALCIUM, ("position",))
    if ros_types.MEASURED_FORCE in bag.messages:
        force = _samples(bag, ros_types.MEASURED_FORCE, ("effort",))
    else:
        force = _Samples(np.empty(0), np.empty((0, 1)), length.name)
    name = bag.path.resolve()
    facts = facts_from_custom_data(
        bag.custom_data or {}, str(bag.path), length.name, name.stem if name.is_file() else name.name
    )
    if bag.custom_data is None:
        facts = _guessed(facts, length.values[:, 0], calcium.values[:, 0])
    return Trial(
        facts=facts,
        time_s=length.time_s,
        length_m=length.values[:, 0],
        calcium_time_s=calcium.time_s,
        calcium_um=calcium.values[:, 0],
        force_time_s=force.time_s,
        force_n=force.values[:, 0],
        warnings=_warnings(bag, facts, (length, calcium, force)),
    )


def read_simulated(path: Path) -> Simulated | None:
    """Read what a model or a node answered in a bag; None where it has no ``/muscle/force``.

    Only stamps that have both force and moments count; a recorder may have missed or lost one of the two.

    Raises:
        UserError: as for `read_trial`, and a bag with force but without moments.
    """
    bag = open_bag(Path(path))
    if ros_types.FORCE not in bag.messages:
        return None
    force = _samples(bag, ros_types.FORCE, ("effort", "position", "velocity"))
    moments = _moments(bag)
    time_s, at_force, at_moments = np.intersect1d(force.time_s, moments.time_s, return_indices=True)
    if time_s.size == 0:
        raise UserError(f"bag {bag.path}: {ros_types.FORCE} and {ros_types.MOMENTS} have no stamp in common")
    force_n, ce_length_m, ce_velocity = force.values[at_force].T
    return Simulated(
        time_s=time_s,
        force_n=force_n,
        ce_length_m=ce_length_m,
        ce_velocity_m_per_s=ce_velocity,
        moments={name: moments.values[at_moments, i] for i, name in enumerate(MOMENTS)},
    )


def _warnings(bag: BagContents, facts: TrialFacts, samples: tuple[_Samples, ...]) -> tuple[str, ...]:
    """At most one line on the state of the bag, and one on names that do not fit."""
    warnings = []
    if bag.flaws:
        count = sum(len(messages) for messages in bag.messages.values())
        lost = ""
        if bag.custom_data is None:
            lost = f"; trial facts are lost, {facts.reference_length_m:g} m is taken for L0 and 1 N for F0"
        warnings.append(f"bag {bag.path}: {'; '.join(bag.flaws)}; {count} messages were read{lost}")
    names = sorted({each.name for each in samples} - {facts.fibre})
    if names:
        warnings.append(f"bag {bag.path}: messages name '{names[0]}', the trial facts name fibre '{facts.fibre}'")
    return tuple(warnings)


def _guessed(facts: TrialFacts, length_m: Array, calcium_um: Array) -> TrialFacts:
    """Facts for a bag that lost its own: pCa where calcium is constant, L0 as 1 m or else the first length."""
    constant = calcium_um[0] > 0.0 and bool(np.all(calcium_um == calcium_um[0]))
    return dataclasses.replace(
        facts,
        pca=float(6.0 - np.log10(calcium_um[0])) if constant else None,
        reference_length_m=1.0 if 0.3 < length_m[0] < 3.0 or length_m[0] <= 0.0 else float(length_m[0]),
    )


def _samples(bag: BagContents, topic: str, fields: tuple[str, ...]) -> _Samples:
    """Stamps and the first joint's values of a topic, checked."""
    stamps, messages = _joint_states(bag, topic)
    name = _first_name(bag, topic, 0, messages[0])
    values = np.empty((len(messages), len(fields)))
    for i, message in enumerate(messages):
        if _first_name(bag, topic, i, message) != name:
            raise UserError(
                f"bag {bag.path}: {topic}, message {i} is of '{message.name[0]}', earlier ones of '{name}'; "
                "allowed is one fibre to a bag"
            )
        for j, field in enumerate(fields):
            array = getattr(message, field)
            if len(array) == 0:
                raise UserError(_at(bag, topic, i, stamps) + f"has an empty {field}; needed is one value for the fibre")
            values[i, j] = array[0]
    _check_finite(bag, topic, stamps, values)
    return _Samples(ros_types.to_s(stamps), values, name)


def _moments(bag: BagContents) -> _Samples:
    stamps, messages = _joint_states(bag, ros_types.MOMENTS)
    values = np.empty((len(messages), len(MOMENTS)))
    for i, message in enumerate(messages):
        held = {name.rpartition("/")[2]: value for name, value in zip(message.name, message.position, strict=False)}
        missing = [name for name in MOMENTS if name not in held]
        if missing:
            raise UserError(
                _at(bag, ros_types.MOMENTS, i, stamps) + f"has no {missing[0]}; needed: {', '.join(MOMENTS)}"
            )
        values[i] = [held[name] for name in MOMENTS]
    _check_finite(bag, ros_types.MOMENTS, stamps, values)
    return _Samples(ros_types.to_s(stamps), values, messages[0].name[0])


def _joint_states(bag: BagContents, topic: str) -> tuple[npt.NDArray[np.int64], list[JointState]]:
    """Messages of a topic and their strictly increasing header stamps in ns."""
    if topic not in bag.messages:
        flaws = f" ({'; '.join(bag.flaws)})" if bag.flaws else ""
        raise UserError(
            f"bag {bag.path} has no message on {topic}; topics there: {', '.join(sorted(bag.messages))}{flaws}; "
            "record or remap the topic"
        )
    if bag.types[topic] != ros_types.JOINT_STATE or bag.encodings[topic] != "cdr":
        raise UserError(
            f"bag {bag.path}: {topic} is {bag.types[topic] or 'of no known type'} ({bag.encodings[topic]}); "
            f"allowed is {ros_types.JOINT_STATE} (cdr)"
        )
    messages = []
    for i, raw in enumerate(bag.messages[topic]):
        try:
            message = ros_types.typestore().deserialize_cdr(raw.data, ros_types.JOINT_STATE)
        except (SerdeError, struct.error, ValueError, IndexError) as problem:
            raise UserError(f"bag {bag.path}: {topic}, message {i} cannot be decoded: {problem}") from problem
        assert isinstance(message, JointState)  # the type asked for
        messages.append(message)
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in messages], dtype=np.int64)
    back = np.flatnonzero(np.diff(stamps) <= 0)
    if back.size:
        i = int(back[0]) + 1
        raise UserError(
            _at(bag, topic, i, stamps)
            + f"does not come after the one before, t = {stamps[i - 1] / 1e9:.9f} s; header stamps have to increase"
        )
    return stamps, messages


def _first_name(bag: BagContents, topic: str, i: int, message: JointState) -> str:
    if not message.name:
        raise UserError(f"bag {bag.path}: {topic}, message {i} has an empty name; needed is the fibre in name[0]")
    return str(message.name[0])


def _check_finite(bag: BagContents, topic: str, stamps: npt.NDArray[np.int64], values: Array) -> None:
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        i, j = (int(k) for k in bad[0])
        raise UserError(_at(bag, topic, i, stamps) + f"has the value {values[i, j]}; allowed are finite numbers")


def _at(bag: BagContents, topic: str, i: int, stamps: npt.NDArray[np.int64]) -> str:
    return f"bag {bag.path}: {topic}, message {i} at t = {stamps[i] / 1e9:.9f} s "
