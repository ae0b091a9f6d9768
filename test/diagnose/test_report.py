"""The page of a diagnosis: for every verdict, with gaps, with names that try to break it, for one trial and many."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.names import FAMILY, Name, Verdict
from xb_muscle_ros.diagnose.report import write_report
from xb_muscle_ros.diagnose.summary import summary_text
from xb_muscle_ros.diagnose.words import is_fault
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.replay.made import NOISE_SD_F0, coloured_noise
from xb_muscle_ros.replay.offline import simulate_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

Array = Any
Signals = dict[str, list[Array]]

PCAS = (9.0, 6.6, 6.4, 6.2, 6.1, 6.0, 4.5)
TAUS_S = tuple(float(t) for t in np.geomspace(0.002, 2.0, 10))
EFFECTS = {"physics": "drag", "ambiguous": "drag", "measurement": "gain", "unexplained": "other"}
ANSWERS: dict[str, tuple[str, ...]] = {
    "physics": ("viscous_drag",),
    "ambiguous": ("viscous_drag", "passive_viscoelasticity"),
    "measurement": ("length_gain",),
}
# Fewer independent observations than samples: noise remembers about 20 samples.
MEMORY = 20.0


class Study:
    """A study made by the model: what was measured, what the base model says, and signals that may explain the rest."""

    def __init__(self, pcas: tuple[float, ...], effect: str, seed: int = 0) -> None:
        """Simulate; an effect is drag, gain, other (unknown to the candidates) or nothing."""
        random = np.random.default_rng(seed)
        fibre = changed(load_fibre("18Dec2017a"), {"smoothing": 0.0}, "test")
        muscle, other = Muscle(fibre), Muscle(changed(fibre, {"f": 95.0, "k21": 19.0}, "test"))
        protocols = [StretchShortenStretch(0.0383, 0.3, lead_s=0.15, hold_s=0.25), StretchShortenStretch(0.0, 0.3)]
        cases = [protocols[1] if i == len(pcas) - 2 and len(pcas) > 4 else protocols[0] for i in range(len(pcas))]
        self.trials = [case.trial("18Dec2017a", pca) for case, pca in zip(cases, pcas, strict=True)]
        memo: dict[tuple[str, int], Array] = {}

        def force(of: Muscle, trial: Trial, gain: float = 0.0) -> Array:
            key = (f"{trial.facts.trial} {gain}", id(of))
            if key not in memo:
                given = trial.__class__(**{**vars(trial), "length_m": 1.0 + (1.0 + gain) * trial.length_change_l0})
                memo[key] = simulate_trial(of, given).force_n / trial.facts.f0_n
            return memo[key]

        self.before = [force(muscle, trial) for trial in self.trials]
        self.start = [force(other, trial) for trial in self.trials]
        speed = [np.gradient(trial.length_change_l0, trial.time_s) for trial in self.trials]
        self.signals: Signals = {
            "viscous_drag": speed,
            "passive_viscoelasticity": [remembered(v, 0.008) for v in speed],
            "static_calcium_stiffness": [
                b[0] * t.length_change_l0 for b, t in zip(self.before, self.trials, strict=True)
            ],
            "length_gain": [(force(muscle, t, 0.01) - force(muscle, t)) / 0.01 for t in self.trials],
            "force_offset": [np.ones_like(v) for v in speed],
        }
        self.memories = [np.column_stack([remembered(v, tau) for tau in TAUS_S]) for v in speed]
        wave = [np.sin(2.0 * np.pi * 9.0 * t.time_s) * t.length_change_l0 for t in self.trials]
        added = {
            "drag": [0.012 * v for v in speed],
            "gain": [0.06 * s for s in self.signals["length_gain"]],
            "other": [0.6 * w for w in wave],
            "nothing": [0.0 * v for v in speed],
        }[effect]
        noise = [coloured_noise(random, v.size) for v in speed]
        self.measured = [b + a + n for b, a, n in zip(self.before, added, noise, strict=True)]
        self.left = [m - b for m, b in zip(self.measured, self.before, strict=True)]

    def explained(self, name: str) -> tuple[float, list[Array], list[Array]]:
        """Least squares of a signal: value, what it explains in each trial, and the same with that trial left out."""
        signal = self.signals[name]
        products = np.array([float(s @ r) for s, r in zip(signal, self.left, strict=True)])
        squares = np.array([float(s @ s) for s in signal])
        value = products.sum() / squares.sum()
        others = (products.sum() - products) / np.maximum(squares.sum() - squares, 1e-12)
        return value, [value * s for s in signal], [o * s for o, s in zip(others, signal, strict=True)]

    def flexible(self) -> float:
        """RMSD on trials left out of a ridge over many memories of the velocity."""
        errors = []
        for i in range(len(self.left)):
            rest = [j for j in range(len(self.left)) if j != i] or [i]
            a, y = np.vstack([self.memories[j] for j in rest]), np.concatenate([self.left[j] for j in rest])
            weights = np.linalg.solve(a.T @ a + 1e-3 * np.eye(a.shape[1]), a.T @ y)
            errors.append(rms(self.left[i] - self.memories[i] @ weights))
        return rms(np.array(errors))

    def kernel(self) -> dict[str, Any]:
        """Non-negative weights of memories of the velocity."""
        a, y = np.vstack(self.memories), np.concatenate(self.left)
        weights, rest = nnls(a, y)
        return {
            "time_constant_s": float(np.exp(np.average(np.log(TAUS_S), weights=weights + 1e-12))),
            "scales_with": "constant",
            "gain": float(weights.sum()),
            "explained": 1.0 - float(rest**2) / float(y @ y),
            "tau_s": list(TAUS_S),
            "weight_f0": weights.tolist(),
        }


def remembered(speed: Array, tau_s: float) -> Array:
    """Speed through an exponential memory, in L0."""
    decay = np.exp(-1e-3 / tau_s)
    return lfilter([1e-3], [1.0, -decay], speed)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def overall(parts: list[Array]) -> float:
    """RMS over all samples of all trials."""
    return rms(np.concatenate(parts))


def table_of(study: Study, left: list[Array]) -> dict[str, Any]:
    """Map of what is left over trials and phases; a cell counts where it is beyond three times its error."""
    names = list(dict.fromkeys(p.name for t in study.trials for p in t.facts.phases))
    cells: dict[str, list[list[float | None]]] = {"rms_f0": [], "mean_f0": [], "p_value": []}
    for trial, rest in zip(study.trials, left, strict=True):
        phases = trial.phases_by_name()
        for rows in cells.values():
            rows.append([None] * len(names))
        for j, name in enumerate(names):
            if name not in phases:
                continue
            part = rest[(trial.time_s >= phases[name].start_s) & (trial.time_s < phases[name].end_s)]
            cells["rms_f0"][-1][j], cells["mean_f0"][-1][j] = rms(part), float(part.mean())
            beyond = rms(part) ** 2 - NOISE_SD_F0**2 > 3.0 * NOISE_SD_F0**2 * np.sqrt(2.0 * MEMORY / part.size)
            cells["p_value"][-1][j] = 0.002 if beyond else 0.4
    return {"trials": [t.facts.trial for t in study.trials], "phases": names, **cells}


def candidate_rows(study: Study) -> list[dict[str, Any]]:
    """Every signal, best first, the base among them, and some that were screened."""
    scale = 2.0 * MEMORY * NOISE_SD_F0**2
    base = np.array([float(r @ r) for r in study.left])
    rows: list[dict[str, Any]] = [{
        "name": "base", "kind": "base", "family": None, "parameters": {}, "interval": {}, "delta_elpd": 0.0, "se": 0.0,
        "train_rmsd_f0": overall(study.left), "heldout_rmsd_f0": overall(study.left), "note": "",
    }]  # fmt: skip
    for name, signal in study.signals.items():
        value, inside, outside = study.explained(name)
        error = NOISE_SD_F0 * np.sqrt(MEMORY / sum(float(s @ s) for s in signal))
        gains = (base - [float(np.sum((r - o) ** 2)) for r, o in zip(study.left, outside, strict=True)]) / scale
        key = {"viscous_drag": "drag", "passive_viscoelasticity": "kpe", "static_calcium_stiffness": "kca"}.get(
            name, name
        )
        rows.append({
            "name": name, "kind": "measurement" if is_fault(name) else "mechanism", "family": FAMILY[Name(name)],
            "parameters": {key: value}, "interval": {key: [value - 1.96 * error, value + 1.96 * error]},
            "train_rmsd_f0": rms(np.concatenate([r - i for r, i in zip(study.left, inside, strict=True)])),
            "heldout_rmsd_f0": rms(np.concatenate([r - o for r, o in zip(study.left, outside, strict=True)])),
            "delta_elpd": float(gains.sum()), "se": float(np.sqrt(gains.size) * gains.std()), "note": "",
        })  # fmt: skip
    rows.sort(key=lambda row: -row["delta_elpd"])
    for name in ("phosphate", "temperature", "half_sarcomere_spread", "series_compliance", "lattice_spacing"):
        rows.append({
            "name": name, "kind": "mechanism", "family": FAMILY[Name(name)], "parameters": {}, "interval": {},
            "train_rmsd_f0": None, "heldout_rmsd_f0": None, "delta_elpd": None, "se": None,
            "note": "screened: explains 3 % of what is left",
        })  # fmt: skip
    return rows


def mismatches(study: Study, shown: dict[str, Any]) -> list[dict[str, Any]]:
    """Cells of a map that count, largest first."""
    found = []
    for i, trial in enumerate(study.trials):
        for phase in trial.facts.phases:
            j = shown["phases"].index(phase.name)
            mean = shown["mean_f0"][i][j]
            if shown["p_value"][i][j] < 0.05:
                found.append({
                    "trial": trial.facts.trial, "phase": phase.name, "start_s": phase.start_s, "end_s": phase.end_s,
                    "size_f0": shown["rms_f0"][i][j], "mean_f0": mean, "sign": 1 if mean > 0 else -1, "p_value": 0.002,
                })  # fmt: skip
    return sorted(found, key=lambda row: -row["size_f0"])


def profile_of(row: dict[str, Any]) -> dict[str, Any]:
    """Of a candidate's only parameter: straight sides, as it enters the force in proportion."""
    ((key, value),) = row["parameters"].items()
    low, high = row["interval"][key]
    sd = (high - low) / 3.92
    points = [[value + k * sd, abs(k)] for k in np.linspace(-3, 3, 13).tolist()]
    return {"parameter": key, "unit": "s" if key == "drag" else "1", "points": points, "interval": [low, high]}


def words_of(verdict: str, quiet: bool, answered: bool) -> dict[str, Any]:
    """What a diagnosis says beside its numbers."""
    sure, physics = "0.41" if quiet else "0.003", verdict == "physics"
    return {
        "checks": [
            {"name": "what is left is beyond chance: p < 0.01", "passed": not quiet, "value": sure},
            {"name": "faults of the measurement do worse by 2 s.e. and more", "passed": physics, "value": "3.1"},
            {"name": "the interval of the parameter leaves out zero", "passed": answered, "value": ""},
            {"name": "places located are clean afterwards", "passed": physics, "value": "0 of 9"},
            {"name": "gains half of what a flexible curve does", "passed": None if quiet else answered, "value": None},
        ],
        "next_experiment": None if quiet else {
            "bag": "next_experiment",
            "protocol": "Stretch by 4 % L0 at 0.05, 0.2, 1 and 2 L0/s at pCa 9 and 4.5, with a hold of 1 s.",
            "separates": list(ANSWERS["ambiguous"]), "expected_difference_f0": 0.012,
        },
        "augmented_fiber": "augmented.yaml" if answered else None,
        "missing": ["a trial without any stretch, to tell drift from slow elasticity", "a second speed of stretch"],
        "warnings": [] if quiet else ["parameter k12 ended at its upper bound"],
        "how": {
            "rmsd": "Root of the mean square of measured minus modelled force at 1 kHz, trials weighted alike.",
            "p_value": "Share of 199 simulated repeats, each fitted anew, that leave at least as much.",
            "something_else": "An entry that no number on the page links to.",
        },
    }  # fmt: skip


def diagnosis_of(study: Study, verdict: str) -> dict[str, Any]:
    """What the tool would write: errors, map, memory and candidates come from the traces, the rest is made up."""
    answer = ANSWERS.get(verdict, ())
    rows = candidate_rows(study)
    nothing = [np.zeros_like(r) for r in study.left]
    _, inside, outside = study.explained(answer[0]) if answer else (0.0, nothing, nothing)
    after = [r - i for r, i in zip(study.left, inside, strict=True)]
    heldout = [r - o for r, o in zip(study.left, outside, strict=True)]
    start = [m - s for m, s in zip(study.measured, study.start, strict=True)]
    shown = table_of(study, study.left)
    best = next((row for row in rows if answer and row["name"] == answer[0]), None)
    quiet = verdict in ("none", "parameters")
    facts: dict[str, Any] = {
        "version": 1, "fibre": "18Dec2017a", "model": "3state_coop", "method": "gaussian", "quick": False, "seed": 1,
        "seconds": 81.2, "verdict": verdict, "answer": list(answer),
        "family": best["family"] if best else None, "p_value": 0.41 if quiet else 0.003,
        "confidence": {"ambiguous": 0.55, "unexplained": 0.2, "none": 0.9}.get(verdict, 0.94),
        "trials": [
            {
                "trial": trial.facts.trial, "pca": trial.facts.pca, "noise_sd_f0": NOISE_SD_F0, "noise_from": "curve",
                "phases": [{"name": p.name, "start_s": p.start_s, "end_s": p.end_s} for p in trial.facts.phases],
                "before_rmsd_f0": rms(study.left[i]), "after_rmsd_f0": rms(after[i]),
                "heldout_before_f0": rms(study.left[i]), "heldout_after_f0": rms(heldout[i]),
            }
            for i, trial in enumerate(study.trials)
        ],
        "conflicts": [
            {"between": "solutions", "parts": 2, "gone": 0.97, "furthest": 1.2},
            {"between": "trials", "parts": len(study.trials), "gone": 0.98, "furthest": 1.1},
        ],
        "mismatch": mismatches(study, shown), "map": shown, "map_after": table_of(study, after),
        "kernel": None if quiet else study.kernel(),
        "nuisances": [
            {"name": "pca_shift", "group": f"pCa {pca:g}", "value": 0.01, "sd": 0.008, "prior_sd": 0.05, "unit": "1"}
            for pca in sorted({t.facts.pca for t in study.trials})
        ],
        "base_parameters": [
            {"name": "f", "start": 95.0, "fitted": 80.2, "unit": "1/s"},
            {"name": "k21", "start": 19.0, "fitted": 22.4, "unit": "1/s"},
            {"name": "kse", "start": 0.33, "fitted": 0.331, "unit": "F0/L0"},
        ],
        "candidates": rows, "profile": profile_of(best) if best else None,
        "before": {"train_rmsd_f0": overall(study.left), "heldout_rmsd_f0": overall(study.left)},
        "after": {"train_rmsd_f0": overall(after), "heldout_rmsd_f0": overall(heldout)},
        "start": {"train_rmsd_f0": overall(start)},
        "flexible_bound_rmsd_f0": study.flexible(),
        **words_of(verdict, quiet, bool(answer)),
    }  # fmt: skip
    facts["summary"] = summary_text(facts)
    return facts


def save(folder: Path, study: Study, facts: dict[str, Any]) -> Path:
    """Both files as the tool writes them."""
    folder.mkdir(parents=True, exist_ok=True)
    answer = facts["answer"]
    inside = study.explained(answer[0])[1] if answer and answer[0] in study.signals else [0.0] * len(study.left)
    arrays = {}
    for i, trial in enumerate(study.trials):
        arrays |= {
            f"t{i}_time_s": trial.time_s,
            f"t{i}_length_l0": trial.length_change_l0,
            f"t{i}_measured_f0": study.measured[i],
            f"t{i}_start_f0": study.start[i],
            f"t{i}_before_f0": study.before[i],
            f"t{i}_after_f0": study.before[i] + inside[i],
        }
    np.savez(folder / "traces.npz", **arrays)
    (folder / "diagnosis.json").write_text(json.dumps(facts), encoding="utf-8")
    return folder


@cache
def study_of(verdict: str, pcas: tuple[float, ...] = (6.4, 4.5)) -> Study:
    return Study(pcas, EFFECTS.get(verdict, "nothing"))


class Walker(HTMLParser):
    """Checks on the way that tags balance; collects ids, links, other attributes, and text in and outside links."""

    VOID = ("meta", "img", "br")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.outside = ""
        self.linked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.tags.add(tag)
        self.attributes |= set(found)
        self.ids += [str(found["id"])] if "id" in found else []
        self.links += [str(found["href"])] if "href" in found else []
        self.sources += [str(found["src"])] if "src" in found else []
        if tag == "a" and found.get("class") == "n":
            self.linked.append("")
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "a" in self.open and self.linked:
            self.linked[-1] += data
        elif "style" not in self.open:
            self.outside += data


def walked(path: Path) -> Walker:
    """A page that holds together: tags balance, links resolve, ids are unique, nothing is loaded."""
    text = path.read_text(encoding="utf-8")
    walker = Walker()
    walker.feed(text)
    walker.close()
    assert walker.open == []
    assert len(walker.ids) == len(set(walker.ids))
    assert all(link.startswith("#") and link[1:] in walker.ids for link in walker.links)
    assert walker.tags.isdisjoint({"script", "link", "iframe", "object", "base", "form"})
    assert not any(name.startswith("on") for name in walker.attributes)
    assert not re.search(r"(https?:)?//\w", re.sub(r"data:image/svg\+xml;base64,[\w+/=]+", "", text))
    for figure in figures(walker):
        assert not re.search(r"(href|src)=\"(?!#|data:image/png)|url\((?!#)|@import", figure)
    return walker


def figures(walker: Walker) -> list[str]:
    """SVG of all figures, each well formed."""
    found = []
    for source in walker.sources:
        head, _, data = source.partition(",")
        assert head == "data:image/svg+xml;base64"
        found.append(base64.b64decode(data).decode("utf-8"))
        ElementTree.fromstring(found[-1])
    return found


@pytest.mark.parametrize("verdict", [v.value for v in Verdict])
def test_every_verdict_makes_a_page_with_its_summary_and_figures(tmp_path: Path, verdict: str) -> None:
    study = study_of(verdict)
    facts = diagnosis_of(study, verdict)
    page = walked(write_report(save(tmp_path, study, facts)))
    text = page.outside + " ".join(page.linked)
    for row in facts["checks"]:
        assert row["name"] in text
    # Map, trials, ranking, before and after always; memory where it describes something, profile where there is one.
    memory = facts["kernel"] is not None and facts["kernel"]["explained"] >= 0.2
    assert len(page.sources) == 4 + memory + (facts["profile"] is not None)
    assert ("Physics that was left out" in text) == (verdict == "physics")
    assert ("augmented.yaml" in text) == bool(facts["answer"])


def test_numbers_of_the_diagnosis_stand_in_links_only(tmp_path: Path) -> None:
    study = study_of("physics")
    facts = diagnosis_of(study, "physics")
    facts["before"] = {"train_rmsd_f0": 0.0831, "heldout_rmsd_f0": 0.0862}
    facts["after"] = {"train_rmsd_f0": 0.0773, "heldout_rmsd_f0": 0.0794}
    facts |= {
        "flexible_bound_rmsd_f0": 0.0782,
        "p_value": 0.00737,
        "confidence": 0.731,
        "start": {"train_rmsd_f0": 0.0911},
    }
    facts["summary"] = summary_text(facts)
    page = walked(write_report(save(tmp_path, study, facts)))
    for shown in ("8.3", "8.6", "7.7", "7.9", "7.8", "0.00737", "73 %", "9.1"):
        assert any(shown in link for link in page.linked), shown
        assert not re.search(rf"(?<![\d.]){re.escape(shown)}(?!\d)", page.outside), shown
    # What the tool tells of its computing stands in place of the definition, and what nothing links to stands as well.
    assert all(text in page.outside for text in facts["how"].values())
    assert "how-something_else" in page.ids


def test_conflicts_and_the_source_of_noise_are_told(tmp_path: Path) -> None:
    study = study_of("physics")
    text = write_report(save(tmp_path, study, diagnosis_of(study, "physics"))).read_text(encoding="utf-8")
    assert "The solutions contradict each other" in text
    assert re.search(r'solution \(pCa\)</td><td class="r">2</td><td class="r"><a [^>]*>97 %</a>', text)
    assert re.search(r">0\.10</a>\*</td>", text)
    assert "* Noise: what smooth curves leave of force" in text


def test_a_summary_of_the_users_own_stays_as_it_is(tmp_path: Path) -> None:
    study = study_of("none")
    facts = diagnosis_of(study, "none") | {"summary": "My words & my F0 <b>only</b>."}
    text = write_report(save(tmp_path, study, facts)).read_text(encoding="utf-8")
    assert '<p class="lead">My words &amp; my F<sub>0</sub> &lt;b&gt;only&lt;/b&gt;.</p>' in text


HOSTILE = (
    "<script>alert(1)</script>", '"><img src=x onerror=alert(1)>', "$\\frac{1}{$ & _^%#",
    "nul \x00 bell \x07 line\nfeed", "half \ud800 pair, 力 и ünïcödé 🦵",
    "]]> --> &amp; https" + "://example.org/x", "x" * 400,
)  # fmt: skip


@pytest.mark.parametrize("turn", range(3))
def test_names_may_hold_anything(tmp_path: Path, turn: int) -> None:
    study = study_of("physics")
    facts = diagnosis_of(study, "physics")
    names = [HOSTILE[(3 * turn + k) % len(HOSTILE)] for k in range(3)]
    text = json.dumps(facts)
    for row, name in zip(facts["trials"], names, strict=False):
        text = text.replace(json.dumps(row["trial"]), json.dumps(name))
    text = text.replace('"18Dec2017a"', json.dumps(names[0])).replace('"drag"', json.dumps(names[1]))
    text = text.replace('"static_calcium_stiffness"', json.dumps(names[2])).replace(
        '"something_else"', json.dumps(names[1])
    )
    text = text.replace('"recovery"', json.dumps(names[2])).replace('"s"', json.dumps(names[0]))
    changed_facts = json.loads(text)
    changed_facts["warnings"] = changed_facts["missing"] = names
    changed_facts["summary"] = summary_text(changed_facts)
    save(tmp_path, study, facts)
    (tmp_path / "diagnosis.json").write_text(json.dumps(changed_facts), encoding="utf-8")
    path = tmp_path / "report.html"
    page = Walker()
    page.feed(write_report(tmp_path).read_text(encoding="utf-8"))
    assert page.open == []
    assert page.tags.isdisjoint({"script", "iframe"})
    assert "onerror" not in page.attributes
    assert all(link[1:] in page.ids for link in page.links)
    assert len(figures(page)) == 6
    shown = page.outside + "".join(page.linked)
    for name in names:
        assert "".join(c if c >= " " or c == "\n" else "\ufffd" for c in name).replace("\ud800", "?") in shown
    assert path.is_file()


def leaves(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all that may be null."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in items:
        if isinstance(value, (dict, list)) and value:
            yield from leaves(value, (*path, key))
        elif key not in ("trial", "name", "verdict", "trials", "start_s", "end_s") and path[-1:] != ("trials",):
            yield (*path, key)


def test_everything_unknown_still_makes_a_page(tmp_path: Path) -> None:
    study = study_of("physics")
    facts = diagnosis_of(study, "physics")
    for path in leaves(facts):
        inner = facts
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = None
    facts["answer"] = []
    walked(write_report(save(tmp_path, study, facts)))


@pytest.mark.parametrize("verdict", [v.value for v in Verdict])
def test_empty_lists_and_missing_keys_still_make_a_page(tmp_path: Path, verdict: str) -> None:
    (tmp_path / "diagnosis.json").write_text(json.dumps({"verdict": verdict, "trials": []}), encoding="utf-8")
    np.savez(tmp_path / "traces.npz")
    page = walked(write_report(tmp_path))
    assert page.sources == []
    assert "nan" not in page.outside.lower().split()
    assert "None" not in page.outside.replace("None of the", "")


@pytest.mark.parametrize(("count", "pages"), [(1, 1), (10, 2)])
def test_trials_are_split_over_figures(tmp_path: Path, count: int, pages: int) -> None:
    pcas = tuple(float(p) for p in np.linspace(6.6, 4.5, count).round(2))
    study = study_of("physics", pcas)
    facts = diagnosis_of(study, "physics")
    text = write_report(save(tmp_path, study, facts)).read_text(encoding="utf-8")
    assert len(re.findall('alt="Measured and modelled force of every trial', text)) == pages


def test_the_same_diagnosis_makes_the_same_page(tmp_path: Path) -> None:
    study = study_of("none", (4.5,))
    save(tmp_path, study, diagnosis_of(study, "none"))
    first = write_report(tmp_path).read_bytes()
    assert write_report(tmp_path).read_bytes() == first


@pytest.mark.parametrize(
    ("damage", "names"),
    [
        (lambda folder: (folder / "traces.npz").unlink(), "traces.npz"),
        (lambda folder: (folder / "traces.npz").write_bytes(b"PK no zip"), "traces.npz"),
        (lambda folder: (folder / "diagnosis.json").write_text("{"), "diagnosis.json"),
        (lambda folder: (folder / "diagnosis.json").write_text("[]"), "diagnosis.json"),
        (lambda folder: np.savez(folder / "traces.npz", t0_time_s=np.zeros(3)), "t1_time_s"),
        (lambda folder: np.savez(folder / "traces.npz", t0_time_s=[0.0, 1.0], t0_after_f0=[0.0]), "t0_after_f0"),
    ],
)  # fmt: skip
def test_damage_is_named_and_nothing_is_written(tmp_path: Path, damage: Any, names: str) -> None:
    study = study_of("none")
    save(tmp_path, study, diagnosis_of(study, "none"))
    damage(tmp_path)
    before = sorted(tmp_path.iterdir())
    with pytest.raises(UserError, match=names):
        write_report(tmp_path)
    assert sorted(tmp_path.iterdir()) == before


def test_the_page_appears_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = study_of("none")
    save(tmp_path, study, diagnosis_of(study, "none"))
    (tmp_path / "report.html").write_text("the old one", encoding="utf-8")
    before = sorted(tmp_path.iterdir())

    def full(self: Path, *args: Any, **kwargs: Any) -> int:
        with self.open("w", encoding="utf-8") as file:
            file.write("<!DOCTYPE")
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", full)
        with pytest.raises(OSError, match="No space"):
            write_report(tmp_path)
    assert sorted(tmp_path.iterdir()) == before
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == "the old one"
