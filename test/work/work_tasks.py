"""Functions for the tests of work: other processes import them by this module's name."""

from __future__ import annotations

import math
import os
import signal
import time
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.work import Options, run


def awkward_floats(seed: int) -> dict[str, Any]:
    """Floats that lose bits where a way of passing them on rounds; also NaN, infinity, -0 and the smallest one."""
    x = math.sin(seed + 1.0) ** 3
    return {"x": x, "list": [x / 3.0, -0.0, 5e-324, x * 1e300], "no": math.nan, "inf": -math.inf, "pair": (seed, None)}


def count(task: dict[str, Any]) -> float:
    """Leave a mark in a folder for every time it is carried out; return a number."""
    folder = Path(task["folder"])
    (folder / f"{task['i']}_{os.getpid()}_{time.monotonic_ns()}").touch()
    if task.get("sleep_s"):
        time.sleep(task["sleep_s"])
    return float(task["i"]) / 7.0


def marks(folder: Path, i: int) -> int:
    """How often `count` has been carried out for a number."""
    return len(list(folder.glob(f"{i}_*")))


def complain_at_three(i: int) -> int:
    """Raise what a user can mend at 3."""
    if i == 3:
        raise UserError("fibre x: parameter f is -1; allowed is above 0; correct the file")
    return i


def leave_allowed_states(i: int) -> int:
    """Raise an error that pickle cannot bring back, as its class has arguments of its own."""
    raise StateViolation("x", "n_on", 0.5, float(i), "0 to 1", "use a smaller step")


def fail_at_three(i: int) -> int:
    """Fail for a reason no user can mend at 3."""
    if i == 3:
        raise ZeroDivisionError("a defect of this function")
    return i


def give_no_data(i: int) -> Any:
    """Return what JSON cannot hold."""
    return {i: object()}


def killed_once(task: dict[str, Any]) -> int:
    """Kill its process the first time it is carried out with the number to be killed at."""
    mark = Path(task["folder"]) / "killed"
    if task["i"] == task["killed_at"] and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.01)
    return int(task["i"]) ** 2


def always_killed(how: str) -> None:
    """End its process, every time."""
    if how == "exit":
        os._exit(7)
    os.kill(os.getpid(), getattr(signal, how))


def threads(_: int) -> dict[str, str | None]:
    """What its process was told on threads."""
    return {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")}


def process(_: int) -> int:
    """Id of its process."""
    time.sleep(0.05)
    return os.getpid()


def simulate(task: dict[str, Any]) -> list[float]:
    """Force of a fibre at the end of a stretch, and its states, F0 and 1."""
    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.models.muscle import Muscle

    muscle = Muscle(load_fibre("18Dec2017a", task["model"]))
    state = muscle.settle(0.0, task["calcium_um"])
    for k in range(50):
        state = muscle.step(state, 4e-4 * (k + 1), task["calcium_um"], 1e-3)
    return [muscle.outputs(state).force_f0, *map(float, state)]


def long_text(i: int) -> str:
    """100 kB."""
    return f"{i}".ljust(100_000, ".")


def nested(numbers: list[float]) -> list[float]:
    """A task that has tasks of its own."""
    return run(third, numbers, Options(processes=0, quiet=True))


def third(number: float) -> float:
    """A third."""
    return number / 3.0


def last_mechanism(_: int) -> str:
    """Name of the last mechanism that this process knows of."""
    from xb_muscle_ros.models.registry import EXTRAS

    return list(EXTRAS)[-1]
