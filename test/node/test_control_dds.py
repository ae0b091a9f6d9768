"""A node under force control on the other side of DDS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.models.clamping import clamp_run
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle

FIBRE = "18Dec2017a"
PATIENCE_S = 30.0


def test_loads_in_lengths_out(new_domain: Callable[[], int]) -> None:
    """Lengths are those without ROS, to the bit, in metres; force is the load."""
    from node_driver import Driver
    from sensor_msgs.msg import JointState

    from xb_muscle_ros.node.client.process import NodeProcess

    domain = new_domain()
    fibre = load_fibre(FIBRE)
    muscle = Muscle(fibre)
    isometric = muscle.outputs(muscle.settle(0.0, 5.0)).force_f0
    loads = np.concatenate([np.full(5, isometric), isometric * np.linspace(0.9, 0.3, 40)])
    with NodeProcess(domain, {"fiber_file": FIBRE, "mode": "lockstep", "control": "force"}) as process:
        driver = Driver(process, domain, "")
        lengths: list[Any] = []
        driver.link.node.create_subscription(JointState, "muscle/length", lengths.append, 100)
        driver.ready()
        node = driver.link.node
        assert driver.link.wait_for(lambda: bool(node.count_publishers("muscle/length")), PATIENCE_S), process.log()
        # Both sides know each other once an answer has come.
        end = 0
        while not lengths and end < 30:
            driver.link.reset()
            driver.send("calcium", 0.0, 5.0)
            driver.send("load", 0.0, effort=[0.5 * fibre.f0_n])
            driver.link.wait_for(lambda: bool(lengths), 1.0)
            end += 1
        driver.link.reset()
        driver.link.wait_for(lambda: False, 0.3)
        lengths.clear()
        driver.forces.clear()
        driver.send("calcium", 0.0, 5.0)
        for k, load in enumerate(loads):
            driver.send("load", 1.0 + 1e-3 * k, effort=[load * fibre.f0_n])
        full = loads.size
        assert driver.link.wait_for(lambda: len(lengths) >= full and len(driver.forces) >= full, PATIENCE_S), (
            process.log()
        )
        report = driver.report(lambda values: True)
        driver.link.close()
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in lengths])
    dt_s = np.diff(stamps) / 1e9
    borne = loads * fibre.f0_n / fibre.f0_n
    states = clamp_run(muscle, muscle.settle(0.0, 5.0), dt_s, borne, np.full(full, 5.0))
    assert [m.position[0] for m in lengths] == [fibre.reference_length_m * (1.0 + c) for c in states[:, -3]]
    assert [m.effort[0] / fibre.f0_n for m in driver.forces[1:]] == pytest.approx(loads[1:], abs=1e-6)
    assert report["message"] == "stepping"


@pytest.mark.parametrize(
    ("protocol", "control", "options"),
    [
        ("force-clamp", "force", {"load": [0.2, 0.6], "rate": 1000.0, "hold": 0.1}),
        ("twitch", "length", {"rate": 1000.0, "duration": 0.3}),
        ("ramp-hold", "length", {"pca": 6.1, "hold": 0.1}),
    ],
)
def test_a_protocol_through_a_node(
    new_domain: Callable[[], int], monkeypatch: pytest.MonkeyPatch, protocol: str, control: str, options: dict[str, Any]
) -> None:
    """The same bits as sample by sample without ROS, and the same table."""
    import xb_muscle_ros as xb
    from xb_muscle_ros.node.client.process import NodeProcess

    domain = new_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    told: list[str] = []
    with NodeProcess(domain, {"fiber_file": FIBRE, "mode": "lockstep", "control": control}):
        live = xb.run_protocol(protocol, FIBRE, live=True, tell=told.append, **options)
    if control == "force":
        (offline,) = xb.run_protocol(protocol, FIBRE, tell=told.append, **options).results
        (found,) = live.results
        assert found.column("shortening_l0_per_s") == pytest.approx(offline.column("shortening_l0_per_s"), rel=1e-6)
        assert np.all(found.column("held_within_f0") < 1e-6)
        return
    again = xb.analyse_protocol(
        protocol, [_measured(trial) for trial in live.trials], model="3state_coop", tell=told.append
    )
    for one, other in zip(live.results[0].runs, again.results[1].runs, strict=True):
        assert one.force_f0.tolist() == other.force_f0.tolist()


def test_a_load_that_is_not_borne_leaves_the_others(
    new_domain: Callable[[], int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As offline, with the node's reason, and without waiting for an answer that never comes."""
    import xb_muscle_ros as xb
    from xb_muscle_ros.node.client.process import NodeProcess

    domain = new_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    # The load begins between two samples.
    options = {"load": [0.2, 2.9, 0.6], "rate": 1000.0, "hold": 0.1, "lead": 0.1003}
    told: list[str] = []
    (offline,) = xb.run_protocol("force-clamp", FIBRE, tell=told.append, **options).results
    (left_out,) = [line for line in told if "is left out" in line]
    told.clear()
    with NodeProcess(domain, {"fiber_file": FIBRE, "mode": "lockstep", "control": "force"}):
        (live,) = xb.run_protocol("force-clamp", FIBRE, live=True, tell=told.append, **options).results
    (line,) = [line for line in told if "is left out" in line]
    assert line.startswith("trial clamp_load2900_pca45: node /muscle_node stopped: fibre 18Dec2017a: load of ")
    assert "is more than the fibre bears" in line
    assert "is more than the fibre bears" in left_out
    assert live.column("load") == pytest.approx(offline.column("load"), abs=1e-8)
    assert live.column("shortening_l0_per_s") == pytest.approx(offline.column("shortening_l0_per_s"), rel=1e-8)
    for one, other in zip(live.runs, offline.runs, strict=True):
        assert one.setting("load_f0") == pytest.approx(other.setting("load_f0"), abs=1e-8)


def test_a_stop_for_another_reason_ends_the_protocol(monkeypatch: pytest.MonkeyPatch) -> None:
    """As offline: a state out of its bounds is no load that is not borne."""
    from collections.abc import Iterator
    from contextlib import contextmanager

    import xb_muscle_ros as xb
    from xb_muscle_ros.node.client import live, player

    class Ill:
        def play(self, trial: Any, shares: Any = None) -> Any:
            raise player.Stopped(f"trial {trial.facts.trial}: node /n stopped: fibre f: state drx became 3")

    @contextmanager
    def playing(*_: Any, **__: Any) -> Iterator[Any]:
        yield Ill()

    monkeypatch.setattr(live, "playing", playing)
    for protocol in ("force-clamp", "twitch"):
        with pytest.raises(xb.UserError, match="state drx became 3"):
            xb.run_protocol(protocol, FIBRE, live=True, tell=lambda line: None)


def test_the_other_control_is_one_line(new_domain: Callable[[], int], monkeypatch: pytest.MonkeyPatch) -> None:
    import xb_muscle_ros as xb
    from xb_muscle_ros.node.client.process import NodeProcess

    domain = new_domain()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
    with (
        NodeProcess(domain, {"fiber_file": FIBRE, "mode": "lockstep"}),
        pytest.raises(xb.UserError, match=r"control.*force"),
    ):
        xb.run_protocol("force-clamp", FIBRE, live=True, load=0.5, tell=lambda line: None)
    with pytest.raises(xb.UserError, match="--live leaves settling to the node"):
        xb.run_protocol("force-clamp", FIBRE, live=True, settle=1.0)


def _measured(trial: Any) -> Any:
    from dataclasses import replace

    return replace(trial, force_is_measured=True)
