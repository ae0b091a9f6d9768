"""The muscle node: length and calcium in, force out, or load in and length out; a lifecycle node."""

# rclpy has types for a part of itself only.
# mypy: allow-untyped-calls, allow-subclassing-any

from __future__ import annotations

import gc
import time
from collections.abc import Sequence
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.strain_bins import wide_bins_line
from xb_muscle_ros.node.control import CONTROLS
from xb_muscle_ros.node.graph import Namesakes, survive_wrong_transitions
from xb_muscle_ros.node.inlet import Inlet
from xb_muscle_ros.node.listening import Listening, overridable
from xb_muscle_ros.node.lockstep import Lockstep
from xb_muscle_ros.node.names import enumerated
from xb_muscle_ros.node.outputs import OutputMessages
from xb_muscle_ros.node.parameter_gate import ParameterGate
from xb_muscle_ros.node.privileges import drop_priority, lock_memory, take_priority, unlock_memory
from xb_muscle_ros.node.realtime import Realtime, Settings
from xb_muscle_ros.node.reporter import Reporter
from xb_muscle_ros.node.saved_state import StateFile
from xb_muscle_ros.node.traffic import as_bytes


class MuscleNode(LifecycleNode):
    """One fibre on the ROS graph, or many that share topics and ticks.

    Attributes:
        finished: whether the lifecycle has come to its end.
        failure: why the last transition failed; None where it did not.
    """

    def __init__(self, **options: Any) -> None:
        """Declare parameters; nothing else happens until the node is configured.

        Args:
            options: as for `rclpy.node.Node`.
        """
        super().__init__("muscle_node", automatically_declare_parameters_from_overrides=True, **options)
        self.finished = False
        self.failure: UserError | None = None
        self._gate = ParameterGate(self, self._use_fibre, self._use_settings)
        self._mode: str = self._gate.value("mode")
        self._control = CONTROLS[self._gate.value("control")]
        self._stepping: Lockstep | Realtime | None = None
        self._inlet: Inlet | None = None
        self._listening: Listening | None = None
        # While the program starts the node, the caller tells what is wrong.
        self._starting = False
        self._outlets: list[Any] = []
        self._reporter = Reporter(self, self._mode, self._control.topic)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self._state_file = StateFile(
            self._mode, lambda: str(self._gate.value("state_file")), lambda: self._stepping, self.get_logger()
        )
        self.create_service(Trigger, "~/save_state", self._state_file.on_save)
        self.create_service(Trigger, "~/load_state", self._state_file.on_load)
        self._namesakes = Namesakes(self)
        # The default timer would follow ROS time, which may stand still.
        self._clock_of_reports = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._report, clock=self._clock_of_reports)
        survive_wrong_transitions(self)

    def autostart(self) -> None:
        """Configure and activate, if the parameter says so.

        Raises:
            UserError: what is wrong with the configuration.
        """
        if not self._gate.value("autostart"):
            if self._gate.error is not None:
                self.get_logger().error(str(self._gate.error))
            return
        self._starting = True
        for transition in (self.trigger_configure, self.trigger_activate):
            if transition() != TransitionCallbackReturn.SUCCESS:
                raise self.failure or UserError("the node could not be started; its log says why")
        self._starting = False

    def close(self) -> None:
        """Stop stepping; the node can then be destroyed."""
        if self._stepping is not None:
            self._stepping.stop()

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Build the fibres and connect to the topics."""
        try:
            fibres = self._gate.configure()
            self._connect(fibres)
            if self._gate.value("load_state_at_start"):
                self._state_file.load_at_start()
        except UserError as error:
            return self._fail(error)
        except Exception as error:
            # rclpy keeps quiet about exceptions in transitions.
            return self._fail(UserError(f"{type(error).__name__}: {error}"))
        names = enumerated([fibre.name for fibre in fibres])
        who = f"fibre {names}" if len(fibres) == 1 else f"{len(fibres)} fibres ({names})"
        self.get_logger().info(f"{who}, model {fibres[0].model}, mode {self._mode}; {_constants(fibres)}")
        for line in dict.fromkeys(wide_bins_line(fibre.values) for fibre in fibres):
            if line:
                self.get_logger().warning(line)
        return super().on_configure(state)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start stepping."""
        result = super().on_activate(state)
        # What is there now stays; the collector need not look at it again, in the middle of a tick.
        gc.collect()
        gc.freeze()
        if self._gate.value("lock_memory"):
            lock_memory(self.get_logger())
        priority = self._gate.value("realtime_priority")
        if self._mode == "realtime" and priority > 1:
            # Whoever holds the interpreter must not be pushed aside while a tick waits for it: callbacks rank next.
            take_priority(priority - 1, self.get_logger())
        self._set_active(True)
        if self._stepping is not None:
            self._stepping.start()
        self.get_logger().info(f"active: waiting for muscle/calcium and muscle/{self._control.topic}")
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop stepping; the state is kept."""
        self._halt()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget the fibres and leave the topics."""
        self._free()
        return super().on_cleanup(state)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End; the process follows."""
        self._halt()
        self._free()
        self.finished = True
        return super().on_shutdown(state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Back to unconfigured."""
        self._halt()
        self._free()
        return super().on_error(state)

    def _connect(self, fibres: Sequence[Fibre]) -> None:
        by_load = self._control.topic == "load"
        self._outlets = [
            self.create_lifecycle_publisher(JointState, f"muscle/{topic}", _output_qos(), **overridable())
            for topic in ("force", "moments", *(("length",) if by_load else ()))
        ]
        names = [fibre.name for fibre in fibres]
        force, moments, *length = self._outlets
        outlet = OutputMessages(names, force, moments, as_bytes(), *length)
        self._stepping = stepping = self._made(fibres, outlet)
        self._inlet = inlet = Inlet(names, stepping, self.get_logger())
        self._listening = Listening(self, inlet, self._mode, self._control.topic)
        self._reporter.watch(fibres, stepping, inlet, outlet, self._listening.arrivals)

    def _made(self, fibres: Sequence[Fibre], outlet: OutputMessages) -> Lockstep | Realtime:
        batch = MuscleBatch(fibres)
        # The first settling loads what later ones need.
        batch.muscles[0].settle(0.0, 0.1)
        self._control.warm(batch)
        log = self.get_logger()
        if self._mode == "lockstep":
            threads = self._gate.value("threads")
            return Lockstep(batch, outlet.publish, log, self._simulated_time, threads, self._control)
        return Realtime(batch, self._settings(), outlet.publish, self._now_ns, log, self._simulated_time, self._control)

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _set_active(self, active: bool) -> None:
        self._gate.active = active
        if self._listening is not None:
            self._listening.open(active)

    def _halt(self) -> None:
        self._set_active(False)
        if self._stepping is not None:
            self._stepping.stop()
        gc.unfreeze()
        drop_priority()
        if self._gate.value("lock_memory"):
            unlock_memory()

    def _free(self) -> None:
        if self._listening is not None:
            self._listening.close()
        for publisher in self._outlets:
            self.destroy_lifecycle_publisher(publisher)
        self._outlets.clear()
        self._reporter.forget()
        self._stepping = None
        self._inlet = self._listening = None
        self._gate.release()

    def _fail(self, error: UserError) -> TransitionCallbackReturn:
        self.failure = error
        if not self._starting:
            self.get_logger().error(f"cannot be configured: {error}")
        self._free()
        return TransitionCallbackReturn.FAILURE

    def _simulated_time(self) -> bool:
        return bool(self.get_parameter("use_sim_time").value)

    def _settings(self) -> Settings:
        return Settings(*(self._gate.value(name) for name in Settings._fields))

    def _use_settings(self) -> None:
        if isinstance(self._stepping, Realtime):
            self._stepping.settings = self._settings()
        elif self._stepping is not None:
            self._stepping.threads = self._gate.value("threads")

    def _use_fibre(self, index: int, fibre: Fibre) -> None:
        if self._stepping is not None:
            self._stepping.replace(index, fibre)

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self._stepping is None:
            response.message = "the node is not configured; there is nothing to reset"
            return response
        account = self._stepping.reset()
        if self._listening is not None:
            self._listening.reset()
        response.success = True
        constants = _constants(self._gate.fibres)
        topic = self._control.topic
        response.message = (
            f"state forgotten after {account.told(topic)}; the next {topic} sample settles anew; {constants}"
        )
        return response

    def _report(self) -> None:
        label = self._state_machine.current_state[1]
        self._reporter.report(label, time.monotonic(), self._gate.value("timeout_s"))
        self._namesakes.look()
        if self._listening is not None:
            self._listening.look()


def _constants(fibres: Sequence[Fibre]) -> str:
    """One L0 and one F0 in words; of many fibres only where they have the same."""
    found = {(fibre.reference_length_m, fibre.f0_n) for fibre in fibres}
    if len(found) > 1:
        return "L0 and F0 differ between fibres"
    length, force = found.pop()
    return f"1 L0 = {length:g} m, 1 F0 = {force:g} N"


def _output_qos() -> QoSProfile:
    return QoSProfile(depth=100, reliability=QoSReliabilityPolicy.RELIABLE)
