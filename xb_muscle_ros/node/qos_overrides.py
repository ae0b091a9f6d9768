"""Quality of service in parameter files: wrong values are refused, what has no effect is named."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSPolicyKind, QoSReliabilityPolicy

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.node.foreign_keys import shortened

PREFIX = "qos_overrides."
POLICIES = (QoSPolicyKind.HISTORY, QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY)

# By topic, as the node names them: what it is there, whatever drives it, and by the parameter ``control``.
_ENDS: Mapping[str, str] = {
    "muscle/calcium": "subscription",
    "muscle/force": "publisher",
    "muscle/moments": "publisher",
}
_DRIVEN: Mapping[str, Mapping[str, str]] = {
    "length": {"muscle/length": "subscription"},
    "force": {"muscle/load": "subscription", "muscle/length": "publisher"},
}

# Their overrides are rclpy's own affair, and a dump has them.
_OF_ROS = ("/clock", "/parameter_events", "/rosout")
_CHOICES = {"history": QoSHistoryPolicy, "reliability": QoSReliabilityPolicy, "durability": QoSDurabilityPolicy}
_DEPTH = (1, 1_000_000)


def look_at_overrides(node: Any, control: str) -> UserError | None:
    """Check what a node was given, and warn of what concerns nothing it has; returns what is wrong.

    Args:
        control: the parameter.
    """
    ends = {node.resolve_topic_name(topic): end for topic, end in {**_DRIVEN[control], **_ENDS}.items()}
    given = {f"{PREFIX}{name}": p.value for name, p in node.get_parameters_by_prefix(PREFIX[:-1]).items()}
    try:
        idle = without_effect(given, ends)
    except UserError as error:
        return error
    if idle:
        node.get_logger().warning(told(idle, node.get_fully_qualified_name(), ends))
    return None


def without_effect(given: Mapping[str, object], ends: Mapping[str, str]) -> list[str]:
    """Check overrides; returns the names of those that concern nothing this node has.

    Args:
        given: parameters by name, those below ``qos_overrides`` among them.
        ends: ``subscription`` or ``publisher`` by the topic's full name.

    Raises:
        UserError: a policy or a value of one of the node's topics that ROS does not have.
    """
    found = []
    for name in (name for name in given if name.startswith(PREFIX)):
        topic, _, rest = name.removeprefix(PREFIX).partition(".")
        end, _, policy = rest.partition(".")
        if ends.get(topic) == end:
            _check(name, policy, given[name])
        elif topic not in _OF_ROS:
            found.append(name)
    return found


def told(names: list[str], node: str, ends: Mapping[str, str]) -> str:
    """What to say of overrides that have no effect."""
    known = ", ".join(f"{topic}.{end}" for topic, end in ends.items())
    return f"overrides without effect, {node} has none of these: {shortened(names)}; it has {known} (full names)"


def _check(name: str, policy: str, value: object) -> None:
    allowed = [kind.name.lower() for kind in POLICIES]
    if policy not in allowed:
        raise UserError(f"parameter '{name}' is not known; allowed is {', '.join(allowed)}{suggest(policy, allowed)}")
    if policy == "depth":
        if type(value) is not int or not _DEPTH[0] <= value <= _DEPTH[1]:
            raise UserError(
                f"parameter '{name}' is {value!r}; it takes a whole number, {_DEPTH[0]} to {_DEPTH[1]} messages"
            )
        return
    choices = [member.lower() for member in _CHOICES[policy].__members__ if member != "UNKNOWN"]
    if not isinstance(value, str) or value.lower() not in choices:
        raise UserError(f"parameter '{name}' is {value!r}; allowed is {' or '.join(choices)}")
