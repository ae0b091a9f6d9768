"""What holds for every protocol: bags, tables, figures, and that a recording of a model is read like the model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols import report
from xb_muscle_ros.protocols.base import settings_of
from xb_muscle_ros.protocols.registry import PROTOCOLS, protocol_of

FIBRE = "18Dec2017a"


def few(name: str) -> dict[str, list[float]]:
    """The protocol's defaults, two of each at most."""
    return {option.name.replace("-", "_"): list(option.default[:2]) for option in PROTOCOLS[name].options}


@pytest.fixture(scope="module", params=list(PROTOCOLS))
def made(request: pytest.FixtureRequest) -> xb.ProtocolResult:
    name = str(request.param)
    return xb.run_protocol(name, FIBRE, as_measured=True, tell=lambda line: None, **few(name))


def test_names_and_columns(made: xb.ProtocolResult) -> None:
    protocol = protocol_of(made.protocol)
    (found,) = made.results
    assert found.of == "3state_coop"
    assert found.rows
    for row in found.rows:
        assert set(row) <= set(protocol.columns)
    assert set(found.numbers) <= set(protocol.numbers)
    names = [trial.facts.trial for trial in made.trials]
    assert len(set(names)) == len(names)
    for trial in made.trials:
        assert trial.facts.protocol == protocol.name
        assert trial.facts.settings
        assert trial.facts.phases
        assert trial.force_is_measured


def test_files_tell_the_same(made: xb.ProtocolResult, tmp_path: Path) -> None:
    protocol = protocol_of(made.protocol)
    written = made.save(tmp_path)
    stem = report.stem(protocol)
    tree = json.loads((tmp_path / f"{stem}.json").read_text(encoding="utf-8"))
    assert tree["protocol"] == protocol.name
    (found,) = made.results
    assert [set(row) for row in tree["found"][0]["rows"]] == [set(protocol.columns)] * len(found.rows)
    assert (tmp_path / f"{stem}.csv").read_text(encoding="utf-8").count("\n") == 1 + len(found.rows)
    assert f"# Protocol {protocol.name}" in (tmp_path / f"{stem}.md").read_text(encoding="utf-8")
    assert (tmp_path / f"{stem}.png").stat().st_size > 1000
    assert all(path.exists() for path in written)
    with pytest.raises(UserError, match="--overwrite"):
        made.save(tmp_path)


def test_a_bag_is_read_like_the_trial_in_memory(made: xb.ProtocolResult, tmp_path: Path) -> None:
    made.save(tmp_path)
    again = xb.analyse_protocol(made.protocol, tmp_path, tell=lambda line: None)
    (found,), (read,) = made.results, again.results
    assert read.of == "measured"
    keyed = {row["trial"]: row for row in read.rows if "trial" in row}
    for row in found.rows:
        other = keyed[row["trial"]]
        for key, cell in row.items():
            value, beside = (getattr(each, "value", each) for each in (cell, other.get(key)))
            if isinstance(value, float) and beside is not None:
                # A bag holds times to the nanosecond, and its clock need not begin at zero.
                assert beside == pytest.approx(value, rel=1e-3, abs=1e-6), (row["trial"], key)


def test_the_model_that_made_a_recording_repeats_it(made: xb.ProtocolResult) -> None:
    again = xb.analyse_protocol(made.protocol, made.trials, model="3state_coop", tell=lambda line: None)
    measured, model = again.results
    assert model.of == "3state_coop"
    for one, other in zip(measured.runs, model.runs, strict=True):
        # The recording's model went by variable steps, or found its length: 0.1 % F0 at the samples of most trials.
        apart = np.abs(np.interp(one.time_s, other.time_s, other.force_f0) - one.force_f0)
        assert np.median(apart) < 1e-3, one.trial.facts.trial


@pytest.mark.parametrize("name", list(PROTOCOLS))
def test_recordings_of_something_else_are_notes_and_a_figure(name: str, tmp_path: Path) -> None:
    """Two trials that are another protocol's, or none's, with nothing to read off for most."""
    made = xb.simulate(FIBRE, recovery=0.1, pca=[4.5, 9.0], as_measured=True)
    t = np.arange(0.0, 0.3, 1e-3)
    still = xb.simulate(FIBRE, time=t, length=0.0 * t, calcium=0.0, name="still", as_measured=True)
    found = xb.analyse_protocol(name, [*made.trials, *still.trials], tell=lambda line: None)
    assert found.results[0].notes or found.results[0].rows
    for path in found.save(tmp_path):
        assert path.exists()


@pytest.mark.parametrize(
    ("protocol", "options", "said"),
    [
        ("force-pka", {}, "protocol 'force-pka' is not known; did you mean 'force-pca'"),
        ("force-pca", {"pka": 6.0}, "protocol force-pca has no option 'pka'; did you mean 'pca'"),
        ("force-pca", {"pca": 2.0}, "--pca is 2; allowed is 3 to 12"),
        ("force-pca", {"rate": [100.0, 200.0]}, "--rate has 2 numbers; protocol force-pca takes one"),
        ("ramp-hold", {"amplitude": 0.0}, "--amplitude is 0 L0; a ramp needs a change of length"),
        ("force-velocity", {"velocity": 0.0}, "--velocity is 0 L0/s; a ramp needs a velocity"),
        ("step", {"size": 0.0}, "--size is 0 L0; a step needs a change of length"),
        ("force-pca", {"duration": 3000.0, "rate": 1e5}, "take a lower rate"),
    ],
)
def test_what_cannot_be_is_said(protocol: str, options: dict[str, float], said: str) -> None:
    with pytest.raises(UserError) as error:
        xb.run_protocol(protocol, FIBRE, **options)
    assert said in str(error.value)


def test_a_recording_without_force_is_named() -> None:
    trials = [xb.StretchShortenStretch(0.0, 0.1).trial(FIBRE, 4.5)]
    with pytest.raises(UserError, match="no trial of fibre 18Dec2017a has a measured force"):
        xb.analyse_protocol("force-pca", trials, tell=lambda line: None)


def test_settings_have_defaults() -> None:
    protocol = PROTOCOLS["force-pca"]
    assert settings_of(protocol, {"pca": None})["pca"] == protocol.options[0].default
    assert settings_of(protocol, {"duration": 2})["duration"] == (2.0,)
