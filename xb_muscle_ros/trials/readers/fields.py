"""Paths into messages: ``position[0]``, ``wrench.force.z``, ``data``, or by a joint's name ``position[knee]``."""

from __future__ import annotations

import re
from typing import Any

from xb_muscle_ros.errors import UserError

_STEP = re.compile(r"([A-Za-z_]\w*)((?:\[[^\[\]]+\])*)")
# Arrays of a JointState that go by its names.
_BY_NAME = ("position", "velocity", "effort")


class _Joint(str):
    """Name of a joint in the path to a field."""


class FieldPath:
    """The way to one number of a message.

    Attributes:
        text: as the mapping has it.
        joint: the joint it is of, where it goes by name; None elsewhere.
    """

    def __init__(self, text: str, where: str) -> None:
        """Take the path apart.

        Raises:
            UserError: it is no path.
        """
        self.text = text
        self._steps: list[str | int] = []
        for part in text.split("."):
            match = _STEP.fullmatch(part)
            if match is None:
                raise UserError(f"{where}: field '{text}' is no path such as position[0] or wrench.force.z")
            self._steps.append(match.group(1))
            for index in re.findall(r"\[([^\[\]]+)\]", match.group(2)):
                self._steps.append(int(index) if index.isdecimal() else _Joint(index))
        self.joint = next((str(step) for step in self._steps if isinstance(step, _Joint)), None)

    def has_joint(self, message: Any, where: str) -> bool:
        """Whether a message is of the joint; one without names is of none.

        Raises:
            UserError: messages of this type name no joints.
        """
        if self.joint is None:
            return True
        if not hasattr(message, "name"):
            raise UserError(
                f"{where}, {self.text}: there is no joint '{self.joint}', as such messages have no names; give an index"
            )
        return self.joint in message.name

    def joint_at_index(self, message: Any) -> str | None:
        """The joint whose number an index picks in a JointState; None for other messages and paths."""
        if len(self._steps) != 2 or self._steps[0] not in _BY_NAME or not isinstance(self._steps[1], int):
            return None
        names = getattr(message, "name", ())
        return str(names[self._steps[1]]) if isinstance(names, list) and self._steps[1] < len(names) else None

    def value(self, message: Any, where: str) -> float:
        """The number in a message that `has_joint`.

        Raises:
            UserError: there is no such field, or it is no number.
        """
        found = message
        for step in self._steps:
            try:
                if isinstance(step, int):
                    found = found[step]
                elif isinstance(step, _Joint):
                    found = found[list(message.name).index(step)]
                else:
                    found = getattr(found, step)
            except AttributeError:
                fields = [n for n in vars(found) if not n.startswith("_")] if hasattr(found, "__dict__") else []
                raise UserError(
                    f"{where}, {self.text}: there is no {step}; fields: {', '.join(fields) or 'none'}"
                ) from None
            except (IndexError, ValueError, TypeError):
                raise UserError(f"{where}, {self.text}: {self._absent(step, found)}") from None
        try:
            return float(found)
        except (TypeError, ValueError):
            raise UserError(
                f"{where}, {self.text} is a {type(found).__name__}; needed is a number; name an index or a field of it"
            ) from None

    def _absent(self, step: str | int, array: Any) -> str:
        count = len(array) if hasattr(array, "__len__") else None
        if count == 0:
            name = self._steps[self._steps.index(step) - 1]
            return f"{name} is empty; the sender leaves it out; name another field, or record a topic that has it"
        wanted = f"value of joint '{step}'" if isinstance(step, _Joint) else f"value {step}"
        return f"there is no {wanted}" + ("" if count is None else f"; it has {count}")
