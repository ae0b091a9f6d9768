"""Every parameter passes here: declared from the tables, checked whole before it is set, applied after."""

# mypy: allow-untyped-calls, allow-subclassing-any

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.parameter import Parameter

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, fibre_from_parameters
from xb_muscle_ros.models.parameters import CONSTANTS, PARAMETERS, checked
from xb_muscle_ros.node.configuration import GROUPS, WHERE, configure, configure_many
from xb_muscle_ros.node.parameters import (
    INACTIVE,
    NODE_PARAMETERS,
    OF_GRIDS,
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

    A node of one fibre has its parameters under their own names; a node of many has those of each under its name.

    Attributes:
        fibres: what the parameters amount to, by the prefix of their parameters: empty for the fibre of a node of one,
            its name and a dot for one of many. Empty while unconfigured.
        active: whether the node is active; the node keeps this up to date.
        error: what was wrong with the node's own parameters at the start; configuring then fails with it.
        on_fibre: called with the fibre's place and the new fibre when a physical parameter was set while configured.
        on_settings: called when a parameter of the node was set.
    """

    def __init__(self, node: Any, on_fibre: Callable[[int, Fibre], None], on_settings: Callable[[], None]) -> None:
        """Take over what the command line and parameter files gave to a node that declared all of it as it came."""
        self.fibres: dict[str, Fibre] = {}
        self.active = False
        self.error: UserError | None = None
        self.on_fibre = on_fibre
        self.on_settings = on_settings
        self._node = node
        self._own_hand = False
        # Of every fibre, by the same prefix, then by flat name.
        self._values: dict[str, dict[str, object]] = {}
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

    @property
    def many(self) -> bool:
        """Whether the parameters ask for many fibres (one, perhaps) rather than for the fibre of a node of one."""
        return any(any(self.value(name)) for name in ("fiber_files", "fibers"))

    def configure(self) -> list[Fibre]:
        """Build the fibres; their parameters, defaults included, are then declared.

        Raises:
            UserError: whatever is wrong with the parameters.
        """
        if self.error is not None:
            raise self.error
        made = self._made()
        self.fibres = {prefix: fibre for prefix, (fibre, _) in made.items()}
        self._values = {prefix: values for prefix, (_, values) in made.items()}
        with self._by_own_hand():
            for name, value in self._declared().items():
                if self._node.has_parameter(name):
                    self._node.set_parameters([Parameter(name, value=value)])
                else:
                    self._declare(name, value)
                    self._derived.append(name)
        return list(self.fibres.values())

    def _made(self) -> Mapping[str, tuple[Fibre, dict[str, object]]]:
        file: str = self.value("fiber_file")
        if not self.many:
            return {"": configure(file, self._given)}
        names, files = ([*filter(None, self.value(name))] for name in ("fibers", "fiber_files"))
        if bool(files) == bool(file):
            found = "both" if file else "none"
            raise UserError(f"many fibres need 'fiber_files', or 'fiber_file' for all of them, found {found}; give one")
        made = configure_many(names, files or [file] * len(names), self._given)
        return {f"{name}.": pair for name, pair in made.items()}

    def _declared(self) -> dict[str, object]:
        """Parameters by name and value; of many fibres only those that differ, and only of the set in use."""
        if "" in self._values:
            return self._values[""]
        first = next(iter(self._values.values()))
        shown: dict[str, object] = {name: first[name] for name in ("model", "method")}
        for prefix, values in self._values.items():
            for name, value in values.items():
                if name == "source" or name.startswith(("models.", "constants.")):
                    shown[f"{prefix}{name}"] = value
        return shown

    def release(self) -> None:
        """Back to what was given; parameters that came from a file are no longer declared."""
        self.fibres = {}
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
        # What begins with another name may be of one of many fibres, whose names are known when configuring.
        if not is_text(name) and not (rest and (head in ("constants", "models") or self.many)):
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
        if head not in GROUPS and rest:
            head, _, rest = rest.partition(".")
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
        wrong = (when == UNCONFIGURED and self.fibres) or (when == INACTIVE and self.active)
        if wrong or when == START:
            remedy = "clean up first" if when == UNCONFIGURED else "deactivate first"
            raise UserError(f"parameter '{name}' can be set {when} only; {remedy}")

    def _check_fibre(self, new: dict[str, object]) -> None:
        if not self.fibres:
            for name, value in new.items():
                if not is_text(name):
                    self._checked(name, value)
            return
        for prefix, values in self._by_fibre(new).items():
            old = self._values[prefix]
            for name, value in values.items():
                if is_text(name) and value != old[name]:
                    self._check_moment(f"{prefix}{name}", UNCONFIGURED)
            fibre = fibre_from_parameters({**old, **values}, WHERE)
            before = self.fibres[prefix].values
            if (fibre.values["smoothing"] > 0.0) != (before["smoothing"] > 0.0):
                raise UserError(f"parameter 'smoothing' can be switched on or off {UNCONFIGURED} only; clean up first")
            for name in OF_GRIDS:
                if fibre.values.get(name) != before.get(name):
                    raise UserError(f"parameter '{name}' can be set {UNCONFIGURED} only; clean up first")

    def _by_fibre(self, new: Mapping[str, object]) -> dict[str, dict[str, object]]:
        """Parameters of the fibres by prefix and flat name.

        Raises:
            UserError: one that is common to many fibres.
        """
        if "" in self.fibres:
            return {"": dict(new)} if new else {}
        split: dict[str, dict[str, object]] = {}
        for name, value in new.items():
            head, _, rest = name.partition(".")
            if f"{head}." in self.fibres:
                split.setdefault(f"{head}.", {})[rest] = value
            elif value != self.value(name):
                own = f", or set that of one fibre, '{next(iter(self.fibres))}{name}'" if "." in name else ""
                raise UserError(f"parameter '{name}' is common to all fibres and can be set {UNCONFIGURED} only{own}")
        return split

    def _apply(self, parameters: list[Any]) -> None:
        if self._own_hand:
            return
        physical = {p.name: p.value for p in parameters if is_fibre_parameter(p.name)}
        if self.fibres:
            for prefix, values in self._by_fibre(physical).items():
                self._values[prefix].update(values)
                fibre = self.fibres[prefix] = fibre_from_parameters(self._values[prefix], WHERE)
                self.on_fibre([*self.fibres].index(prefix), fibre)
        if "" in self.fibres or not self.fibres:
            self._given.update(physical)
        if any(p.name in NODE_PARAMETERS for p in parameters):
            self.on_settings()
