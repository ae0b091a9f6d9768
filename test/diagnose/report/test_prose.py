"""Headline and summary: never other than the numbers say, whatever the record holds."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest
from generated_diagnoses import diagnoses
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_diagnoses import ALL, ambiguous, five_fibres, measurement, nothing, one_fibre, unexplained

from xb_muscle_ros.diagnose.component import NAMED, SURE, Kind
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.report.prose import MOST, headline, summary
from xb_muscle_ros.diagnose.result import Diagnosis, Verdict

LACKS = "part of what the base model lacks"
SURE_WORDS = {"almost certainly": (0.99, 1.0), "very likely": (0.9, 0.99), "probably": (0.66, 0.9),
              "more likely than not": (0.5, 0.66)}  # fmt: skip


def said(d: Diagnosis) -> str:
    return " ".join(summary(d))


@pytest.mark.slow
@settings(max_examples=150)
@given(diagnoses())
def test_nothing_said_is_other_than_the_numbers(d: Diagnosis) -> None:
    check_form(d)
    check_causes(d)
    check_falls_and_rises(d)
    check_headline(d)


def check_form(d: Diagnosis) -> None:
    """At most six sentences, without gaps."""
    told = summary(d)
    assert 1 <= len(told) <= MOST
    assert all(sentence.endswith(".") and sentence[0].isupper() for sentence in told)
    for text in (*told, headline(d)):
        assert not re.search(r"\bnan\b|\binf\b|\bNone (?!reach)", text.replace("None:", "")), text
    assert "\n" not in headline(d)


def check_causes(d: Diagnosis) -> None:
    """Causes are those with evidence, in words of their probability."""
    told = [s for s in summary(d) if LACKS in s]
    named = say.mechanisms(d.named)
    assert bool(told) == (bool(named) and d.described)
    if not told:
        return
    lower = told[0].lower()
    for c in say.mechanisms(d.components):
        if len(c.members) > 3:
            continue
        title = say.title(c).lower()
        if c.inclusion_probability < NAMED:
            assert title not in lower
        elif c in named[:4]:
            word = say.sureness(c.inclusion_probability)
            low, high = SURE_WORDS[word]
            assert low <= c.inclusion_probability <= high
            after = lower.split(title, 1)[1]
            assert word in after
            assert say.probability(c.inclusion_probability) in after.split(word, 1)[1].split(")")[0]
            tell_apart = "cannot tell apart" in after.split(word, 1)[0]
            assert tell_apart == (len(c.members) > 1)


def check_falls_and_rises(d: Diagnosis) -> None:
    """Words of direction agree with the numbers beside them."""
    text = said(d)
    found = re.search(r"(lower|raise)s? the held-out RMSD from ([\d.]+) to ([\d.]+) % F0", text)
    before, after = d.before.heldout_rmsd_f0, d.after.heldout_rmsd_f0
    if found:
        assert before is not None
        assert after is not None
        assert (found[1] == "lower") == (after < before) == (float(found[3]) < float(found[2]))
    elif d.named and d.described:
        assert "untested on held-out conditions" in text or "the held-out RMSD at" in text
    else:
        assert "held-out RMSD" not in text
    if "the model's" in text:
        mean = d.mismatch[0].mean_f0
        assert not ("is higher than" in text and not mean > 0.0)
        assert not ("is lower than" in text and not mean < 0.0)


def check_headline(d: Diagnosis) -> None:
    """It follows verdict and numbers."""
    text = headline(d)
    if not d.described:
        assert text.startswith("Not judged")
        assert LACKS not in said(d)
        assert "Nothing is named" in said(d)
        return
    assert text.startswith(d.verdict.value.capitalize())
    quiet = re.search(r"no candidate|none of the \d+ candidates|do not call for|are enough", text)
    if " explain" in text and not quiet:
        assert d.verdict is Verdict.PHYSICS
        assert say.mechanisms(d.named)
    if quiet:
        assert not d.named


@given(st.floats(0.0, 1.0))
def test_a_probability_is_never_shown_larger_than_it_is(value: float) -> None:
    shown = say.probability(value)
    number = float(shown.lstrip("<> "))
    if shown.startswith("<"):
        assert value < number
    else:
        assert value >= number or math.isclose(value, number)
        assert (number >= NAMED) == (value >= NAMED) or math.isclose(value, NAMED)
        assert (number >= SURE) == (value >= SURE) or math.isclose(value, SURE)


def test_a_p_value_at_the_floor_of_the_bootstrap_is_a_bound() -> None:
    floor = 2.0 / 201.0
    assert say.p_value(floor, floor) == "≤ 0.010"
    assert say.p_value(0.5 * floor, floor) == "≤ 0.0050"
    assert say.p_value(1.5 * floor, floor) == "0.015"
    assert say.p_value(0.0004) == "< 0.001"
    assert say.p_value(math.nan, floor) == say.NOTHING


@given(st.floats(-2.0, 2.0))
def test_a_share_is_between_nothing_and_all(value: float) -> None:
    number = int(say.share(value).strip("<> %"))
    assert 0 <= number <= 100
    assert (number == 100 and say.share(value) == "100 %") <= (value > 0.99)
    assert (say.share(value) == "0 %") <= (value <= 0.0)


def test_physics_that_explains_a_part_says_what_remains_and_where() -> None:
    d = replace(one_fibre().diagnosis, explained_fraction=0.4)
    d = replace(d, residual=replace(d.residual, rmsd_f0=0.016))
    assert headline(d) == (
        "Physics: forcible detachment, viscous drag and force drift explain 40 % of the mismatch; 1.6 % F0 remain"
    )
    told = summary(d)
    assert len(told) == 6
    assert told[2] == (
        "Forcible detachment is almost certainly part of what the base model lacks (probability > 0.99); viscous drag "
        "very likely (0.93)."
    )
    assert told[3] == "Force drift is probably a measurement artefact beyond the ordinary (probability 0.87)."
    assert "40 % of the mismatch" in told[4]
    assert "; they leave 1.6 % F0, most in the test stretch" in told[4]
    assert told[5].startswith("Next: record a stretch")


def test_several_fibres_say_how_many_agree_and_families_that_they_are_one() -> None:
    d = five_fibres().diagnosis
    text = said(d)
    assert "the recordings of 5 fibres" in text
    assert "viscous drag very likely (0.93; replicated in 5 of 5 fibres)" in text
    assert (
        "active titin or static calcium-dependent stiffness, which these recordings cannot tell apart, probably "
        "(0.71; replicated in 3 of 5 fibres)"
    ) in text


def test_large_families_go_by_their_name() -> None:
    d = one_fibre().diagnosis
    c = replace(d.components[0], members=("a", "b", "c", "d"), family="rates")
    assert say.title(c) == "one of 4 mechanisms of temperature and chemistry"


def test_one_cause_alone_is_singular() -> None:
    d = one_fibre().diagnosis
    alone = replace(d, components=d.components[:1], answer=d.answer[:1])
    assert "It explains" in said(alone)
    assert re.search("and lowers the held-out RMSD", said(alone))
    assert headline(alone).startswith("Physics: forcible detachment explains")


@pytest.mark.parametrize(
    ("gain", "told"),
    [(None, "no held-out condition tested it"), ("worse", "no held-out gain exceeds its standard error")],
)
def test_ambiguous_says_why(gain: str | None, told: str) -> None:
    d = ambiguous().diagnosis
    assert headline(d).endswith("; none reaches 0.9")
    assert "more likely than not" in said(d)
    first = d.components[0]
    old = first.heldout_gain
    assert old is not None
    changed = None if gain is None else replace(old, mean=0.01, se=0.02)
    one = replace(d, components=(replace(first, inclusion_probability=0.95, heldout_gain=changed),))
    assert headline(one) == f"Ambiguous: evidence for viscous drag (0.95); {told}"
    short = replace(d, components=(first,))
    assert headline(short).endswith("viscous drag (0.63); that does not reach 0.9")


def test_nothing_named() -> None:
    d = nothing().diagnosis
    assert headline(d) == "None: these recordings do not call for another model"
    assert "Noise alone leaves as much in about 4 of 10 repeats." in summary(d)
    assert summary(d)[-1] == "No experiment is called for."
    other = replace(d, verdict=Verdict.PARAMETERS)
    assert headline(other).startswith("Parameters:")
    assert "most changed k21 from 19.0 to 22.4 1/s, f from 95.0 to 103 1/s." in said(other)
    assert "kse" not in said(other)


def test_unexplained_tells_the_nearest_and_the_law() -> None:
    d = unexplained().diagnosis
    text = said(d)
    assert "No mechanism reaches a probability of 0.5; the most probable is weakly bound heads (0.34)." in text
    assert "time constant of 11.8 ms and scales with the activation of the thin filament" in text
    differs = "Unexplained: the base model differs by 1.1 % F0; none of the 7 candidates"
    first = d.components[0]
    named = f"{differs} is probable enough to be named, first of them weakly bound heads (0.34)"
    assert headline(replace(d, components=(replace(first, not_separable_from=()), *d.components[1:]))) == named
    rival = replace(first, not_separable_from=("lattice_spacing",))
    assert headline(replace(d, components=(rival, *d.components[1:]))) == f"{named}, not separable from lattice spacing"
    none = tuple(replace(c, inclusion_probability=0.05) for c in d.components)
    assert headline(replace(d, components=none)) == f"{differs} explains it"
    assert "decays after a stretch" not in said(replace(d, base_law=None, residual=replace(d.residual, law=None)))


def test_measurement_alone_asks_to_check_the_recordings() -> None:
    d = replace(measurement().diagnosis, next_experiment=None)
    assert headline(d) == "Measurement: force drift beyond what is ordinary"
    assert "Force drift is very likely a measurement artefact beyond the ordinary (probability 0.97)." in summary(d)
    assert summary(d)[-1] == "Next: check the recordings for force drift."


def test_what_is_not_described_names_nothing() -> None:
    d = replace(one_fibre().diagnosis, described=False)
    assert headline(d).startswith("Not judged: the model does not describe")
    assert "A firmer answer needs: a second speed of stretch, to part drag from weakly bound heads." in summary(d)


def test_without_a_held_out_condition_that_is_said() -> None:
    d = one_fibre().diagnosis
    bare = replace(d, before=replace(d.before, heldout_rmsd_f0=None), after=replace(d.after, heldout_rmsd_f0=None))
    assert "of the mismatch, untested on held-out conditions" in said(bare)
    same = replace(d, after=replace(d.after, heldout_rmsd_f0=d.before.heldout_rmsd_f0))
    assert "leave the held-out RMSD at" in said(same)
    worse = replace(d, after=replace(d.after, heldout_rmsd_f0=0.5))
    assert "raise the held-out RMSD from 1.3 to 50 % F0" in said(worse)


@pytest.mark.parametrize("name", ALL)
def test_samples_name_what_their_records_name(name: str) -> None:
    d = ALL[name]().diagnosis
    for c in d.named:
        assert say.title(c).lower() in said(d).lower()
    assert {c.name for c in d.named if c.kind is Kind.MECHANISM} == set(d.answer)
