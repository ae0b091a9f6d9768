"""What can be measured: a row for each study, and a module of this folder with a function of a `Setting`."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from xb_muscle_ros.files import matching, refuse_older
from xb_muscle_ros.progress import Progress

if TYPE_CHECKING:
    from xb_muscle_ros.bench.measure import Figure, Setting


class Study(NamedTuple):
    """One study.

    Attributes:
        help: what is measured, in a few words.
        module: of this folder; loaded when the study is asked for: some need ROS 2 or CasADi.
        function: makes figures of a `Setting`.
        draws: name of the figure that it draws beside ``bench.json``, if it does.
    """

    help: str
    module: str
    function: str = "study"
    draws: str = ""


STUDIES = {
    "rhs": Study("one evaluation of the right-hand side, beside C", "right_hand_side"),
    "trial": Study("a whole trial of 2.34 s", "trial_time"),
    "batch": Study("one tick of 100 fibres, memory of 1,000", "batch_time"),
    "start": Study("a process from nothing to its first step", "start_time"),
    "records": Study("import and replay of large recordings: time, memory", "records"),
    "cost": Study("cost against accuracy of all solution methods", "cost", draws="cost"),
    "peers": Study("muscles of OpenSim and MuJoCo beside ours: cost, and SRS", "peer_study", draws="peers"),
    "fast": Study("fast stretches with and without forcible detachment", "fast_stretch", draws="fast_stretch"),
    "fit": Study("fits by least squares and by collocation", "fit_time"),
    "node": Study("lateness of a realtime node, beside a plain timer", "node_timing", "realtime"),
    "roundtrip": Study("from length message to force message and back", "node_timing", "roundtrip"),
    "many": Study("a node of many fibres", "node_timing", "many"),
    "body": Study("a tick of a leg with 80 muscles, beside MuJoCo's own", "body"),
    "moments": Study("isometric joint moments beside MuJoCo's own muscles", "joint_moments", draws="joint_moments"),
    "soak": Study("millions of lockstep ticks: force balance, memory", "soak"),
}


def run(names: Sequence[str], setting: Setting, overwrite: bool) -> list[Figure]:
    """Measure, in the order of `STUDIES`; figures that are drawn go beside the results.

    Raises:
        UserError: results of an older run are there and may not be replaced, or a study cannot be done.
    """
    from xb_muscle_ros.trials.bag_files import remove_results

    older = matching(setting.out.parent, re.escape(setting.out.name))
    drawn = [study.draws for name, study in STUDIES.items() if study.draws and (older or name in names)]
    older += matching(setting.out.parent, *(rf"{name}\.(png|pdf|md|json)" for name in drawn))
    refuse_older(older, overwrite)
    remove_results(older)
    made: list[Figure] = []
    chosen = [study for name, study in STUDIES.items() if name in names]
    with Progress(len(chosen), "bench") as progress:
        for study in chosen:
            made += _figures(study, setting)
            progress.update()
            if study.draws:
                progress.write(str(setting.drawing(study.draws)))
    return made


def _figures(study: Study, setting: Setting) -> Iterable[Figure]:
    found: Iterable[Figure] = getattr(importlib.import_module(f"{__package__}.{study.module}"), study.function)(setting)
    return found
