"""Reading trials and simulations from MCAP bags: what the bag says, and nothing that it does not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import open_bag
from xb_muscle_ros.trials.bag_topics import Samples, Topics
from xb_muscle_ros.trials.custom_data import facts_from_custom_data
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.trial import Trial, TrialFacts

# Facts that belong to one fibre; a bag's other fibres have their own.
_OF_THE_FIBRE = ("reference_length_m", "f0_n", "amplitude_l0", "recovery_s", "phases", "pca")


class Reading(NamedTuple):
    """A trial as its bag has it, and the names of the facts that the bag does not tell."""

    trial: Trial
    unknown: frozenset[str]


class TrialBag:
    """A bag opened: every fibre whose length it has is a trial.

    Args:
        path: a bag folder or an ``.mcap`` file.

    Attributes:
        fibres: names on ``/muscle/length``, in the order in which they come.
        named: the fibre that the bag's facts are of; None where they name none.

    Raises:
        UserError: no bag, an empty one, or one without lengths as JointState messages with names.
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        self._topics = Topics(open_bag(self.path))
        data = self._topics.bag.custom_data or {}
        self._data = {key: text for key, text in data.items() if text.strip() or key != "fibre"}  # no fibre is ''
        self.fibres = self._topics.names(ros_types.LENGTH)
        self.named: str | None = self._data.get("fibre")

    def reading(self, fibre: str) -> Reading:
        """The trial of one of the `fibres`. Times are the messages' header stamps in s.

        Where no force was measured, one that a model made and a recorder got stands for it.

        Raises:
            UserError: no calcium for the fibre, or samples that are not finite or not in order of time.
        """
        topics, warnings = self._topics, list(self._state())
        length = topics.samples(ros_types.LENGTH, ("position",), fibre)
        calcium = self._of(ros_types.CALCIUM, "position", fibre)
        if calcium is None:
            raise UserError(
                f"bag {self.path}: {ros_types.CALCIUM} names {_listed(topics.names(ros_types.CALCIUM))}, not fibre "
                f"'{fibre}'; record the calcium of the fibre"
            )
        force, measured = self._of(ros_types.MEASURED_FORCE, "effort", fibre), True
        if force is None and ros_types.FORCE in topics:
            force, measured = self._of(ros_types.FORCE, "effort", fibre), False
            if force is not None:
                warnings.append(
                    f"bag {self.path}: compared with the recorded {ros_types.FORCE}, which a model made; there is no "
                    f"{ros_types.MEASURED_FORCE}"
                )
        facts, unknown = self._facts(fibre)
        found = [each for each in (length, calcium, force) if each is not None]
        warnings += [line for each in found for line in each.warnings]
        skipped = [each.skipped for each in found if each.skipped]
        if skipped:
            warnings.append(
                f"bag {self.path}: {', '.join(skipped)} are without '{fibre}'; they are skipped, as the node does"
            )
        names = sorted({each.name for each in found} - {facts.fibre})
        if names:
            warnings.append(f"bag {self.path}: messages name '{names[0]}', the trial facts name fibre '{facts.fibre}'")
        # One array for both where length and force come together, as in most recordings.
        same_clock = force is not None and np.array_equal(force.time_s, length.time_s)
        none = Samples(np.empty(0), np.empty((0, 1)), fibre)
        trial = Trial(
            facts=facts,
            time_s=length.time_s,
            length_m=length.values[:, 0],
            calcium_time_s=calcium.time_s,
            calcium_um=calcium.values[:, 0],
            force_time_s=length.time_s if same_clock else (force or none).time_s,
            force_n=(force or none).values[:, 0],
            warnings=tuple(warnings),
            force_is_measured=measured,
        )
        return Reading(trial, unknown)

    def _of(self, topic: str, field: str, fibre: str) -> Samples | None:
        """A fibre's samples on a topic; None where the topic is not there or is of others.

        A topic whose one name is that of no fibre (a bath's calcium, a load cell) counts for every fibre.
        """
        if topic not in self._topics and topic != ros_types.CALCIUM:
            return None
        names = self._topics.names(topic)
        if fibre in names:
            return self._topics.samples(topic, (field,), fibre)
        if len(names) == 1 and names[0] not in self.fibres:
            return self._topics.samples(topic, (field,), names[0])
        return None

    def _facts(self, fibre: str) -> tuple[TrialFacts, frozenset[str]]:
        """Facts of a fibre; those of another fibre of the bag are not its own."""
        name = self.path.resolve()
        trial = name.stem if name.is_file() else name.name
        data = dict(self._data)
        if len(self.fibres) > 1 and fibre != self.named:
            if self.named is not None:
                data = {key: value for key, value in data.items() if key not in _OF_THE_FIBRE}
            data["fibre"] = fibre
            data["trial"] = f"{data.get('trial', trial)}_{fibre.replace('/', '_')}"
        facts = facts_from_custom_data(data, str(self.path), fibre, trial)
        unknown = {key for key in _OF_THE_FIBRE if key not in data}
        return facts, frozenset(unknown if facts.phases else {*unknown, "phases"})

    def _state(self) -> tuple[str, ...]:
        """At most one line on the state of the bag."""
        bag = self._topics.bag
        if not bag.flaws:
            return ()
        count = sum(len(messages) for messages in bag.messages.values())
        lost = "; trial facts are lost" if bag.custom_data is None else ""
        return (f"bag {bag.path}: {'; '.join(bag.flaws)}; {count} messages were read{lost}",)


def read_trial(path: Path) -> Trial:
    """Read the trial of a bag of one fibre; what the bag does not tell has the value of `TrialFacts`.

    A bag whose file was cut short, or that lost its ``metadata.yaml``, gives what can be read of it and one line in
    ``Trial.warnings``.

    Raises:
        UserError: see `TrialBag`; the bag is of several fibres.
    """
    bag = TrialBag(path)
    if len(bag.fibres) > 1:
        raise UserError(f"bag {bag.path} is of fibres {_listed(bag.fibres)}; give a bag of one")
    return bag.reading(bag.fibres[0]).trial


def read_simulated(path: Path) -> Simulated | None:
    """Read what a model or a node answered in a bag; None where it has no ``/muscle/force``.

    Only stamps that have both force and moments count; a recorder may have missed or lost one of the two.

    Raises:
        UserError: as for `read_trial`, and a bag with force but without moments.
    """
    topics = Topics(open_bag(Path(path)))
    if ros_types.FORCE not in topics:
        return None
    fibre = topics.names(ros_types.FORCE)[0]
    force = topics.samples(ros_types.FORCE, ("effort", "position", "velocity"), fibre)
    moments = topics.rows(ros_types.MOMENTS, _moments, len(MOMENTS))
    time_s, at_force, at_moments = np.intersect1d(force.time_s, moments.time_s, return_indices=True)
    if time_s.size == 0:
        raise UserError(f"bag {path}: {ros_types.FORCE} and {ros_types.MOMENTS} have no stamp in common")
    force_n, ce_length_m, ce_velocity = force.values[at_force].T
    return Simulated(
        time_s=time_s,
        force_n=force_n,
        ce_length_m=ce_length_m,
        ce_velocity_m_per_s=ce_velocity,
        moments={name: moments.values[at_moments, i] for i, name in enumerate(MOMENTS)},
    )


def _moments(names: Sequence[str]) -> list[tuple[str, int]]:
    places = {name.rpartition("/")[2]: i for i, name in enumerate(names)}
    missing = [name for name in MOMENTS if name not in places]
    if missing:
        raise ValueError(f"has no {missing[0]}; needed: {', '.join(MOMENTS)}")
    return [("position", places[name]) for name in MOMENTS]


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)
