"""A client of a running muscle node: finds it, asks it, talks to its topics."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import rclpy
from lifecycle_msgs.srv import GetState  # type: ignore[import-untyped, unused-ignore]  # typed on some installs only
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import Trigger

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.program import make_executor, serve_once, take_in_news
from xb_muscle_ros.node.status import Account

_ANSWER_S = 10.0
_SEND_AGAIN_S = 3.0


def _never() -> bool:
    return False


def _node(name: str, namespace: str, domain_id: int | None) -> Any:
    """A node in a context of its own, and deaf to the arguments of the program that uses it."""
    context = Context()
    try:
        context.init(args=[], domain_id=domain_id)
        return rclpy.create_node(
            name, context=context, namespace=namespace, use_global_arguments=False, enable_rosout=False
        )
    except Exception as error:
        raise UserError(f"ROS 2 cannot be started: {error}; check ROS_DOMAIN_ID and the network") from error


class Link:
    """A node of its own with a muscle node on the other side; closes with the ``with`` block.

    Attributes:
        node: the rclpy node.
        peer: full name of the muscle node; empty until found.
        stop: asked while waiting; where it says so, no wait goes on.
    """

    def __init__(self, name: str = "", namespace: str = "", domain_id: int | None = None, node: Any = None) -> None:
        """Join the graph.

        Args:
            name, namespace: of the node that is made.
            domain_id: of ROS; None stands for that of the environment.
            node: in its place, one that is there already; closing ends it and its context.

        Raises:
            UserError: ROS cannot be started.
        """
        self.peer = ""
        self.stop: Callable[[], bool] = _never
        self.node = node or _node(name, namespace, domain_id)
        self._context = self.node.context
        self._executor = make_executor(self._context)
        self._executor.add_node(self.node)

    def __enter__(self) -> Link:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave the graph."""
        self._executor.remove_node(self.node)
        self._executor.shutdown()
        take_in_news()
        self.node.destroy_node()
        self._context.try_shutdown()

    def wait_for(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Serve callbacks until a condition holds; False where it does not within the time."""
        end = time.monotonic() + timeout_s
        while not condition():
            rest = end - time.monotonic()
            if rest <= 0.0 or self.stop():
                return False
            serve_once(self._executor, min(rest, 0.05))
        return True

    def find(self, timeout_s: float, start_command: str) -> None:
        """Find the one node that publishes ``muscle/force`` in this namespace.

        Raises:
            UserError: none within the time, or several.
        """
        topic = self.node.resolve_topic_name("muscle/force")

        def names() -> set[str]:
            ends = self.node.get_publishers_info_by_topic(topic)
            found = {f"{end.node_namespace.rstrip('/')}/{end.node_name}" for end in ends}
            # For a moment after a node appears its publishers are known but its name is not.
            return {name for name in found if "_NODE_NAME_UNKNOWN_" not in name}

        if not self.wait_for(lambda: bool(names()), timeout_s):
            raise UserError(
                f"no active muscle_node publishes {topic} (looked for {timeout_s:g} s); start one in another terminal: "
                f"{start_command}"
            )
        found = names()
        if len(found) > 1:
            raise UserError(f"{topic} is published by {', '.join(sorted(found))}; leave one of them running")
        self.peer = found.pop()

    def call(self, kind: Any, service: str, request: Any, timeout_s: float = _ANSWER_S) -> Any:
        """Response of a service of the muscle node, for example ``reset``.

        A request may get lost while the node does not know of this client yet, so it is sent again from time to time:
        the first response counts.

        Raises:
            UserError: no response.
        """
        client = self.node.create_client(kind, f"{self.peer}/{service}")
        try:
            end = time.monotonic() + timeout_s
            futures: list[Any] = []
            while (rest := end - time.monotonic()) > 0.0 and not self.stop():
                if self.wait_for(client.service_is_ready, rest):
                    futures.append(client.call_async(request))
                    self.wait_for(lambda: any(future.done() for future in futures), min(rest, _SEND_AGAIN_S))
                done = [future.result() for future in futures if future.done()]
                if done:
                    return done[0]
        finally:
            self.node.destroy_client(client)
        raise UserError(f"node {self.peer} does not answer to {service}; is it still running?")

    def parameters(self, names: list[str]) -> dict[str, Any]:
        """Values of the muscle node's parameters; those it does not have are absent."""
        values = self.call(GetParameters, "get_parameters", GetParameters.Request(names=names)).values
        if len(values) == len(names):
            return {name: parameter_value_to_python(value) for name, value in zip(names, values, strict=True)}
        if len(names) == 1:
            return {}
        # One unknown name empties the whole answer; ask one by one.
        return {name: value for one in names for name, value in self.parameters([one]).items()}

    def check(self, wanted: Mapping[str, object], command: str, more: Sequence[str] = ()) -> dict[str, Any]:
        """Values of the muscle node's parameters, some of which must be those wanted, `more` whatever they are.

        Raises:
            UserError: one is not as wanted; `command` starts a node that would do.
        """
        found = self.parameters([*wanted, *more])
        for name, value in wanted.items():
            if found.get(name) != value:
                raise UserError(
                    f"node {self.peer} has {name} = {found.get(name, 'none')}, needed is {value}; end the node and "
                    f"start another: {command}"
                )
        return found

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Set parameters of the muscle node, all or none.

        Raises:
            UserError: refused; with the node's reason.
        """
        messages = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
        request = SetParametersAtomically.Request(parameters=messages)
        result = self.call(SetParametersAtomically, "set_parameters_atomically", request).result
        if not result.successful:
            raise UserError(f"node {self.peer}: {result.reason}")

    def state(self) -> str:
        """State of the muscle node's lifecycle."""
        return str(self.call(GetState, "get_state", GetState.Request()).current_state.label)

    def check_active(self) -> None:
        """See whether the muscle node is active.

        Raises:
            UserError: it is not; with the command that makes it so.
        """
        state = self.state()
        if state != "active":
            raise UserError(f"node {self.peer} is {state}; activate it: ros2 lifecycle set {self.peer} activate")

    def reset(self) -> Account:
        """Make the muscle node forget its state; returns what it had taken since the last reset.

        Raises:
            UserError: it does not.
        """
        response = self.call(Trigger, "reset", Trigger.Request())
        if not response.success:
            raise UserError(f"node {self.peer}: {response.message}")
        account = Account.read(response.message)
        if account is None:
            raise UserError(f"node {self.peer} answers to reset with '{response.message}'; use the same version there")
        return account

    def begin(
        self, send: Callable[[], None], answered: Callable[[], bool], timeout_s: float, patience_s: float
    ) -> bool:
        """Reset the muscle node and send it something, both again while its answers may not find their way yet.

        Args:
            send: called after every reset.
            answered: whether the answer is there.
            timeout_s, patience_s: longest wait in all, and for one answer, s.

        Returns:
            whether an answer came.
        """
        end = time.monotonic() + timeout_s
        while True:
            self.reset()
            send()
            if self.wait_for(answered, patience_s):
                return True
            if time.monotonic() >= end:
                return False
