"""Parameters that come from shared files, dumps and earlier fibre files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.node.configuration import configure, configure_many
from xb_muscle_ros.node.foreign_keys import foreign_keys, ignored

OWN = ("rate_hz", "fiber_file", "timeout_s", "mode", "model", "fibre")
F = "models.3state_coop.f"


def test_keys_of_other_nodes_are_told_from_slips() -> None:
    """Far from every name here: another node's."""
    names = ["rate_hz", F, "constants.f0_n", "use_gui", "controller_manager.update_rate", "robot_description", "rate"]
    assert foreign_keys(names, OWN) == names[3:]
    assert ignored(["a", "b"], "/muscle") == "parameters ignored, /muscle has none of these names: a, b"
    assert ignored([f"k{i}" for i in range(23)], "/m").endswith("k19 and 3 more")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("rate_hzz", "'rate_hzz' is not known; did you mean 'rate_hz'?"),
        ("Rate_Hz", "did you mean 'rate_hz'?"),
        ("timeout", "did you mean 'timeout_s'?"),
        ("constant.f0_n", "did you mean 'constants'?"),
        ("modells.3state_coop.f", "did you mean 'models'?"),
        ("left.models.3state_coop.f", "write 'models.3state_coop.f', or name many in 'fibers'"),
    ],
)
def test_slips_are_refused(name: str, words: str) -> None:
    """With the nearest name."""
    with pytest.raises(UserError, match="parameter") as caught:
        foreign_keys([name, "use_gui"], OWN)
    assert words in str(caught.value)


def test_a_node_of_many_tells_them_apart_by_its_fibres() -> None:
    """The names of fibres are known when it is configured."""
    heard: list[str] = []
    given = {"left.constants.f0_n": 2.0, "camera.frame_rate": 30, "camera.source": "file"}
    made = configure_many(["left", "right"], ["18Dec2017a"] * 2, given, heard.extend)
    assert made["left"].fibre.f0_n == 2.0
    assert heard == ["camera.frame_rate", "camera.source"]
    for name, words in (
        ("lefft.constant", "did you mean 'left'?"),
        ("lefft.constants.f0_n", "there is no fibre 'lefft'; did you mean 'left'?"),
        ("left.constant.f0_n", "is not known"),
    ):
        with pytest.raises(UserError) as caught:
            configure_many(["left", "right"], ["18Dec2017a"] * 2, {name: 1.0})
        assert words in str(caught.value)


def test_parameters_of_a_fibre_that_is_gone_are_named() -> None:
    """They were set while the node had it, and are no slip."""
    heard: list[str] = []
    given = {"left.constants.f0_n": 2.0}
    assert list(configure_many(["right"], ["18Dec2017a"], given, heard.extend, earlier=["left"])) == ["right"]
    assert heard == ["left.constants.f0_n"]
    with pytest.raises(UserError, match="there is no fibre 'left'"):
        configure_many(["right"], ["18Dec2017a"], given)


def test_no_fibre_names_the_node_and_the_wildcard() -> None:
    """A parameter file for another name gives nothing."""
    with pytest.raises(UserError, match=r"no fibre is given to /leg/muscle; .* the key '/leg/muscle' or '/\*\*'"):
        configure("", {}, "/leg/muscle")


def test_of_many_names_the_nearest_are_given() -> None:
    """150 names in one line help nobody."""
    known = [f"models.3state_coop.p{i}" for i in range(150)]
    text = suggest("zzz", known)
    assert text.startswith("; nearest of 150 known: models.3state_coop.p")
    assert text.count(",") == 3


@pytest.fixture
def gate(domain: int) -> Callable[..., Any]:
    """The gate of a node in this process."""
    import rclpy
    from rclpy.parameter import Parameter

    from xb_muscle_ros.node.muscle_node import MuscleNode

    made: list[Any] = []

    def make(**given: object) -> Any:
        context = rclpy.Context()
        context.init(args=[], domain_id=domain)
        overrides = [Parameter(name.replace("__", "."), value=value) for name, value in given.items()]
        made.append(MuscleNode(context=context, parameter_overrides=overrides, use_global_arguments=False))
        return made[-1]

    yield make
    for node in made:
        node.destroy_node()
        node.context.try_shutdown()


def dump(node: Any) -> dict[str, object]:
    """What `ros2 param dump` would write."""
    return {name: p.value for name, p in node.get_parameters_by_prefix("").items() if not name.startswith("qos")}


@pytest.mark.parametrize("loaded", ["at the start", "while configured"])
@pytest.mark.parametrize("many", [False, True])
def test_another_file_after_a_dump_is_the_other_fibre(gate: Callable[..., Any], loaded: str, many: bool) -> None:
    """What the dump has from the first file does not hide the second; what the user set stays."""
    from rclpy.parameter import Parameter

    file = {"fiber_files": ["18Dec2017a"], "fibers": ["left"]} if many else {"fiber_file": "18Dec2017a"}
    prefix = "left." if many else ""
    node = gate(autostart=False, mode="lockstep", **file)
    node.trigger_configure()
    written = dump(node)
    if loaded == "at the start":
        node = gate(**{name.replace(".", "__"): value for name, value in written.items()})
        node.trigger_configure()
    else:
        for name, value in written.items():
            # As `ros2 param load`: one after the other, read-only ones are refused.
            result = node.set_parameters([Parameter(name, value=value)])[0]
            # What is what it was is nothing to refuse.
            assert result.successful or "read-only" in result.reason, (name, result.reason)
    assert node.set_parameters([Parameter(f"{prefix}{F}", value=71.0)])[0].successful
    node.trigger_cleanup()
    other = {"fiber_files": ["13Dec2017a"]} if many else {"fiber_file": "13Dec2017a"}
    assert all(r.successful for r in node.set_parameters([Parameter(n, value=v) for n, v in other.items()]))
    node.trigger_configure()
    fibre = load_fibre("13Dec2017a")
    values = dump(node)
    assert values[f"{prefix}models.3state_coop.koop"] == fibre.values["koop"]
    assert fibre.values["koop"] != load_fibre("18Dec2017a").values["koop"]
    assert values[f"{prefix}source"] == fibre.source
    assert values[f"{prefix}{F}"] == 71.0
    if not many:
        assert values["fibre"] == "13Dec2017a"


def test_a_shared_file_does_not_stop_the_node(start: Callable[..., Any], tmp_path: Path) -> None:
    """One warning names the keys that are not its own."""
    path = tmp_path / "all.yaml"
    shared = {"use_gui": True, "controller": {"gains": [1.0, 2.0]}, "rate_hz": 250.0}
    path.write_text(yaml.safe_dump({"/**": {"ros__parameters": shared}}), encoding="utf-8")
    driver = start(mode="realtime", arguments=["--params-file", str(path)])
    log = driver.process.log()
    assert log.count("parameters ignored") == 1
    assert "none of these names: controller.gains, use_gui" in log or "use_gui, controller.gains" in log
    assert driver.link.parameters(["rate_hz"]) == {"rate_hz": 250.0}
    with pytest.raises(UserError, match="nearest of") as caught:
        driver.link.set_parameters({"zzzzz": 1.0})
    assert len(str(caught.value)) < 400


def test_a_small_number_survives_dump_and_load(gate: Callable[..., Any]) -> None:
    """`ros2 param dump` writes 1e-05, and `ros2 param load` sends that back as text; other text is no number."""
    from rclpy.parameter import Parameter

    node = gate(autostart=False, mode="lockstep", fiber_file="18Dec2017a")
    node.trigger_configure()
    assert node.set_parameters([Parameter("models.3state_coop.Fpe0", value="1e-05")])[0].successful
    assert node.get_parameter("models.3state_coop.Fpe0").value == 1e-5
    assert not node.set_parameters([Parameter("models.3state_coop.Fpe0", value="small")])[0].successful
