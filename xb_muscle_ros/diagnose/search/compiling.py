"""Models compiled before they are needed, side by side: one takes seconds, and a diagnosis needs two or three."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.noise.closure import by_distribution, has_closure
from xb_muscle_ros.diagnose.search.whole import FRAMES, beside, whole
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.models.compiled import is_compiled
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import outputs
from xb_muscle_ros.work import Options, run

# A fibre is half active at about this calcium, µM; which it is does not matter.
_CALCIUM_UM = 1.0


def compile_task(task: Mapping[str, Any]) -> bool:
    """Compile the model of a fibre, which leaves it in this machine's cache; whether there is such a model.

    All that trials need is compiled, not single steps alone: the fibre settles and takes one short step as fits do.
    """
    try:
        fibre = Problem.from_json(task["problem"]).fibre
        outputs(Muscle(fibre), np.full(1, 1e-4), np.zeros(2), np.full(2, _CALCIUM_UM))
    except UserError:
        return False
    return True


def compile_first(fibres: Sequence[Fibre], options: Options) -> None:
    """Compile what a diagnosis of these fibres needs and the cache does not have, on all cores."""
    wanted: dict[tuple[str, str], Fibre] = {}
    for fibre in fibres:
        frames: list[tuple[Name, ...]] = [(), *((n,) for n in FRAMES if n in beside(fibre))]
        # The one that takes longest first, so that the cores end together.
        made = [whole(fibre, frame) for frame in reversed(frames)]
        if has_closure(fibre):
            made += [by_distribution(fibre), fibre]
        wanted |= {(f.model, f.method): f for f in made}
    missing = [f for f in wanted.values() if not is_compiled(f.model, f.method, False)]
    if len(missing) < 2 or options.processes == 0 or options.scheduler is not None:
        return
    # Finished or not, a run that goes on later may meet an empty cache: not a result to be kept.
    tasks = [{"problem": Problem(f, (), (), {}).to_json()} for f in missing]
    run(compile_task, tasks, replace(options, journal=None, label="compiling"))
