"""Every parameter passes here: declared from the tables, checked whole before it is set, applied after."""

# mypy: allow-untyped-calls, allow-subclassing-any

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.parameter import Parameter

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, fibre_from_parameters
from xb_muscle_ros.node.configuration import (
    WHERE,
    Configured,
    configure,
    configure_many,
    declared,
    on_top,
    said_by_files,
)
from xb_muscle_ros.node.foreign_keys import foreign_keys, ignored
from xb_muscle_ros.node.parameters import (
    INACTIVE,
    NODE_PARAMETERS,
    OF_GRIDS,
    START,
    TEXTS,
    UNCONFIGURED,
    NotDeclared,
    check_fibre_parameter,
    check_value,
    fibre_descriptor,
    is_fibre_parameter,
    is_foreign,
    is_text,
    meant_as_number,
    row_descriptor,
    unknown,
)
from xb_muscle_ros.node.qos_overrides import look_at_overrides


class ParameterGate:
    """Parameters of one node.

    A node of one fibre has its parameters under their own names; a node of many has those of each under its name.

    Attributes:
        active: whether the node is active; the node keeps this up to date.
        error: what was wrong with the node's own parameters at the start; configuring then fails with it.
        on_fibre: called with the fibre's place and the new fibre when a physical parameter was set while configured.
        on_settings: called when a parameter of the node was set.
    """

    def __init__(self, node: Any, on_fibre: Callable[[int, Fibre], None], on_settings: Callable[[], None]) -> None:
        """Take over what the command line and parameter files gave to a node that declared all of it as it came."""
        self.active = False
        self.error: UserError | None = None
        self.on_fibre = on_fibre
        self.on_settings = on_settings
        self._node = node
        self._own_hand = False
        # By the prefix of their parameters: empty for the fibre of a node of one, its name and a dot for one of many.
        # Empty while unconfigured.
        self._made: dict[str, Configured] = {}
        self._derived: list[str] = []
        self._earlier: set[str] = set()
        self._given: dict[str, object] = {}
        came = node.get_parameters_by_prefix("").items()
        overrides: dict[str, object] = {name: p.value for name, p in came if not is_foreign(name)}
        for name in overrides:
            node.undeclare_parameter(name)
        self._declare_own(overrides)
        self.error = self.error or look_at_overrides(node, self.value("control"))
        for name, value in self._own_of(overrides).items():
            self._give(name, value)
        for name in TEXTS:
            if not node.has_parameter(name):
                self._declare(name, "")
        # A whole fibre that came as parameters is as good as a file, and yields to one that is named later.
        whole = not (self.value("fiber_file") or self.many)
        self._came: dict[str, object] = dict(self._given) if whole else {}
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

    @property
    def fibres(self) -> list[Fibre]:
        """What the parameters amount to; empty while unconfigured."""
        return [made.fibre for made in self._made.values()]

    def configure(self) -> list[Fibre]:
        """Build the fibres; their parameters, defaults included, are then declared.

        Raises:
            UserError: whatever is wrong with the parameters.
        """
        if self.error is not None:
            raise self.error
        self._made = self._configured()
        self._leave_to_the_files()
        shown = declared({prefix: made.values for prefix, made in self._made.items()})
        with self._by_own_hand():
            for name, value in shown.items():
                if self._node.has_parameter(name):
                    self._node.set_parameters([Parameter(name, value=value)])
                else:
                    self._declare(name, value)
                    self._derived.append(name)
            for name in {*self._came} - {*shown, *TEXTS}:
                if self._node.has_parameter(name):
                    self._node.undeclare_parameter(name)
        return self.fibres

    def _configured(self) -> dict[str, Configured]:
        file: str = self.value("fiber_file")
        given = on_top(self._given, self._came, bool(file) or self.many)
        if not self.many:
            return {"": configure(file, given, self._node.get_fully_qualified_name())}
        names, files = ([*filter(None, self.value(name))] for name in ("fibers", "fiber_files"))
        if bool(files) == bool(file):
            found = "both" if file else "none"
            raise UserError(f"many fibres need 'fiber_files', or 'fiber_file' for all of them, found {found}; give one")
        made = configure_many(names, files or [file] * len(names), given, self._ignore, self._earlier)
        self._earlier |= {*made}
        return {f"{name}.": pair for name, pair in made.items()}

    def release(self) -> None:
        """Back to what was given; parameters that came from a file are no longer declared."""
        self._leave_to_the_files()
        self._made = {}
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
                    value = check_value(name, row, overrides[name])
                except UserError as error:
                    self.error = self.error or error
            self._node.declare_parameter(name, value, row_descriptor(row), ignore_override=True)

    def _own_of(self, overrides: Mapping[str, object]) -> dict[str, object]:
        """What was given for fibres; keys of other nodes are left out."""
        names = [name for name in overrides if is_fibre_parameter(name)]
        foreign: list[str] = []
        try:
            # What has a dot may be of one of many fibres, whose names are known when configuring.
            foreign = foreign_keys([n for n in names if not (self.many and "." in n)], {*NODE_PARAMETERS, *TEXTS})
        except UserError as error:
            self.error = self.error or error
        if foreign:
            self._ignore(foreign)
        return {name: overrides[name] for name in names if name not in foreign}

    def _ignore(self, names: Sequence[str]) -> None:
        self._node.get_logger().warning(ignored(names, self._node.get_fully_qualified_name()))
        for name in names:
            self._given.pop(name, None)

    def _leave_to_the_files(self) -> None:
        """Forget what was given where a fibre's file says the same: with another file it would hide what that says."""
        for name in said_by_files(self._given, {prefix: made.of_file for prefix, made in self._made.items()}):
            del self._given[name]
            if self._node.has_parameter(name) and name not in TEXTS:
                self._derived.append(name)

    def _give(self, name: str, value: object) -> None:
        self._given[name] = str(value) if is_text(name) else value
        try:
            value = str(value) if is_text(name) else check_fibre_parameter(name, value)
            self._declare(name, value)
        except UserError:
            # Configuring will say what is wrong with it, with the whole set at hand.
            return

    def _declare(self, name: str, value: object) -> None:
        self._node.declare_parameter(name, value, fibre_descriptor(name), ignore_override=True)

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
                raise NotDeclared(unknown(name, self._node.get_parameters_by_prefix("")))
            if self._node.get_parameter(name).type_ == Parameter.Type.DOUBLE:
                parameter = meant_as_number(parameter)
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
                    row = NODE_PARAMETERS[name]
                    if check_value(name, row, value) != check_value(name, row, self.value(name)):
                        self._check_moment(name, row.when)
                elif is_fibre_parameter(name):
                    physical[name] = value
            self._check_fibre(physical)
        except UserError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _check_moment(self, name: str, when: str) -> None:
        # Read-only ones are refused before this is asked.
        wrong = (when == UNCONFIGURED and self._made) or (when == INACTIVE and self.active)
        if wrong or when == START:
            remedy = "clean up first" if when == UNCONFIGURED else "deactivate first"
            raise UserError(f"parameter '{name}' can be set {when} only; {remedy}")

    def _check_fibre(self, new: dict[str, object]) -> None:
        if not self._made:
            for name, value in new.items():
                if not is_text(name):
                    check_fibre_parameter(name, value)
            return
        for prefix, values in self._by_fibre(new).items():
            old, before = self._made[prefix].values, self._made[prefix].fibre.values
            for name, value in values.items():
                if is_text(name) and value != old[name]:
                    self._check_moment(f"{prefix}{name}", UNCONFIGURED)
            fibre = fibre_from_parameters({**old, **values}, WHERE)
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
        if "" in self._made:
            return {"": dict(new)} if new else {}
        split: dict[str, dict[str, object]] = {}
        for name, value in new.items():
            head, _, rest = name.partition(".")
            if f"{head}." in self._made:
                split.setdefault(f"{head}.", {})[rest] = value
            elif value != self.value(name):
                own = f", or set that of one fibre, '{next(iter(self._made))}{name}'" if "." in name else ""
                raise UserError(f"parameter '{name}' is common to all fibres and can be set {UNCONFIGURED} only{own}")
        return split

    def _apply(self, parameters: list[Any]) -> None:
        if self._own_hand:
            return
        physical = {p.name: p.value for p in parameters if is_fibre_parameter(p.name)}
        for prefix, values in self._by_fibre(physical).items() if self._made else ():
            old = self._made[prefix].values
            new = {name: value for name, value in values.items() if value != old.get(name)}
            if new:
                old.update(new)
                fibre = fibre_from_parameters(old, WHERE)
                self._made[prefix] = self._made[prefix]._replace(fibre=fibre)
                self.on_fibre([*self._made].index(prefix), fibre)
            # What is set to what it is, as by loading a dump, is still the file's.
            self._given.update({f"{prefix}{name}": value for name, value in new.items()})
        if not self._made:
            self._given.update(physical)
        if any(p.name in NODE_PARAMETERS for p in parameters):
            self.on_settings()
