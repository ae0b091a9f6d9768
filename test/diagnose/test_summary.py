"""The paragraph in words: says what, where, why, how sure and what next, for every verdict and whatever is unknown."""

from __future__ import annotations

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.claims import together
from xb_muscle_ros.diagnose.names import FAMILY, Name, Verdict
from xb_muscle_ros.diagnose.sentences import located
from xb_muscle_ros.diagnose.summary import summary_pieces, summary_text
from xb_muscle_ros.diagnose.words import chance, digits, family_words, human, likely, meaning, percent
from xb_muscle_ros.diagnose.written import filled

JARGON = re.compile(
    r"\b(elpd|RMSD|RMS|likelihood|bootstrap|posterior|prior|nuisance|residual|cross-validation|p ?[=<]|s\.e\.|nan)\b"
)
ANSWERS: dict[str, list[str]] = {
    "physics": ["viscous_drag"],
    "measurement": ["length_gain"],
    "ambiguous": ["viscous_drag", "passive_viscoelasticity"],
}


def mismatch(trial: str, phase: str, size: float, mean: float) -> dict[str, Any]:
    sign = 1 if mean > 0.0 else -1
    return {
        "trial": trial,
        "phase": phase,
        "start_s": 0.1,
        "end_s": 0.2,
        "size_f0": size,
        "mean_f0": mean,
        "sign": sign,
    }


def diagnosis(verdict: str, **changes: Any) -> dict[str, Any]:
    """A diagnosis of three trials."""
    levels = {"a": 6.4, "b": 6.0, "c": 4.5}
    return {
        "fibre": "18Dec2017a", "verdict": verdict, "answer": ANSWERS.get(verdict, []), "p_value": 0.003,
        "family": "parallel_viscoelasticity" if verdict in ("physics", "ambiguous") else None, "confidence": 0.94,
        "trials": [{"trial": name, "pca": pca, "noise_sd_f0": 0.001} for name, pca in levels.items()],
        "mismatch": [
            mismatch("b", "test_stretch", 0.042, 0.04), mismatch("c", "test_stretch", 0.03, 0.03),
            mismatch("c", "shortening", 0.02, -0.02),
        ],
        "kernel": {"time_constant_s": 0.03, "scales_with": "activation", "explained": 0.8},
        "base_parameters": [
            {"name": "f", "start": 80.0, "fitted": 95.0, "unit": "1/s"},
            {"name": "kse", "start": 0.33, "fitted": 0.331, "unit": "F0/L0"},
        ],
        "candidates": [
            {
                "name": "viscous_drag", "kind": "mechanism", "parameters": {"drag": 0.012},
                "interval": {"drag": [0.011, 0.013]}, "train_rmsd_f0": 0.0038,
            },
            {"name": "base", "kind": "base"},
        ],
        "profile": {"parameter": "drag", "unit": "s"},
        "before": {"train_rmsd_f0": 0.021, "heldout_rmsd_f0": 0.022},
        "after": {"train_rmsd_f0": 0.0038, "heldout_rmsd_f0": 0.004}, "start": {"train_rmsd_f0": 0.037},
        "flexible_bound_rmsd_f0": 0.0035,
        "linear_heldout": {"before_rmsd_f0": 0.022, "after_rmsd_f0": 0.004},
        "next_experiment": {
            "bag": "next_experiment", "protocol": "Stretch at 0.05 and 2 L0/s.",
            "separates": ["viscous_drag", "passive_viscoelasticity"], "expected_difference_f0": 0.012,
        },
        "missing": ["a trial at pCa 9"],
    } | changes  # fmt: skip


def test_physics_says_what_where_why_how_sure_and_what_next() -> None:
    assert summary_text(diagnosis("physics")) == (
        "Fitted as well as it can be, the model still differs from the recordings of fibre 18Dec2017a by 2.1 % F0. The "
        "noise of the recordings is 0.10 % F0. The difference is largest in the test stretch of 2 of 3 trials (pCa 6 "
        "to 4.5). There the fibre pulls harder than the model, by up to 4.2 % F0. Smaller differences lie in the "
        "shortening. "
        "The best explanation is viscous drag, a force proportional to the speed of stretch. Its parameter drag is "
        "0.0120 s, with 95 % certainty between 0.0110 and 0.0130 s. With it, the error on trials left out of the fit "
        "falls from 2.2 to 0.40 % F0. A flexible curve without any physics gets to 0.35 % F0. That this is the right "
        "explanation among those tried is very likely (94 %). A difference this large comes about by chance in about 3 "
        "of 1000 repeats. Next experiment: Stretch at 0.05 and 2 L0/s. There viscous drag and passive viscoelasticity "
        "should differ by 1.2 % F0."
    )


def test_noise_says_where_it_comes_from() -> None:
    trials = [{"trial": "a", "noise_sd_f0": 0.002, "noise_from": source} for source in ("window", "curve")]
    assert "The noise of the recordings is 0.20 % F0, by what smooth curves" in summary_text(
        diagnosis("none", trials=trials)
    )
    assert "curves" not in summary_text(diagnosis("none", trials=trials[:1]))


@pytest.mark.parametrize(
    ("verdict", "says"),
    [
        ("none", "call for no other physics"),
        ("none", "What would tell more: a trial at pCa 9."),
        (
            "parameters",
            "With the values of its file, the model of fibre 18Dec2017a differs from the recordings by 3.7 % F0",
        ),
        ("parameters", "f from 80.0 to 95.0 1/s."),
        ("measurement", "no physics but the measurement: length gain"),
        ("ambiguous", "One explanation does best, viscous drag, but passive viscoelasticity cannot be ruled out."),
        ("ambiguous", "one family, parallel viscoelasticity"),
        ("unexplained", "The only explanation fitted does not remove it."),
        ("unexplained", "time constant of 30.0 ms; it scales with the activation of the thin filament"),
        ("something new", "No explanation removes it."),
    ],
)
def test_each_verdict_says_its_own(verdict: str, says: str) -> None:
    changes = {"candidates": []} if verdict == "something new" else {}
    assert says in summary_text(diagnosis(verdict, **changes))


@pytest.mark.parametrize("verdict", [v.value for v in Verdict])
def test_sentences_are_plain(verdict: str) -> None:
    text = summary_text(diagnosis(verdict))
    assert not JARGON.search(text)
    assert text.endswith(".")
    assert ".." not in text
    assert "  " not in text
    for sentence in re.split(r"(?<=\.) (?=[A-Z])", text):
        assert len(sentence.split()) <= 30, sentence


@pytest.mark.parametrize("verdict", [v.value for v in Verdict])
def test_every_number_of_the_diagnosis_names_how_it_was_computed(verdict: str) -> None:
    for piece in summary_pieces(diagnosis(verdict)):
        if re.search(r"\d+ ?%|\d\.\d+ (s|ms)\b", piece.text) and not piece.text.startswith((", with 95", "Next ")):
            assert piece.how, piece.text


@given(st.sampled_from([v.value for v in Verdict]), st.data())
def test_whatever_is_unknown_the_rest_is_said(verdict: str, data: st.DataObject) -> None:
    known = diagnosis(verdict)
    gone = data.draw(st.sets(st.sampled_from(sorted(set(known) - {"verdict"}))))
    absent = data.draw(st.booleans())
    facts = {k: v for k, v in known.items() if k not in gone} | ({} if absent else dict.fromkeys(gone))
    text = summary_text(facts)
    assert text.endswith(".")
    assert "None" not in text.replace("None of the", "")


def test_a_difference_that_goes_both_ways_has_no_direction() -> None:
    rows = [mismatch("a", "hold", 0.016, 0.0004)]
    assert "now harder, now less than the model" in summary_text(diagnosis("unexplained", mismatch=rows))
    found = located(filled(diagnosis("unexplained", mismatch=rows)))
    assert found is not None
    assert found.sign == 0


def test_one_trial_is_named_by_its_solution_or_else_by_name() -> None:
    rows = [mismatch("a", "hold", 0.016, -0.016)]
    assert "in the hold at pCa 6.4. There the fibre pulls less than" in summary_text(
        diagnosis("physics", mismatch=rows)
    )
    trials = [{"trial": "a", "pca": None}, {"trial": "b", "pca": None}]
    assert "in the hold of trial a." in summary_text(diagnosis("physics", mismatch=rows, trials=trials))


def test_members_of_one_family_are_rivals_and_pairs_act_together() -> None:
    both = ["viscous_drag", "passive_viscoelasticity"]
    rivals = filled(diagnosis("physics", answer=both))
    assert not together(rivals)
    assert "one of the family parallel viscoelasticity: viscous drag or passive" in summary_text(rivals)
    pair = filled(diagnosis("physics", answer=both, candidates=[{"name": "+".join(both), "kind": "pair"}]))
    assert together(pair)
    assert "stretch together with passive viscoelasticity" in summary_text(pair)
    assert together(filled(diagnosis("physics", answer=["viscous_drag", "phosphate"], family=None)))


def test_every_name_and_family_has_words() -> None:
    for name in Name:
        assert meaning(name.value), name
        assert "_" not in human(name.value)
        # After a colon or a comma, in the middle of a sentence.
        assert not meaning(name.value).endswith(".")
    for family in FAMILY.values():
        assert family_words(family) != family or "_" not in family
    assert human("viscous_drag+phosphate") == "viscous drag with phosphate"
    assert human("later_idea") == "later idea"
    assert meaning("later_idea") == ""


@pytest.mark.parametrize(
    ("value", "significant", "text"),
    [
        (0.0, 2, "0"), (0.0999, 2, "0.10"), (0.996, 2, "1.0"), (12.34, 2, "12"), (1234.0, 2, "1234"),
        (-0.0123, 3, "-0.0123"), (284.7, 3, "285"), (2e-5, 2, "2e-05"),
    ],
)  # fmt: skip
def test_digits(value: float, significant: int, text: str) -> None:
    assert digits(value, significant) == text


def test_numbers_in_words() -> None:
    assert percent(0.0214) == "2.1"
    assert [likely(x) for x in (1.0, 0.94, 0.7, 0.5, 0.2, 0.0)] == [
        "virtually certain", "very likely", "likely", "about as likely as not", "unlikely", "very unlikely",
    ]  # fmt: skip
    assert chance(0.41) == "in about 4 of 10 repeats"
    assert chance(0.003) == "in about 3 of 1000 repeats"
    assert chance(0.0) == "in none of the simulated repeats"
    assert chance(1e-5) == "in fewer than 1 of 10000 repeats"
