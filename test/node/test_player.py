"""The player finds the right node, and says what is wrong with another."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import DataWarning, UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.trials.simulated import MOMENTS
from xb_muscle_ros.trials.trial import Trial, TrialFacts

FIBRE = "18Dec2017a"
TRIAL = Trial(TrialFacts(FIBRE, "short"), np.arange(5) * 1e-3, np.ones(5), np.zeros(1), np.ones(1))


REFERENCE_M, F0_N = 0.0199, 3.3


@pytest.fixture(scope="module")
def node(start: Callable[..., Any]) -> Any:
    """A node in lockstep to which nobody talks."""
    return start(mode="lockstep", meet=False)


def wavy_trial(name: str = "wavy", samples: int = 700, start_s: float = 3.7) -> Trial:
    """Length that wobbles, uneven stamps, and calcium that changes at, between and close to samples."""
    rng = np.random.default_rng(20)
    time_s = start_s + np.cumsum(rng.choice([5e-4, 1e-3, 2e-3], samples))
    time_s = np.round(time_s * 1e9) / 1e9
    phase = 2 * np.pi * 3 * (time_s - time_s[0])
    length_l0 = 1.0 + 0.03 * np.sin(phase) + 0.001 * rng.standard_normal(samples)
    at = time_s[[samples // 10, samples // 10 + 1, samples // 3, samples // 2]]
    calcium_time_s = np.array([start_s - 1.0, at[0], at[1], at[2] + 2e-4, at[3] - 1e-9])
    return Trial(
        TrialFacts(FIBRE, name, reference_length_m=REFERENCE_M, f0_n=F0_N),
        time_s,
        REFERENCE_M * length_l0,
        calcium_time_s,
        np.array([0.2, 1.0, 31.6, 0.5, 2.0]),
    )


def loop(muscle: Muscle, trial: Trial) -> dict[str, Any]:
    """The convention written out once more, sample by sample: what the node has to answer."""
    stamps = [round(float(t) * 1e9) for t in trial.time_s]
    calcium_stamps = [round(float(t) * 1e9) for t in trial.calcium_time_s]
    state: Any = None
    rows = []
    for k, stamp in enumerate(stamps):
        asked = stamps[max(k - 1, 0)]
        calcium = [float(c) for s, c in zip(calcium_stamps, trial.calcium_um, strict=True) if s <= asked][-1]
        change = float(trial.length_m[k]) / REFERENCE_M - 1.0
        if state is None:
            state = muscle.settle(change, calcium)
        else:
            state = muscle.step(state, change, calcium, (stamp - stamps[k - 1]) / 1e9)
        rows.append(muscle.outputs(state))
    columns = {name: np.array([getattr(row, name) for row in rows]) for name in rows[0]._fields}
    return {
        "force_n": columns["force_f0"] * F0_N,
        "ce_length_m": REFERENCE_M * (1.0 + columns["ce_length_change_l0"]),
        "ce_velocity_m_per_s": REFERENCE_M * columns["ce_velocity_l0_per_s"],
        **{name: columns[name] for name in MOMENTS},
    }


def assert_same_bits(simulated: Any, expected: dict[str, Any]) -> None:
    """Every output equal to the last bit."""
    for name, values in expected.items():
        found = simulated.moments[name] if name in MOMENTS else getattr(simulated, name)
        np.testing.assert_array_equal(found, values, err_msg=name)


@pytest.mark.slow
def test_force_over_dds_is_offline_force_bit_for_bit(node: Any, muscle: Muscle) -> None:
    """Through real DDS and back, with calcium that changes on the way; twice, from one node."""
    from xb_muscle_ros.node.client.live import play_live

    trials = [wavy_trial("first"), wavy_trial("second", 300, start_s=0.0)]
    played = play_live(trials, muscle.fibre, namespace=node.namespace, domain_id=node.domain)
    assert len(played) == 2
    for trial, simulated in zip(trials, played, strict=True):
        np.testing.assert_array_equal(simulated.time_s, trial.time_s)
        assert np.ptp(simulated.force_n) > 0.1
        assert_same_bits(simulated, loop(muscle, trial))


def test_the_offline_replay_agrees_with_the_node(muscle: Muscle) -> None:
    """What `replay` computes offline is the same loop."""
    from xb_muscle_ros.simulation.offline import simulate_trial

    trial = wavy_trial()
    assert_same_bits(simulate_trial(muscle, trial), loop(muscle, trial))


@pytest.mark.slow
def test_calcium_that_came_late_is_noticed_and_the_trial_played_again(
    node: Any, muscle: Muscle, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The player asks the node whether calcium came in time, and repeats more slowly if not."""
    from xb_muscle_ros.node.client.link import Link
    from xb_muscle_ros.node.client.live import play_live

    reset, lied = Link.reset, []

    def lie_once(link: Link) -> Any:
        account = reset(link)
        if account.length and not lied:
            lied.append(account)
            return account._replace(late=1)
        return account

    monkeypatch.setattr(Link, "reset", lie_once)
    trial = wavy_trial(samples=60)
    trial = dataclasses.replace(trial, calcium_time_s=trial.calcium_time_s[:2], calcium_um=trial.calcium_um[:2])
    (simulated,) = play_live([trial], namespace=node.namespace, domain_id=node.domain)
    assert len(lied) == 1
    assert_same_bits(simulated, loop(muscle, trial))


def test_without_a_node_the_command_is_named(domain: int) -> None:
    """What to type in another terminal."""
    from xb_muscle_ros.node.client.live import play_live

    with pytest.raises(UserError, match=r"start one in another terminal: muscle_node .*18Dec2017a.*lockstep"):
        play_live([TRIAL], find_s=0.3, namespace="/nobody", domain_id=domain)


def test_nothing_to_play_needs_no_node(domain: int) -> None:
    """An empty list is no error."""
    from xb_muscle_ros.node.client.live import play_live

    assert play_live([], domain_id=domain) == []


def test_another_fibre_or_model_is_refused(node: Any) -> None:
    """Fibre, model and every value must be those of the node."""
    from xb_muscle_ros.node.client.live import play_live

    where = {"namespace": node.namespace, "domain_id": node.domain}
    other = dataclasses.replace(TRIAL, facts=TrialFacts("13Dec2017a", "short"))
    with pytest.raises(UserError, match=r"has fibre 18Dec2017a, trial short is of fibre 13Dec2017a"):
        play_live([other], **where)
    with pytest.raises(UserError, match=r"has model = 3state_coop, needed is 2state"):
        play_live([TRIAL], load_fibre(FIBRE, model="2state"), **where)
    fibre = load_fibre(FIBRE)
    changed = dataclasses.replace(fibre, values={**fibre.values, "f": 1.0})
    with pytest.raises(UserError, match=r"has models.3state_coop.f = .*, needed is 1.0"):
        play_live([TRIAL], changed, **where)


def test_realtime_is_refused(start: Callable[..., Any]) -> None:
    """A node by the clock cannot be played sample by sample."""
    from xb_muscle_ros.node.client.live import play_live

    driver = start(mode="realtime")
    with pytest.raises(UserError, match=r"has mode = realtime, needed is lockstep"):
        play_live([TRIAL], namespace=driver.namespace, domain_id=driver.domain)


@pytest.mark.slow
def test_a_second_publisher_is_refused(start: Callable[..., Any]) -> None:
    """Here it is the driver of these tests."""
    from xb_muscle_ros.node.client.live import play_live

    driver = start(mode="lockstep")
    trials = [wavy_trial(f"trial {k}", 300) for k in range(150)]
    # The player may meet the node before it hears of the other publisher, by some seconds at most.
    with pytest.raises(UserError, match="more publishers"):
        play_live(trials, namespace=driver.namespace, domain_id=driver.domain)


@pytest.mark.slow
def test_who_listens_too_late_is_told_of(node: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A recorder that comes into the middle of a trial has a bag without its beginning."""
    from xb_muscle_ros.node.client.link import Link
    from xb_muscle_ros.node.client.live import play_live
    from xb_muscle_ros.node.client.player import Player
    from xb_muscle_ros.node.client.wires import reliable
    from xb_muscle_ros.node.traffic import subscribe

    wait = Player._await
    with Link("latecomer", node.namespace, node.domain) as late:
        heard: list[Any] = []

        def wait_with_company(player: Player, window: range, *rest: Any) -> None:
            if not heard:
                heard.append(subscribe(late.node, "muscle/length", lambda message: None, reliable()))
                publisher = player._driver.publisher
                assert player._link.wait_for(lambda: publisher.get_subscription_count() > 1, 30.0)
            wait(player, window, *rest)

        monkeypatch.setattr(Player, "_await", wait_with_company)
        with pytest.warns(
            DataWarning,
            match=r"trial short: more subscriptions came while .* \(1 of .*/muscle/length\); start recorders",
        ):
            play_live([TRIAL], namespace=node.namespace, domain_id=node.domain)


def test_a_stop_at_the_first_sample_has_its_reason(node: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Regression: only what came after the first sample was told of; and the next trial is not held to blame for it."""
    from xb_muscle_ros.node.client.live import playing
    from xb_muscle_ros.node.client.player import Player, Stopped

    where = {"namespace": node.namespace, "domain_id": node.domain}
    with playing([TRIAL], **where) as player:
        player.play(TRIAL)
        begin = player._link.begin

        def stop_instead(send: Any, answered: Any, timeout_s: float, patience_s: float) -> bool:
            player._fault, player._fault_at_s = "fibre f: no rest", float("inf")
            return begin(lambda: None, answered, timeout_s, patience_s)

        with monkeypatch.context() as patch:
            patch.setattr(player._link, "begin", stop_instead)
            patch.setattr(Player, "_on_diagnostics", lambda *_: None)
            with pytest.raises(Stopped, match=r"trial short: node .* stopped: fibre f: no rest"):
                player.play(TRIAL)
        player._fault_at_s = 0.0
        player.play(TRIAL)


@pytest.mark.slow
def test_no_answer_names_trial_and_stamp(node: Any) -> None:
    """A sample that the node refuses is never answered."""
    from xb_muscle_ros.node.client.live import play_live

    length = np.array([1.0, 1.0, 9.0, 1.0, 1.0])
    trial = dataclasses.replace(TRIAL, length_m=length)
    with pytest.raises(UserError, match=r"trial short: .* no force for the sample stamped 0.002000000 s within 1 s"):
        play_live([trial], timeout_s=1.0, namespace=node.namespace, domain_id=node.domain)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"calcium_time_s": np.array([1.0])}, "no calcium is known at its first"),
        ({"time_s": np.arange(5) * 1e-10}, "stamps do not ascend"),
    ],
)
def test_a_trial_that_cannot_travel_is_refused(change: dict[str, Any], words: str, domain: int) -> None:
    """Before anything is sent."""
    from xb_muscle_ros.node.client.travelling import Plan

    with pytest.raises(UserError, match=words):
        Plan.of(dataclasses.replace(TRIAL, **change))
