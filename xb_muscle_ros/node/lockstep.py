"""Lockstep: one step per length sample, by the samples' own stamps, so that the same input gives the same bits."""

from __future__ import annotations

from collections.abc import Callable

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.muscle import Muscle, Outputs
from xb_muscle_ros.node.inputs import Scale
from xb_muscle_ros.node.status import Log
from xb_muscle_ros.node.timeline import Timeline, stepped

Emit = Callable[[int, Outputs, Scale], None]


class Lockstep(Timeline):
    """Answers every length sample at once, in the callback that brings it.

    Attributes:
        muscle: what is stepped; may be exchanged between samples for one of the same model.
    """

    def __init__(self, muscle: Muscle, scale: Scale, emit: Emit, log: Log, simulated_time: Callable[[], bool]) -> None:
        """Keep what is needed.

        Args:
            muscle: see above.
            scale, log, simulated_time: see `Timeline`.
            emit: called with stamp, outputs and scale of every answer.
        """
        super().__init__(scale, log, simulated_time)
        self.muscle = muscle
        self._emit = emit

    def start(self) -> None:
        """Nothing to start: samples drive it."""

    def stop(self) -> None:
        """Nothing to stop."""

    def take_length(self, stamp: int, position_m: float, velocity_m_per_s: float | None) -> None:
        """Step to a length sample (stamp in ns, m) and emit the answer; the velocity is not needed here.

        Raises:
            Refusal: the sample cannot be integrated.
            UserError: integration failed; it stays stopped until the next reset.
        """
        del velocity_m_per_s
        plan = self.plan(stamp, position_m)
        try:
            state = stepped(self.muscle, plan)
        except UserError as error:
            raise self.failed(plan, error) from error
        self.commit(plan, state)
        self._emit(plan.stamp, self.muscle.outputs(state), self._run.scale)
