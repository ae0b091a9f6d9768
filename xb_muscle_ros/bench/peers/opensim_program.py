"""OpenSim's muscles in a Python of their own: requests as lines of JSON on stdin, answers on stdout.

OpenSim's wheels and ROS 2's need different NumPys, so this file runs by itself and imports nothing of the package.

One muscle runs along a slider between ground and a body. The body weighs 1e12 kg, so that no muscle moves it, and is
given the speed of each straight part of the protocol at its beginning. A coordinate prescribed by a piecewise linear
function would be closer to what models do, but its constraint does not follow a corner: the integrator stops there at
any accuracy (OpenSim 4.6).
"""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections.abc import Callable
from typing import Any

import opensim as osim

_BODY_KG = 1e12
# Of a muscle that has no least activation of its own: at 0 its force-velocity relation cannot be inverted.
_LEAST_ACTIVATION = 1e-3
_STRAINS: dict[str, tuple[Callable[[Any], float], Callable[[Any, float], None]]] = {
    "Millard2012EquilibriumMuscle": (
        lambda muscle: muscle.get_TendonForceLengthCurve().get_strain_at_one_norm_force(),
        lambda muscle, strain: muscle.upd_TendonForceLengthCurve().set_strain_at_one_norm_force(strain),
    ),
    "Thelen2003Muscle": (
        lambda muscle: muscle.get_FmaxTendonStrain(),
        lambda muscle, strain: muscle.set_FmaxTendonStrain(strain),
    ),
    "DeGrooteFregly2016Muscle": (
        lambda muscle: muscle.get_tendon_strain_at_one_norm_force(),
        lambda muscle, strain: muscle.set_tendon_strain_at_one_norm_force(strain),
    ),
}


class Bench:
    """One muscle and the body that pulls on it.

    Attributes:
        muscle: OpenSim's.
    """

    def __init__(self, request: dict[str, Any], report_s: float | None = None) -> None:
        """Build the model.

        Args:
            request: kind, l0_m, f0_n, slack_l0, rigid_tendon, parameters (tendon_strain, vmax_l0_per_s; OpenSim's
                defaults stand for what is left out).
            report_s: interval of a table of forces; None: no table.
        """
        self._l0_m, self._f0_n, self._slack_l0 = (float(request[key]) for key in ("l0_m", "f0_n", "slack_l0"))
        self._model = osim.Model()
        self._model.setGravity(osim.Vec3(0))
        body = osim.Body("body", _BODY_KG, osim.Vec3(0), osim.Inertia(1, 1, 1, 0, 0, 0))
        self._model.addBody(body)
        slider = osim.SliderJoint("slider", self._model.getGround(), body)
        self._model.addJoint(slider)
        self._coordinate = slider.updCoordinate()
        # Fibres are set to their length before they are activated: at the optimum, with a tendon that is just slack.
        self._coordinate.setDefaultValue((1.0 + self._slack_l0) * self._l0_m)
        self.muscle = self._made(request)
        self.muscle.addNewPathPoint("origin", self._model.getGround(), osim.Vec3(0))
        self.muscle.addNewPathPoint("insertion", body, osim.Vec3(0))
        self._model.addForce(self.muscle)
        self._reporter = None
        if report_s is not None:
            self._reporter = osim.TableReporter()
            self._reporter.set_report_time_interval(report_s)
            self._reporter.addToReport(self.muscle.getOutput("tendon_force"), "force")
            self._model.addComponent(self._reporter)
        self._model.finalizeConnections()
        self._model.initSystem()

    def _made(self, request: dict[str, Any]) -> Any:
        kind, parameters = request["kind"], request["parameters"]
        muscle = getattr(osim, kind)()
        muscle.setName("muscle")
        muscle.set_max_isometric_force(self._f0_n)
        muscle.set_optimal_fiber_length(self._l0_m)
        muscle.set_tendon_slack_length(self._slack_l0 * self._l0_m)
        muscle.set_pennation_angle_at_optimal(0.0)
        muscle.set_ignore_tendon_compliance(bool(request["rigid_tendon"]))
        if "vmax_l0_per_s" in parameters:
            muscle.set_max_contraction_velocity(parameters["vmax_l0_per_s"])
        if "tendon_strain" in parameters:
            _STRAINS[kind][1](muscle, parameters["tendon_strain"])
        return muscle

    def started(self, activation: float) -> Any:
        """A state in static equilibrium; excitation equals activation, so that activation stays."""
        state = osim.State(self._model.initializeState())
        self._model.setDefaultControls(osim.Vector(1, activation))
        self.muscle.setActivation(state, activation)
        self._model.equilibrateMuscles(state)
        return state

    def force_f0(self, state: Any) -> float:
        """Force of the tendon, F0."""
        self._model.realizeDynamics(state)
        return float(self.muscle.getTendonForce(state)) / self._f0_n

    def moved(
        self,
        state: Any,
        corner_s: list[float],
        corner_l0: list[float],
        accuracy: float | None,
        stops: Callable[[float, float], list[float]] = lambda start, end: [end],
        see: Callable[[float, Any], None] = lambda stop, state: None,
    ) -> None:
        """Follow a protocol from a state at its first corner.

        Args:
            state: at the first corner.
            corner_s, corner_l0: s and L0, straight between them; the integrator starts anew at each.
            accuracy: of the integrator; None: its own.
            stops: times at which a straight part is stopped to be looked at, its end included.
            see: called with each stop and the state there.
        """
        for k in range(len(corner_s) - 1):
            speed = (corner_l0[k + 1] - corner_l0[k]) / (corner_s[k + 1] - corner_s[k])
            self._coordinate.setSpeedValue(state, speed * self._l0_m)
            manager = osim.Manager(self._model)
            if accuracy is not None:
                manager.setIntegratorAccuracy(accuracy)
            if self._reporter is not None:
                self._reporter.clearTable()
            manager.initialize(state)
            for stop in stops(corner_s[k], corner_s[k + 1]):
                # The manager's own state goes with the manager.
                state = osim.State(manager.integrate(stop))
                see(stop, state)

    def reported(self) -> tuple[list[float], list[float]]:
        """Times (s) and forces (F0) of the table since the last corner."""
        assert self._reporter is not None
        table = self._reporter.getTable()
        force = table.getDependentColumn("force")
        return list(table.getIndependentColumn()), [force[i] / self._f0_n for i in range(table.getNumRows())]


class Program:
    """Answers to requests, one muscle at a time."""

    def __init__(self) -> None:
        self._request: dict[str, Any] = {}
        self._bench: Bench | None = None

    def about(self, request: dict[str, Any]) -> dict[str, Any]:
        """Versions."""
        return {"opensim": osim.GetVersion(), "python": platform.python_version()}

    def muscle(self, request: dict[str, Any]) -> dict[str, Any]:
        """Take a muscle; gives the least activation that it has, and its parameters."""
        self._request, self._bench = request, Bench(request)
        muscle = self._bench.muscle
        least = muscle.get_minimum_activation() if hasattr(muscle, "get_minimum_activation") else _LEAST_ACTIVATION
        values = {
            "tendon_strain": float(_STRAINS[request["kind"]][0](muscle)),
            "vmax_l0_per_s": float(muscle.get_max_contraction_velocity()),
        }
        return {"least_activation": float(least), "parameters": values}

    def isometric(self, request: dict[str, Any]) -> dict[str, Any]:
        """Isometric force at an activation, F0."""
        bench = self._taken()
        return {"force_f0": bench.force_f0(bench.started(request["activation"]))}

    def trial(self, request: dict[str, Any]) -> dict[str, Any]:
        """Force (F0) at times, which steps end at."""
        bench, samples, forces = self._taken(), request["sample_s"], list[float]()

        def stops(start: float, end: float) -> list[float]:
            return [*(t for t in samples if start < t < end), end]

        def see(stop: float, state: Any) -> None:
            if stop in samples:
                forces.append(bench.force_f0(state))

        bench.moved(bench.started(request["activation"]), *self._path(request), stops, see)
        return {"force_f0": forces}

    def dense(self, request: dict[str, Any]) -> dict[str, Any]:
        """Force (F0) at even times by the integrator's own steps, interpolated as OpenSim's reporters do."""
        bench = Bench(self._request, request["every_s"])
        time_s, force = list[float](), list[float]()

        def see(stop: float, state: Any) -> None:
            for kept, new in zip((time_s, force), bench.reported(), strict=True):
                kept += new

        bench.moved(bench.started(request["activation"]), *self._path(request), see=see)
        return {"time_s": time_s, "force_f0": force}

    def timed(self, request: dict[str, Any]) -> dict[str, Any]:
        """Seconds of each of some repeats of a trial from equilibrium; the first, which warms up, is left out."""
        bench, seconds = self._taken(), list[float]()
        for _ in range(request["repeats"] + 1):
            state = bench.started(request["activation"])
            begin = time.perf_counter()
            bench.moved(state, *self._path(request))
            seconds.append(time.perf_counter() - begin)
        return {"seconds": seconds[1:]}

    def _taken(self) -> Bench:
        if self._bench is None:
            raise ValueError("no muscle was taken")
        return self._bench

    @staticmethod
    def _path(request: dict[str, Any]) -> tuple[list[float], list[float], float | None]:
        return request["corner_s"], request["corner_l0"], request["accuracy"]


def main() -> None:
    """Answer until stdin ends."""
    # OpenSim writes to stdout too: answers go to a copy, and what it writes to stderr.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    osim.Logger.setLevelString("Off")
    program = Program()
    requests: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
        "about": program.about,
        "muscle": program.muscle,
        "isometric": program.isometric,
        "trial": program.trial,
        "dense": program.dense,
        "timed": program.timed,
    }
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = requests[request["do"]](request)
        except (RuntimeError, ValueError) as error:
            answer = {"error": " ".join(str(error).split())}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
