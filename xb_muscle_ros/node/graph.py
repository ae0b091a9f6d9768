"""What a node finds on the graph, and how it answers there to what is not allowed."""

from __future__ import annotations

from typing import Any

# Discovery takes 0.1 s, at times some seconds.
_LOOKS = 10


class Namesakes:
    """Looks for another node of the same full name, for some seconds after the start."""

    def __init__(self, node: Any) -> None:
        self._node = node
        self._looks = _LOOKS

    def look(self) -> None:
        """Look once; says so at the first that is found."""
        if self._looks <= 0:
            return
        self._looks -= 1
        name, space = self._node.get_name(), self._node.get_namespace()
        found = self._node.get_node_names_and_namespaces().count((name, space))
        if found > 1:
            self._looks = 0
            self._node.get_logger().warning(
                f"{found} nodes are called {self._node.get_fully_qualified_name()} (one that was killed counts for up "
                "to 20 s more): services and parameters reach any of them, and all answer to the same topics; end the "
                "others, or start this one with "
                "--ros-args -r __node:=NAME or -r __ns:=/NAMESPACE"
            )


def survive_wrong_transitions(node: Any) -> None:
    """Answer a transition that is not allowed with failure; rclpy would end the process over it."""
    service = node._service_change_state
    answer = service.callback

    def safely(request: Any, response: Any) -> Any:
        try:
            return answer(request, response)
        except Exception as error:
            node.get_logger().warning(" ".join(f"transition refused: {error}".split()))
            response.success = False
            return response

    service.callback = safely
