"""OpenSim's muscles by way of a process with a Python of its own; see `opensim_program`."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path as FilePath
from types import TracebackType
from typing import Any

import numpy as np

import xb_muscle_ros
from xb_muscle_ros.bench.peers.conditions import Path
from xb_muscle_ros.bench.peers.muscle import F0_N, L0_M, Cost, Free, Peer, loosest
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array

PYTHON_VARIABLE = "XB_MUSCLE_PEERS_PYTHON"
PROGRAM = FilePath(__file__).with_name("opensim_program.py")
SLACK_L0 = 1.0
"""Slack length of the tendon, L0. What matters of an elastic tendon is its slack length times its strain."""
SRS_ACCURACY = 1e-8
"""Of Manager's integrator in the trials that SRS are read off."""
_REFERENCE_ACCURACY = 1e-10
_ACCURACIES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
_INTEGRATOR = "Runge-Kutta-Merson"
_EVERY_S = 1e-3

KINDS = {
    "millard": ("Millard2012EquilibriumMuscle", "OpenSim Millard 2012"),
    "thelen": ("Thelen2003Muscle", "OpenSim Thelen 2003"),
    "degroote": ("DeGrooteFregly2016Muscle", "OpenSim De Groote 2016"),
}
# OpenSim: "ignore_tendon_compliance flag is not currently implemented".
_NEVER_RIGID = ("thelen",)
TENDON_STRAIN = Free("tendon_strain", "tendon strain at F0", 2e-3, 0.3)
VMAX = Free("vmax_l0_per_s", "vmax", 0.3, 20.0)


def default_python() -> FilePath:
    """Python with OpenSim: what the environment names, else the one that ``scripts/setup_peers`` makes."""
    named = os.environ.get(PYTHON_VARIABLE)
    return FilePath(named) if named else FilePath(xb_muscle_ros.__file__).parents[1] / ".venv_peers" / "bin" / "python"


class OpenSim:
    """A process that holds one muscle at a time.

    Attributes:
        version: of OpenSim.
    """

    def __init__(self, python: FilePath) -> None:
        """Start it.

        Raises:
            UserError: no such Python, or it has no OpenSim; the line says how to get it.
        """
        remedy = f"make one with scripts/setup_peers, or name another with --peers-python or {PYTHON_VARIABLE}"
        if not python.is_file():
            raise UserError(f"no Python with OpenSim at {python}; {remedy}")
        self._taken: dict[str, Any] = {}
        # OpenSim leaves a log where it runs.
        self._folder = tempfile.TemporaryDirectory(prefix="xb_muscle_peers_")
        bare = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
        self._errors = FilePath(self._folder.name, "stderr.txt")
        with self._errors.open("w") as errors:
            self._process = subprocess.Popen(
                [str(python.absolute()), str(PROGRAM)], cwd=self._folder.name, env=bare, text=True, encoding="utf-8",
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
            )  # fmt: skip
        try:
            self.version = str(self.ask({"do": "about"})["opensim"]).split("-")[0]
        except UserError as error:
            self.close()
            raise UserError(f"{python} cannot run OpenSim ({error}); {remedy}") from None

    def ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Answer to a request.

        Raises:
            UserError: OpenSim cannot do it, or the process ended.
        """
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
        except BrokenPipeError:
            pass  # its last words say why
        line = process.stdout.readline()
        if not line:
            code = process.wait()
            said = self._errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()
            raise UserError(f"OpenSim's process ended with code {code}: {said[-1] if said else 'no word'}")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise UserError(f"OpenSim: {answer['error'][:300]}")
        return answer

    def take(self, request: dict[str, Any]) -> dict[str, Any]:
        """Take a muscle, unless it is the one that was taken last."""
        if self._taken.get("request") != request:
            self._taken = {"request": request, "answer": self.ask(request)}
        answer: dict[str, Any] = self._taken["answer"]
        return answer

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(BrokenPipeError):  # it has ended
            self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()
        self._folder.cleanup()

    def __enter__(self) -> OpenSim:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def peers(self) -> list[Peer]:
        """Rows of the comparison: each muscle with a rigid tendon, as it comes, and fitted in two ways."""
        made = []
        for key, (kind, title) in KINDS.items():
            for rigid in (True, False):
                if rigid and key in _NEVER_RIGID:
                    continue
                for free in ((),) if rigid else ((), (TENDON_STRAIN,), (TENDON_STRAIN, VMAX)):
                    made.append(self._peer(key, kind, title, rigid, free))
        return made

    def _peer(self, key: str, kind: str, title: str, rigid: bool, free: tuple[Free, ...]) -> Peer:
        def take(values: Mapping[str, float]) -> OpenSimMuscle:
            return OpenSimMuscle(self, kind, rigid, values)

        defaults = dict(take({}).values)
        if rigid:
            del defaults[TENDON_STRAIN.name]
        suffix = "_rigid" if rigid else "".join(f"_{name}" for name in ("fitted", "vmax")[: len(free)])
        return Peer(f"{key}{suffix}", title, take, defaults, free, "rigid" if rigid else "elastic")


class OpenSimMuscle:
    """One of OpenSim's muscles; see `muscle.PeerMuscle`.

    Attributes:
        least_activation: that it takes.
        values: tendon_strain at F0 and vmax_l0_per_s, given or OpenSim's defaults.
    """

    def __init__(self, program: OpenSim, kind: str, rigid: bool, values: Mapping[str, float]) -> None:
        self._program = program
        self._muscle = {
            "do": "muscle", "kind": kind, "rigid_tendon": rigid, "parameters": dict(values),
            "l0_m": L0_M, "f0_n": F0_N, "slack_l0": SLACK_L0,
        }  # fmt: skip
        answer = program.take(self._muscle)
        self.least_activation: float = answer["least_activation"]
        self.values: dict[str, float] = answer["parameters"]

    def isometric_f0(self, activation: float) -> float:
        """Force in equilibrium, F0."""
        return float(self._ask("isometric", activation=activation)["force_f0"])

    def force_f0(self, activation: float, path: Path) -> Array:
        """Force at the samples, F0; the integrator starts anew at every corner and stops at every sample."""
        found = self._ask(
            "trial", activation=activation, accuracy=SRS_ACCURACY, sample_s=path.sample_s.tolist(), **_corners(path)
        )
        return np.array(found["force_f0"])

    def cost(self, activation: float, path: Path, repeats: int) -> list[Cost]:
        """At the default of Manager, and at the loosest accuracy from which on force errs by at most 0.1 % F0."""
        exact = self._dense(activation, path, _REFERENCE_ACCURACY)

        def error(accuracy: float | None) -> float:
            return float(np.max(np.abs(self._dense(activation, path, accuracy) - exact)))

        enough = loosest({accuracy: error(accuracy) for accuracy in _ACCURACIES})
        return [
            Cost(
                f"{_INTEGRATOR}, accuracy {'1e-3 (default)' if accuracy is None else f'{accuracy:g}'}",
                self._timed(activation, path, accuracy, repeats), error(accuracy), accuracy is None,
            )
            for accuracy in (None, enough)
        ]  # fmt: skip

    def _dense(self, activation: float, path: Path, accuracy: float | None) -> Array:
        found = self._ask("dense", activation=activation, accuracy=accuracy, every_s=_EVERY_S, **_corners(path))
        # Corners on the grid come twice.
        time_s, first = np.unique(np.round(found["time_s"], 9), return_index=True)
        force: Array = np.interp(path.sample_s, time_s, np.array(found["force_f0"])[first])
        return force

    def _timed(self, activation: float, path: Path, accuracy: float | None, repeats: int) -> list[float]:
        found = self._ask("timed", activation=activation, accuracy=accuracy, repeats=repeats, **_corners(path))
        return list(found["seconds"])

    def _ask(self, what: str, **more: Any) -> dict[str, Any]:
        self._program.take(self._muscle)
        return self._program.ask({"do": what, **more})


def _corners(path: Path) -> dict[str, list[float]]:
    return {"corner_s": path.corner_s.tolist(), "corner_l0": path.corner_l0.tolist()}
