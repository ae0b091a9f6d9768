"""The leg's muscles as fibres of one muscle node in lockstep."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.plant.drives import beyond
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import Drive, FibreMuscles, make_fibres
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.muscle_end import MuscleEnd
from xb_muscle_ros.plant.plant import Architecture, Array
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex


def architectures(fibres: FibreMuscles) -> tuple[Architecture, ...]:
    """Names and constants of the muscles; MyoLeg's paths have no pennation."""
    muscles = fibres.muscles
    rows = zip(muscles.names, muscles.f0_n.tolist(), muscles.l0_m.tolist(), muscles.slack_m.tolist(), strict=True)
    return tuple(Architecture(name, f0_n, l0_m, 0.0, slack_m) for name, f0_n, l0_m, slack_m in rows)


class LiveFibres:
    """Drive whose fibres a node steps; see `Drive`."""

    def __init__(self, body: Body, stance: Stance, link: Link, make: Callable[[Body, Stance], FibreMuscles]) -> None:
        """Find the node, and give it the constants and parameters of all muscles.

        Args:
            body, stance: see `FibreMuscles`.
            link: to the node's namespace.
            make: the same muscles in this process, which find calcium.

        Raises:
            UserError: the node is missing, not the right one, or does not answer.
        """
        inside = make(body, stance)
        self.model, self.driven_by = inside.model, inside.driven_by
        self._inside, self._muscles, self._data, self._link = inside, inside.muscles, body.data, link
        self._period_ns = round(1e9 * body.tick_s)
        self._end = MuscleEnd(link, architectures(inside), inside.muscles.fibres, "lockstep")
        self._end.find()
        self._tick, self._reflex = 0, inside.reflex_loop()
        self.reset()

    def reset(self) -> None:
        """Settle; see `check_calcium`."""
        self.check_calcium()
        self._reflex = self._inside.reflex_loop()
        self._pull(self._end.settle(self._muscles.length_change_l0(self._data), self._inside.calcium_um))

    def advance(self) -> None:
        """Send all lengths, wait for the forces of the same stamp.

        Raises:
            UserError: a length that no fibre has, or no answer.
        """
        self._tick += 1
        length_l0 = self._muscles.length_change_l0(self._data)
        if said := beyond(self._muscles.names, length_l0):
            raise UserError(f"{said}, which the node refuses")
        stamp = self._tick * self._period_ns
        self._end.send_length(stamp, length_l0)
        force_f0 = self._end.answer(stamp)
        if self._reflex is not None:
            self._reflex.observe(self._muscles.fibre_change_l0(length_l0, force_f0), force_f0)
            self._end.send_calcium(stamp + self._reflex.ticks * self._period_ns, self._reflex.ahead)
        self._pull(force_f0)

    def check_calcium(self) -> None:
        """Begin anew, and see whether the node had all calcium in time.

        Raises:
            UserError: it had not, so that forces are not those of the reflex.
        """
        if self._reflex is not None and self._tick:
            remedy = "take a longer delay of the reflex, or leave the machine more time"
            self._end.check_calcium(self._reflex.ticks + 1, remedy)
        self._tick = 0

    def _pull(self, force_f0: Array) -> None:
        self._data.ctrl[self._muscles.index] = -self._muscles.f0_n * force_f0


@contextmanager
def live_drive(
    fibre: Fibre | None,
    source: str,
    elastic: bool,
    reflex: Reflex = NO_REFLEX,
    domain_id: int | None = None,
    namespace: str = "",
) -> Iterator[Callable[[Body, Stance], Drive]]:
    """As `make_drive`, with the fibres in a muscle node.

    Args:
        fibre, source, elastic, reflex: see `make_drive`.
        domain_id: of ROS; None stands for that of the environment.
        namespace: of the node.

    Raises:
        UserError: MuJoCo's muscle was asked for.
    """
    if fibre is None:
        raise UserError("MuJoCo's muscle is none of a muscle_node; give another model")
    make = make_fibres(fibre, source, elastic, reflex)
    drives: list[LiveFibres] = []
    with Link("plant", namespace, domain_id) as link:

        def made(body: Body, stance: Stance) -> Drive:
            drives.append(LiveFibres(body, stance, link, make))
            return drives[-1]

        yield made
        for drive in drives:
            drive.check_calcium()
