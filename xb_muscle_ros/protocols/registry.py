"""The protocols there are, by name."""

from __future__ import annotations

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.protocols.base import Option, Protocol
from xb_muscle_ros.protocols.force_clamp import ForceClamps
from xb_muscle_ros.protocols.force_pca import ForcePca
from xb_muscle_ros.protocols.force_velocity import ConstantVelocities
from xb_muscle_ros.protocols.ktr import RedevelopmentRates
from xb_muscle_ros.protocols.ramp_hold import RampAndHold
from xb_muscle_ros.protocols.sinusoid import Sinusoid
from xb_muscle_ros.protocols.step import QuickSteps
from xb_muscle_ros.protocols.stretch_shorten_stretch import StretchShortenStretches
from xb_muscle_ros.protocols.tetanus import Tetani
from xb_muscle_ros.protocols.twitch import Twitches
from xb_muscle_ros.protocols.work_loop import WorkLoops

_ALL: tuple[Protocol, ...] = (
    StretchShortenStretches(),
    RampAndHold(),
    QuickSteps(),
    ForcePca(),
    RedevelopmentRates(),
    ForceClamps(),
    ConstantVelocities(),
    Twitches(),
    Tetani(),
    Sinusoid(),
    WorkLoops(),
)
PROTOCOLS: dict[str, Protocol] = {protocol.name: protocol for protocol in _ALL}


def protocol_of(name: str) -> Protocol:
    """The protocol of a name, with hyphens or underscores.

    Raises:
        UserError: there is none.
    """
    found = PROTOCOLS.get(name.replace("_", "-"))
    if found is None:
        raise UserError(f"protocol '{name}' is not known{suggest(name, PROTOCOLS)}")
    return found


def all_options() -> dict[str, list[tuple[Protocol, Option]]]:
    """Options by name, each with the protocols that have it."""
    found: dict[str, list[tuple[Protocol, Option]]] = {}
    for protocol in PROTOCOLS.values():
        for option in protocol.options:
            found.setdefault(option.name, []).append((protocol, option))
    return found
