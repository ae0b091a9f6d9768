"""A muscle node in a process of its own, for measurements and tests."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

_PACKAGE_PARENT = Path(__file__).resolve().parents[3]
_PATIENCE_S = 10.0


def private_domain() -> int:
    """A ROS domain that differs between processes: 1 to 101, whose ports the system gives to nobody else."""
    domain = 1 + os.getpid() % 101
    # Not the one that this process may already talk on.
    return domain if str(domain) != os.environ.get("ROS_DOMAIN_ID") else 1 + domain % 101


def child_environment(domain_id: int) -> dict[str, str]:
    """Environment for a node beside this process, heard on this machine only."""
    environment = dict(os.environ)
    # Python with ROS from wheels restarts itself with the path of their libraries unless this says that it has; a child
    # may run under another environment's path, so let it look for itself.
    environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None)
    environment["ROS_DOMAIN_ID"] = str(domain_id)
    environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    path = [str(_PACKAGE_PARENT), *filter(None, [environment.get("PYTHONPATH")])]
    environment["PYTHONPATH"] = os.pathsep.join(path)
    return environment


class NodeProcess:
    """``muscle_node``, or another node of this package, as a child process; ends with the ``with`` block.

    Attributes:
        process: the child.
    """

    def __init__(
        self,
        domain_id: int,
        parameters: Mapping[str, object],
        arguments: Sequence[str] = (),
        module: str = "xb_muscle_ros.node.main",
    ) -> None:
        """Start the node.

        Args:
            domain_id: of ROS.
            parameters: of the node; text, numbers and truth values.
            arguments: further ROS arguments.
            module: of the node.
        """
        command = [sys.executable, "-m", module, "--ros-args", *arguments]
        for name, value in parameters.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            command += ["-p", f"{name}:={text}"]
        self._asked = False
        # Appended to: the child shares this file's position, which `log` moves.
        self._log = tempfile.TemporaryFile("a+", encoding="utf-8")  # noqa: SIM115 - closed at the exit
        self.process = subprocess.Popen(
            command, env=child_environment(domain_id), stdout=self._log, stderr=self._log, stdin=subprocess.DEVNULL
        )

    def log(self) -> str:
        """What the node has written so far."""
        self._log.seek(0)
        return self._log.read()

    def wait(self, timeout_s: float = 30.0) -> int:
        """Exit code once the node has ended by itself.

        Raises:
            subprocess.TimeoutExpired: it did not.
        """
        return self.process.wait(timeout_s)

    def ask_to_stop(self) -> None:
        """Send SIGINT, once, and do not wait."""
        if self.process.poll() is None and not self._asked:
            self._asked = True
            self.process.send_signal(signal.SIGINT)

    def stop(self) -> int:
        """End the node with SIGINT, or by force if that does not do; returns its exit code."""
        if self.process.poll() is None:
            self.ask_to_stop()
            try:
                self.process.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        return self.process.returncode

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._log.close()
