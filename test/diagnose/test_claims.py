"""No two sentences of a diagnosis contradict each other, nor any of them its numbers: over whatever may be decided."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_evidence import TRIALS, evidence, fit

from xb_muscle_ros.diagnose.claims import headline, what_it_means
from xb_muscle_ros.diagnose.crossval import HeldOut
from xb_muscle_ros.diagnose.gain import Gain
from xb_muscle_ros.diagnose.mismatch import Bound
from xb_muscle_ros.diagnose.names import Name, Verdict
from xb_muscle_ros.diagnose.report.markup import Markup
from xb_muscle_ros.diagnose.report.verdict import verdict_box
from xb_muscle_ros.diagnose.noise.significance import ALPHA, FLOOR_F0
from xb_muscle_ros.diagnose.summary import summary_text
from xb_muscle_ros.diagnose.verdict import Evidence, decide
from xb_muscle_ros.diagnose.words import likely
from xb_muscle_ros.diagnose.written import filled

Facts = dict[str, Any]


def told(e: Evidence) -> Facts:
    """What `diagnosis.json` holds of a decision, as `plain.as_json` writes it."""
    d, search = decide(e), e.search
    named = d.verdict in (Verdict.PHYSICS, Verdict.MEASUREMENT, Verdict.AMBIGUOUS)
    shown = search.final if named else search.base

    def scores(label: str) -> float | None:
        return e.heldout[label].rmsd_f0 if label in e.heldout else None

    rows = [
        {"name": label, "kind": "base" if not f.explanation.names else "mechanism", "train_rmsd_f0": f.rmsd_f0}
        for label, f in search.fits.items()
    ]
    mismatch = [{"trial": "t0", "phase": "hold", "size_f0": 0.01, "mean_f0": 0.01, "sign": 1, "p_value": 0.002}]
    return filled({
        "fibre": "x", "verdict": d.verdict.value, "answer": [n.value for n in d.answer], "family": d.family,
        "p_value": e.p_value, "confidence": d.confidence, "described": e.described,
        "mismatch": mismatch if e.detected else [], "candidates": rows, "checks": [c._asdict() for c in d.checks],
        "trials": [{"trial": t, "pca": 6.0, "noise_sd_f0": e.noise_f0} for t in TRIALS],
        "before": {"train_rmsd_f0": search.base.rmsd_f0, "heldout_rmsd_f0": scores("base")},
        "after": {"train_rmsd_f0": shown.rmsd_f0, "heldout_rmsd_f0": scores(shown.explanation.label)},
        "start": {"train_rmsd_f0": e.start_rmsd_f0},
        "heldout_gain": d.gain.to_json("x") if d.gain else None,
        "flexible_bound_rmsd_f0": e.bound.flexible_f0 if e.bound else None,
        "linear_heldout": {"before_rmsd_f0": e.bound.before_f0, "after_rmsd_f0": e.bound.after_f0} if e.bound else None,
        "missing": ["more trials"],
    })  # fmt: skip


def all_text(facts: Facts) -> str:
    """Everything that is said of the verdict, tags taken out."""
    box = re.sub(r"<[^>]+>", " ", verdict_box(Markup(), facts))
    checks = ". ".join(f"{c['name']}: {c['passed']} ({c['value']})" for c in facts["checks"])
    return re.sub(r"\s+", " ", f"{summary_text(facts)} {box} {checks}")


# A sentence, and what has to be so where it stands.
TRUE_WHERE: tuple[tuple[str, Callable[[Facts], bool]], ...] = (
    (r"no larger than chance|leaves no more than noise|Nothing beyond chance", lambda f: f["p_value"] >= ALPHA),
    (
        r"is beyond chance|more than chance alone|A real difference|leaves more than noise",
        lambda f: f["p_value"] < ALPHA,
    ),
    (r"nothing but noise|may be noise", lambda f: f["p_value"] >= ALPHA),
    (r"no other physics", lambda f: f["verdict"] in ("none", "parameters") and not f["mismatch"]),
    (r"still differs|is largest in the", lambda f: f["verdict"] not in ("none", "parameters")),
    (r"best explanation|does best|about equally well", lambda f: bool(f["answer"])),
    (r"removes? it|cannot be judged|Nothing is named", lambda f: not f["answer"]),
    (r"error on trials left out of the fit falls|usual trial falls", lambda f: f["heldout_gain"]["better"]),
    (r"is the right explanation", lambda f: bool(f["answer"])),
    (r"held-out trials are predicted better: True", lambda f: f["heldout_gain"]["better"]),
    (r"no better: ", lambda f: not f["heldout_gain"]["better"]),
)
# Sentences of which no two stand together.
APART = (
    r"no other physics", r"[Tt]he best explanation|does best|about equally well",
    r"explanations? fitted|No explanation removes", r"cannot be judged",
)  # fmt: skip
ALSO_APART = (
    (r"no larger than chance|Nothing beyond chance|nothing but noise", r"beyond chance, but|more than chance alone"),
    (r"about equally well|cannot tell which", r"\b(very likely|virtually certain|likely) \("),
    (r"held-out trials are predicted better: False", r"[Tt]he best explanation|does best|about equally well"),
    (r"hardly helps", r"something to be found"),
    (r"the fit falls from", r"the fit (stays the same|hardly falls|rises)"),
)  # fmt: skip


def contradictions(facts: Facts) -> list[str]:
    text = all_text(facts)
    wrong = [said for said, holds in TRUE_WHERE if re.search(said, text) and not holds(facts)]
    pairs = [*itertools.combinations(APART, 2), *ALSO_APART]
    wrong += [f"{a} / {b}" for a, b in pairs if re.search(a, text) and re.search(b, text)]
    for words, share in re.findall(r"tried is ((?:[a-z]+ ){1,6}?)\( ?(\d+) % ?\)", text):
        shares = {likely((int(share) + d) / 100.0) for d in (-0.5, 0.0, 0.5)}
        wrong += [f"{words}({share} %)"] if words.strip() not in shares else []
    for moves, a, b in re.findall(r"(falls|rises|hardly falls) from ([\d.]+) to ([\d.]+) % F0", text):
        if (float(b) < float(a)) != (moves != "rises"):
            wrong.append(f"{moves} from {a} to {b}")
    return wrong


NAMES = (
    Name.VISCOUS_DRAG, Name.PASSIVE_VISCOELASTICITY, Name.WEAKLY_BOUND_HEADS, Name.TRANSDUCER_LAG, Name.FORCE_DRIFT,
)  # fmt: skip
SIZES = (0.0008, 0.0025, 0.0059, 0.0173, 0.0174, 0.03)


@st.composite
def decided(draw: st.DrawFn) -> Evidence:
    """Evidence of any kind: what was left, detected, foretold, and what else would do."""
    base = draw(st.sampled_from(SIZES))
    name = draw(st.sampled_from(NAMES))
    final = fit(base * draw(st.sampled_from((0.05, 0.3, 0.99))), name)
    others = [fit(final.rmsd_f0 * draw(st.sampled_from((1.005, 1.03, 1.3, 4.0))), n) for n in NAMES if n is not name]
    detected = draw(st.booleans())
    p = draw(st.sampled_from((0.002, 0.005) if detected else (0.002, 0.005, 0.04, 0.11, 0.41, 0.9)))
    factors = st.sampled_from((0.05, 0.3, 0.85, 0.99, 0.995, 1.0, 1.1))
    ratios = draw(st.lists(factors, min_size=7, max_size=7))
    alike = draw(st.booleans())
    after = [1.3 * base * (ratios[0] if alike else r) for r in ratios]
    samples = dict.fromkeys(TRIALS, 1000)
    heldout = {
        "base": HeldOut(dict.fromkeys(TRIALS, (1.3 * base) ** 2), samples),
        final.explanation.label: HeldOut({t: r**2 for t, r in zip(TRIALS, after, strict=True)}, samples),
    }
    bound = Bound(1.3 * base, 1.3 * final.rmsd_f0, 1.3 * base * draw(st.sampled_from((0.2, 0.95, 1.1))))
    described = draw(st.sampled_from((True, True, True, False)))
    if not described:
        p = draw(st.sampled_from((0.002, 0.4)))
    return evidence(
        final, *draw(st.sampled_from((others, others[:1], []))), base=base, detected=detected, p_value=p,
        heldout=draw(st.sampled_from((heldout, heldout, heldout, {}))), bound=draw(st.sampled_from((bound, None))),
        start_rmsd_f0=base * draw(st.sampled_from((1.0, 3.0))), described=described,
    )  # fmt: skip


@settings(max_examples=400, deadline=None)
@given(decided())
def test_no_two_sentences_contradict_each_other(e: Evidence) -> None:
    facts = told(e)
    assert contradictions(facts) == [], all_text(facts)
    # What is named predicts trials left out better; what names nothing states no confidence.
    if facts["answer"]:
        assert facts["heldout_gain"]["better"]
        assert facts["heldout_gain"]["gained_f0"] >= FLOOR_F0
    assert (facts["confidence"] is None) == (not facts["answer"])


def test_contradictions_are_seen() -> None:
    """Sentences of the kind that stood side by side before."""
    facts = told(evidence(fit(0.0008), base=0.0008, detected=False, p_value=0.002))
    assert contradictions(facts) == []
    for said in (
        "Nothing beyond chance",
        "That it is right among those tried is unlikely (85 %)",
        "The best explanation",
    ):
        assert contradictions({**facts, "checks": [{"name": said, "passed": True, "value": ""}]}), said


@pytest.mark.parametrize(
    ("changes", "title", "says"),
    [
        ({"p_value": 0.4}, "Nothing beyond chance", "chance alone leaves as much in about 4 of 10"),
        ({"p_value": 0.11}, "Nothing beyond chance", "in about 1 of 10 repeats"),
        ({"p_value": 0.005}, "Nothing large enough to matter", "more than chance alone leaves (in about 5 of 1000"),
        ({"p_value": 0.4, "described": False}, "Recordings that cannot be judged", "it may be nothing but noise"),
    ],
)  # fmt: skip
def test_nothing_found_is_said_by_what_was_found(changes: Facts, title: str, says: str) -> None:
    facts = told(evidence(fit(0.0008), base=0.0008, detected=False, start_rmsd_f0=0.0008, **changes))
    assert headline(facts) == title
    assert says in all_text(facts)
    assert "%)" not in all_text(facts)
    assert what_it_means(facts)


def scores(*rmsds: float) -> HeldOut:
    return HeldOut({t: r**2 for t, r in zip(TRIALS, rmsds, strict=True)}, dict.fromkeys(TRIALS, 1000))


@pytest.mark.parametrize(
    ("before", "after", "faults", "better", "why"),
    [
        ([0.0174] * 7, [0.0173] * 7, False, False, "no better: 1.74 to 1.73 % F0"),
        ([0.0174] * 7, [0.0173] * 7, True, False, "no better: usual error of a trial 1.74 to 1.73 % F0"),
        ([0.0174] * 7, [0.004] * 7, False, True, "1.74 to 0.40 % F0"),
        # A tenth and more, but of next to nothing.
        ([0.0004] * 7, [0.0001] * 7, False, False, "0.3 % F0 of mean square"),
        ([0.004] * 6 + [0.02], [0.0041] * 6 + [0.008], False, False, "not beyond its standard error"),
        ([0.006] * 6 + [0.02], [0.004] * 6 + [0.03], True, True, "usual error"),
        ([0.006] * 6 + [0.02], [0.004] * 6 + [0.03], False, False, "no better"),
        ([0.006] * 7, [0.007] * 7, True, False, "no better"),
    ],
)
def test_what_is_a_gain(before: list[float], after: list[float], faults: bool, better: bool, why: str) -> None:
    gain = Gain.of(scores(*before), scores(*after), faults)
    assert gain.better is better
    assert why in gain.words
    assert gain.words.startswith("no better") is not better
    assert json.loads(json.dumps(gain.to_json("drag")))["better"] is better


@pytest.mark.parametrize("name", [Name.VISCOUS_DRAG, Name.TRANSDUCER_LAG])
def test_what_gains_nothing_on_trials_left_out_is_not_named(name: Name) -> None:
    """From 1.74 to 1.73 % F0 in every trial, however well it fits: not even as one of several."""
    made = evidence(fit(0.0008, name), fit(0.00081, Name.WEAKLY_BOUND_HEADS), base=0.017, interval=None, bound=None)
    heldout = {"base": scores(*[0.0174] * 7), name.value: scores(*[0.0173] * 7)}
    d = decide(replace(made, heldout=heldout))
    assert d.verdict is Verdict.UNEXPLAINED
    assert d.answer == ()
    assert d.confidence is None
    (check,) = [c for c in d.checks if c.name == "held-out trials are predicted better"]
    assert not check.passed
    assert "no better" in check.value
