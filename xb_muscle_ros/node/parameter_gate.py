"""Every parameter passes here: declared from the tables, checked whole before it is set, applied after."""

# mypy: allow-untyped-calls, allow-subclassing-any

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, fibre_from_parameters
from xb_muscle_ros.models.parameters import CONSTANTS, PARAMETERS, checked
from xb_muscle_ros.node.configuration import WHERE, configure
from xb_muscle_ros.node.parameters import (
    INACTIVE,
    NODE_PARAMETERS,
    START,
    TEXTS,
    UNCONFIGURED,
    check_node_parameter,
    fibre_descriptor,
    is_fibre_parameter,
    is_foreign,
    is_text,
    node_descriptor,
    unknown,
)


class _Unknown(ParameterNotDeclaredException):
    """The one exception that the parameter services turn into a refusal with its text as the reason."""

    def __init__(self, error: UserError) -> None:
        Exception.__init__(self, str(error))


class ParameterGate:
    """Parameters of one node.

    Attributes:
        fibre: what the parameters amount to; None while unconfigured.
        active: whether the node is active; the node keeps this up to date.
        error: what was wrong with the node's own parameters at the start; configuring then fails with it.
        on_fibre: called with the new fibre when a physical parameter was set while configured.
        on_settings: called when a parameter of the node was set.
    """

    def __init__(self, node: Any, on_fibre: Callable[[Fibre], None], on_settings: Callable[[], None]) -> None:
        """Take over what the command line and parameter files gave to a node that declared all of it as it came."""
        self.fibre: Fibre | None = None
        self.active = False
        self.error: UserError | None = None
        self.on_fibre = on_fibre
        self.on_settings = on_settings
        self._node = node
        self._own_hand = False
        self._values: dict[str, object] = {}
        self._derived: list[str] = []
        self._given: dict[str, object] = {}
        overrides: dict[str, object] = {}
        for name, parameter in node.get_parameters_by_prefix("").items():
            if not is_foreign(name):
                overrides[name] = parameter.value
                node.undeclare_parameter(name)
        self._declare_own(overrides)
        for name, value in overrides.items():
            if is_fibre_parameter(name):
                self._give(name, value)
        for name in TEXTS:
            if not node.has_parameter(name):
                self._declare(name, "")
        node.add_pre_set_parameters_callback(self._before)
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def value(self, name: str) -> Any:
        """Value of a declared parameter."""
        return self._node.get_parameter(name).value

    def configure(self) -> Fibre:
        """Build the fibre; its parameters, defaults included, are then declared.

        Raises:
            UserError: whatever is wrong with the parameters.
        """
        if self.error is not None:
            raise self.error
        self.fibre, self._values = configure(self.value("fiber_file"), self._given)
        with self._by_own_hand():
            for name, value in self._values.items():
                if self._node.has_parameter(name):
                    self._node.set_parameters([Parameter(name, value=value)])
                else:
                    self._declare(name, value)
                    self._derived.append(name)
        return self.fibre

    def release(self) -> None:
        """Back to what was given; parameters that came from a file are no longer declared."""
        self.fibre = None
        self._values = {}
        with self._by_own_hand():
            for name in self._derived:
                if self._node.has_parameter(name):
                    self._node.undeclare_parameter(name)
            self._node.set_parameters([Parameter(name, value=self._given.get(name, "")) for name in TEXTS])
        self._derived = []

    def _declare_own(self, overrides: dict[str, object]) -> None:
        for name, row in NODE_PARAMETERS.items():
            value = row.default
            if name in overrides:
                try:
                    value = check_node_parameter(name, overrides[name])
                except UserError as error:
                    self.error = self.error or error
            self._node.declare_parameter(name, value, node_descriptor(name), ignore_override=True)

    def _give(self, name: str, value: object) -> None:
        head, _, rest = name.partition(".")
        if not is_text(name) and not (head in ("constants", "models") and rest):
            self.error = self.error or unknown(name, ("constants", "models"))
            return
        self._given[name] = str(value) if is_text(name) else value
        try:
            value = str(value) if is_text(name) else self._checked(name, value)
            self._declare(name, value)
        except UserError:
            # Configuring will say what is wrong with it, with the whole set at hand.
            return

    def _declare(self, name: str, value: object) -> None:
        self._node.declare_parameter(name, value, fibre_descriptor(name), ignore_override=True)

    def _checked(self, name: str, value: object) -> float:
        head, _, rest = name.partition(".")
        if head == "constants":
            return checked(rest, value, CONSTANTS, WHERE)
        return checked(rest.rpartition(".")[2], value, PARAMETERS, WHERE)

    @contextmanager
    def _by_own_hand(self) -> Iterator[None]:
        self._own_hand = True
        try:
            yield
        finally:
            self._own_hand = False

    def _before(self, parameters: list[Any]) -> list[Any]:
        made = []
        for parameter in parameters:
            name = parameter.name
            if not self._node.has_parameter(name):
                raise _Unknown(unknown(name, self._node.get_parameters_by_prefix("")))
            whole = parameter.type_ == Parameter.Type.INTEGER
            if whole and self._node.get_parameter(name).type_ == Parameter.Type.DOUBLE:
                # On a command line 80 is meant as 80.0.
                parameter = Parameter(name, value=float(parameter.value))
            made.append(parameter)
        return made

    def _check(self, parameters: list[Any]) -> SetParametersResult:
        if self._own_hand:
            return SetParametersResult(successful=True)
        try:
            physical: dict[str, object] = {}
            for parameter in parameters:
                name, value = parameter.name, parameter.value
                if name in NODE_PARAMETERS:
                    check_node_parameter(name, value)
                    self._check_moment(name, NODE_PARAMETERS[name].when)
                elif is_fibre_parameter(name):
                    physical[name] = value
            self._check_fibre(physical)
        except UserError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _check_moment(self, name: str, when: str) -> None:
        # Read-only ones are refused before this is asked.
        wrong = (when == UNCONFIGURED and self.fibre is not None) or (when == INACTIVE and self.active)
        if wrong or when == START:
            remedy = "clean up first" if when == UNCONFIGURED else "deactivate first"
            raise UserError(f"parameter '{name}' can be set {when} only; {remedy}")

    def _check_fibre(self, new: dict[str, object]) -> None:
        if self.fibre is None:
            for name, value in new.items():
                if not is_text(name):
                    self._checked(name, value)
            return
        for name, value in new.items():
            if is_text(name) and value != self._values[name]:
                self._check_moment(name, UNCONFIGURED)
        if new:
            fibre = fibre_from_parameters({**self._values, **new}, WHERE)
            if (fibre.values["smoothing"] > 0.0) != (self.fibre.values["smoothing"] > 0.0):
                raise UserError(f"parameter 'smoothing' can be switched on or off {UNCONFIGURED} only; clean up first")

    def _apply(self, parameters: list[Any]) -> None:
        if self._own_hand:
            return
        physical = {p.name: p.value for p in parameters if is_fibre_parameter(p.name)}
        self._given.update(physical)
        if physical and self.fibre is not None:
            self._values.update(physical)
            self.fibre = fibre_from_parameters(self._values, WHERE)
            self.on_fibre(self.fibre)
        if any(p.name in NODE_PARAMETERS for p in parameters):
            self.on_settings()
