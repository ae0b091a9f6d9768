"""The node's account of itself as diagnostic_msgs, once a second."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from xb_muscle_ros.models.registry import slack_of
from xb_muscle_ros.node.inlet import Refused
from xb_muscle_ros.node.rules import Counts
from xb_muscle_ros.node.status import Status

# A refusal that has lasted this long is no hiccup, s.
_LASTING_S = 1.0


_STOPPED, _AGAIN = "stopped: ", "; call ~/reset to start again"


@dataclass
class Report:
    """Everything a report is made from.

    Attributes:
        node, fibre, model, mode, state: names; `state` is that of the lifecycle.
        fibres: how many there are.
        status: of the stepping; None where none is configured.
        rate_hz: steps per second since the last report.
        input_age_s: since the last length sample that was taken; None where there was none.
        refused: how often input was refused, by reason.
        odd: input that was taken but is worth knowing of, by reason.
        ignored_names: names in messages that belong to no fibre here.
        cpu_share: of one core since the last report, whole process.
        overruns_new, timeouts_new: since the last report.
        timeout_s: allowed age of the newest length sample; 0 for any.
        pushed: fibre and force (F0) of the strongest push since the last report; None where all pulled.
        now_s: steady time of the report, s.
        refusing: see `xb_muscle_ros.node.inlet.Inlet`.
        lost: messages that did not come since the last reset, in words, by topic.
        lost_new: how many since the last report, by topic.
        driven_by: what the fibres are sent, ``length`` or ``load``.
    """

    node: str
    mode: str
    state: str
    fibre: str = ""
    fibres: int = 0
    model: str = ""
    status: Status | None = None
    rate_hz: float = 0.0
    input_age_s: float | None = None
    refused: Counts = field(default_factory=Counts)
    odd: Counts = field(default_factory=Counts)
    ignored_names: int = 0
    cpu_share: float = 0.0
    overruns_new: int = 0
    timeouts_new: int = 0
    timeout_s: float = 0.0
    pushed: tuple[str, float] | None = None
    now_s: float = 0.0
    refusing: Mapping[tuple[str, str], Refused] = field(default_factory=dict)
    lost: Mapping[str, str] = field(default_factory=dict)
    lost_new: Mapping[str, int] = field(default_factory=dict)
    driven_by: str = "length"


def status_name(node: str) -> str:
    """Name of the node's status, as ROS has it: node, then task."""
    return f"{node.lstrip('/')}: stepping"


def fault_in(status: DiagnosticStatus) -> str:
    """Why stepping stopped, as the node's status tells it; empty where it did not."""
    text = str(status.message)
    return text.removeprefix(_STOPPED).removesuffix(_AGAIN) if text.startswith(_STOPPED) else ""


def diagnostics(report: Report) -> DiagnosticArray:
    """Message for ``/diagnostics``; the sender adds the stamp."""
    level, text = _verdict(report)
    return DiagnosticArray(
        status=[
            DiagnosticStatus(
                level=level,
                name=status_name(report.node),
                message=text,
                hardware_id=report.fibre,
                values=[KeyValue(key=key, value=value) for key, value in _values(report).items()],
            )
        ]
    )


def _verdict(report: Report) -> tuple[bytes, str]:
    status = report.status
    refused, odd = report.refused.new(), report.odd.new()
    if status is None or report.state != "active":
        return DiagnosticStatus.OK, report.state
    if status.fault:
        return DiagnosticStatus.ERROR, f"{_STOPPED}{status.fault}{_AGAIN}"
    remarks = [status.waiting] if status.waiting else []
    level = DiagnosticStatus.WARN
    age_s = report.input_age_s
    since = "since the state was loaded" if age_s is None else f"for {age_s:.3f} s"
    if status.on_timeout:
        # The force goes on, but is no longer an answer to anything.
        level = DiagnosticStatus.ERROR
        remarks.append(f"no {report.driven_by} {since}: {status.on_timeout}")
    elif not status.waiting and 0.0 < report.timeout_s < (age_s or 0.0):
        remarks.append(f"no {report.driven_by} {since}")
    elif report.timeouts_new:
        remarks.append(f"no {report.driven_by} in time {report.timeouts_new} times")
    lasting = [(*key, entry) for key, entry in report.refusing.items() if report.now_s - entry.since_s >= _LASTING_S]
    for topic, whose, entry in lasting[:1]:
        of, more = f" of {whose}" if whose else "", f" ({len(lasting) - 1} more likewise)" if lasting[1:] else ""
        # While calcium is waited for there is nothing wrong with the length; one bad sample may have been the last.
        if entry.times > 1 and not entry.text.startswith("waiting for calcium"):
            level = DiagnosticStatus.ERROR
        seconds = report.now_s - entry.since_s
        remarks.append(f"no {topic}{of} taken for {seconds:.0f} s, newest refused: {entry.text}{more}")
    if refused:
        remarks.append(f"refused {refused} samples")
    remarks += [f"lost {count} {topic} messages" for topic, count in report.lost_new.items() if count]
    if odd:
        remarks.append(f"odd input {odd} times")
    if report.overruns_new:
        remarks.append(f"{report.overruns_new} overruns")
    if report.pushed is not None:
        fibre, force_f0 = report.pushed
        slack = slack_of(report.model)
        remedy = f" (model {slack} does not)" if slack else ""
        remarks.append(f"{fibre} pushes, {force_f0:.3g} F0, where a muscle would be slack{remedy}")
    return (level, "; ".join(remarks)) if remarks else (DiagnosticStatus.OK, "stepping")


def _values(report: Report) -> Mapping[str, str]:
    values = {
        "state": report.state,
        "mode": report.mode,
        "fibre": report.fibre,
        "fibres": str(report.fibres),
        "model": report.model,
        "rate (Hz)": f"{report.rate_hz:.1f}",
        "input age (s)": "none yet" if report.input_age_s is None else f"{report.input_age_s:.3f}",
        "CPU (share of one core)": f"{report.cpu_share:.3f}",
    }
    status = report.status
    if status is not None:
        values["ticks"] = str(status.ticks)
        values["state violations"] = str(status.violations)
        if status.lateness is not None:
            late = status.lateness
            values["ticks since reset"] = str(late.ticks)
            values["lateness p50 (µs)"] = f"{late.p50_us:.1f}"
            values["lateness p99 (µs)"] = f"{late.p99_us:.1f}"
            values["lateness p99.9 (µs)"] = f"{late.p999_us:.1f}"
            values["lateness max (µs)"] = f"{late.max_us:.1f}"
            values["overruns"] = str(status.overruns)
            values["dropped ticks"] = str(status.dropped)
            values["timeouts"] = str(status.timeouts)
    values["refused"] = str(sum(report.refused.values()))
    values.update({f"refused: {reason}": str(count) for reason, count in sorted(report.refused.items())})
    values.update({f"odd: {reason}": str(count) for reason, count in sorted(report.odd.items())})
    values.update({f"lost: {topic}": told for topic, told in report.lost.items()})
    values["ignored names"] = str(report.ignored_names)
    return values
