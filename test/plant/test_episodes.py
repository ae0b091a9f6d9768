"""Episodes with a muscle node that is played here: what would have been waited for without end."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.plant.plant import Architecture

mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")
pytest.importorskip("rclpy", reason="needs ROS")

FOREVER_S = 30.0


class Mass:
    """A body with one muscle that goes wrong at a tick."""

    def __init__(self, wrong: Exception | None = None, at: int = 20) -> None:
        from xb_muscle_ros.plant.body import Joints

        self.muscles = [Architecture("biceps", 500.0, 0.1, 0.0, 0.2)]
        self.fibres = [load_fibre("18Dec2017a")]
        self.tick_s, self.tick, self.reflexive = 1e-3, 0, False
        self.model = mujoco.MjModel.from_xml_string("<mujoco/>")
        self.data = mujoco.MjData(self.model)
        self.length_l0 = self.velocity_l0_per_s = np.zeros(1)
        self.calcium = [(0, np.ones(1))]
        self.over, self.state = "", "somewhere"
        self.joints = Joints(["elbow"], [0.0], [0.0], [0.0])
        self._wrong, self._at = wrong, at

    def restart(self) -> None:
        """Back to tick 0."""
        self.tick = 0

    def advance(self, force_f0: Any) -> None:
        """Go on, or go wrong."""
        del force_f0
        self.tick += 1
        if self._wrong is not None and self.tick >= self._at:
            raise self._wrong


@pytest.fixture
def episodes(new_domain: Callable[[], int], monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Any]]:
    """Makes episodes of a body in real time, on a graph without a muscle node; one is pretended."""
    import rclpy
    from rclpy.context import Context

    from xb_muscle_ros.plant.episodes import Episodes

    made: list[Any] = []

    def make(body: Mass, forces: bool, **more: Any) -> Any:
        context = Context()
        context.init(args=[], domain_id=new_domain())
        node = rclpy.create_node("plant_node", context=context)
        given = {"mode": "realtime", "episodes": 1, "duration_s": 0.1, "timeout_s": 0.2, "give_up_s": 0.0}
        end_s = time.monotonic() + FOREVER_S
        player = Episodes(node, body, {**given, "display_hz": 0.0, **more}, lambda: time.monotonic() > end_s)
        end, link = player._end, player._link
        monkeypatch.setattr(end, "find", lambda *_: False)
        monkeypatch.setattr(link, "reset", lambda: None)
        monkeypatch.setattr(link, "peer", "/muscle_node")
        send = end.send_length

        def answered(*arguments: Any) -> None:
            send(*arguments)
            if forces:
                end.newest = np.ones(1), time.monotonic()

        monkeypatch.setattr(end, "send_length", answered)
        made.append(player)
        return player

    yield make
    for player in made:
        player.close()


def test_a_body_that_nobody_stops_plays_to_its_end(episodes: Callable[..., Any]) -> None:
    """The pretended node does."""
    body = Mass()
    episodes(body, True, episodes=2).run()
    assert body.tick == 100


def test_a_tendon_without_a_length_ends_the_episode(episodes: Callable[..., Any]) -> None:
    player = episodes(Mass(UserError("the tendon has no length")), True)
    with pytest.raises(UserError, match="episode 1 ended before its time: the tendon has no length; last state: some"):
        player.run()


def test_an_error_of_the_ticks_thread_is_not_swallowed(episodes: Callable[..., Any]) -> None:
    """The main thread would wait for ticks that never come."""
    player = episodes(Mass(RuntimeError("broken")), True)
    with pytest.raises(RuntimeError, match="broken"):
        player.run()


def test_a_fibre_that_has_stopped_ends_the_episode_with_the_node_s_own_words(
    episodes: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In real time such a node says so in its diagnostics, once a second, and sends no force of that fibre."""
    player = episodes(Mass(), False)
    waited = player._link.wait_for

    def told(condition: Callable[[], bool], timeout_s: float) -> bool:
        player._end.stuck, player._end.trouble = True, "stopped: biceps: state q2"
        return bool(waited(condition, timeout_s))

    monkeypatch.setattr(player._link, "wait_for", told)
    with pytest.raises(UserError, match=r"muscle_node takes no more lengths \(stopped: biceps: state q2\)"):
        player.run()


def test_a_node_without_a_word_is_given_up(episodes: Callable[..., Any]) -> None:
    player = episodes(Mass(), False, give_up_s=1.0)
    with pytest.raises(UserError, match=r"gave up after \d s \(give_up_s is 1\): node /muscle_node sends no force"):
        player.run()
