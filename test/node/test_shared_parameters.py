"""Parameters that come from shared files, dumps and earlier fibre files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.models.fibre_file import find_fibre_file, load_fibre
from xb_muscle_ros.node.configuration import configure, configure_many
from xb_muscle_ros.node.foreign_keys import foreign_keys, ignored
from xb_muscle_ros.node.parameter_files import silent_files
from xb_muscle_ros.node.qos_overrides import told, without_effect

OWN = ("rate_hz", "fiber_file", "timeout_s", "mode", "model", "fibre")
F = "models.3state_coop.f"


def test_keys_of_other_nodes_are_told_from_slips() -> None:
    """Far from every name here: another node's."""
    names = ["rate_hz", F, "constants.f0_n", "use_gui", "controller_manager.update_rate", "robot_description", "rate"]
    assert foreign_keys(names, OWN) == names[3:]
    others = ["vision.models.path", "vision.models.3d.mesh", "robot.constants.g", "arm.models", "arm.sources.a"]
    assert foreign_keys(others, OWN) == others
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


def test_a_file_for_both_nodes_stops_neither() -> None:
    """What is the muscle node's is no slip of the plant's, however alike, and the other way round."""
    from xb_muscle_ros.node.parameters import NODE_PARAMETERS, TEXTS
    from xb_muscle_ros.plant.plant_parameters import PLANT_PARAMETERS, read

    class Node:
        """As much of a node as is asked for."""

        def __init__(self, given: dict[str, object]) -> None:
            self.given, self.said = given, list[str]()

        def get_parameters_by_prefix(self, prefix: str) -> dict[str, Any]:
            return {name: type("P", (), {"value": value}) for name, value in self.given.items()}

        def get_logger(self) -> Any:
            return type("L", (), {"warning": lambda _, text: self.said.append(text)})()

        def get_fully_qualified_name(self) -> str:
            return "/plant_node"

        def undeclare_parameter(self, name: str) -> None:
            pass

        def declare_parameter(self, *_: object, **__: object) -> None:
            pass

    theirs: dict[str, object] = {"fibers": ["left"], "fiber_files": ["a"], F: 80.0, "left.constants.f0_n": 2.0}
    node = Node({**theirs, "scene": "knee", "use_gui": True})
    assert read(node)["scene"] == "knee"
    assert len(node.said) == 1
    assert all(name in node.said[0] for name in [*theirs, "use_gui"])
    with pytest.raises(UserError, match="did you mean 'scene'"):
        read(Node({"scenee": "knee"}))
    own = {*NODE_PARAMETERS, *TEXTS}
    of_plant = [name for name in PLANT_PARAMETERS if name not in own]
    assert foreign_keys(of_plant, own) == of_plant


def test_a_file_that_says_nothing_to_the_node_is_named(tmp_path: Path) -> None:
    """ROS passes over it without a word."""
    bodies = {
        "yes": ["/**", "muscle_node", "/muscle_node", "/*", "/**/muscle_node"],
        "no": ["muscel_node", "/leg/muscle_node", "/*/muscle_node", "plant_node"],
    }
    for kind, keys in bodies.items():
        for key in keys:
            path = tmp_path / "one.yaml"
            path.write_text(yaml.safe_dump({key: {"ros__parameters": {"rate_hz": 500.0}}}), encoding="utf-8")
            said = silent_files(["--ros-args", "--params-file", str(path)], "/muscle_node")
            assert bool(said) == (kind == "no"), (key, said)
            if said:
                assert said[0].startswith(f"parameter file {path} has nothing for /muscle_node: its keys are /")
                assert "'/muscle_node' or '/**'" in said[0]
    path.write_text("leg:\n  muscle_node:\n    ros__parameters: {rate_hz: 500.0}\n", encoding="utf-8")
    assert silent_files(["--params-file", str(path)], "/leg/muscle_node") == []
    for empty in ("", "# nothing\n", "text\n", "/**:\n  ros__parameters: [1, 2]\n", "/**:\n  ros__parameters:\n"):
        path.write_text(empty, encoding="utf-8")
        (line,) = silent_files(["--params-file", str(path)], "/muscle_node")
        assert "it has no 'ros__parameters' with names below" in line


LENGTH = {"/muscle/length": "subscription", "/muscle/force": "publisher"}


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("subscription.reliability", "bogus", ["is 'bogus'", "reliable or best_effort"]),
        ("subscription.durability", 1, ["is 1", "transient_local or volatile"]),
        ("subscription.depth", -3, ["is -3", "1 to 1000000"]),
        ("subscription.depth", "big", ["is 'big'", "whole number"]),
        ("subscription.depth", True, ["is True"]),
        ("subscription.reliabilty", "reliable", ["history, depth, reliability, durability", "mean 'reliability'?"]),
        ("subscription.deadline", 5, ["is not known", "history, depth"]),
    ],
)
def test_wrong_quality_of_service_is_refused(name: str, value: object, words: list[str]) -> None:
    """With the parameter, its value and what is allowed."""
    with pytest.raises(UserError) as caught:
        without_effect({f"qos_overrides./muscle/length.{name}": value}, LENGTH)
    for word in (f"'qos_overrides./muscle/length.{name}'", *words):
        assert word in str(caught.value)


def test_quality_of_service_without_effect_is_named() -> None:
    """Of another topic, or of a publisher that the node does not have."""
    idle = ["/muscle/lenght.subscription.depth", "/muscle/length.publisher.depth", "muscle/length.subscription.depth"]
    heard = ["/muscle/length.subscription.depth", "/muscle/force.publisher.depth", "/clock.subscription.depth"]
    given = {f"qos_overrides.{name}": 5 for name in (*idle, *heard)}
    found = without_effect(given, LENGTH)
    assert found == [f"qos_overrides.{name}" for name in idle]
    text = told(found, "/muscle_node", LENGTH)
    assert all(name in text for name in (*idle, "/muscle/length.subscription", "/muscle/force.publisher"))


def test_quality_of_service_under_force_control(gate: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Regression: loads were unknown there: what had an effect was said to have none, and typing errors passed."""
    from xb_muscle_ros.node import parameter_gate

    looked: list[object] = []
    look = parameter_gate.look_at_overrides
    monkeypatch.setattr(parameter_gate, "look_at_overrides", lambda node, control: looked.append(look(node, control)))
    told_of: list[str] = []
    monkeypatch.setattr("xb_muscle_ros.node.qos_overrides.told", lambda names, *rest: told_of.extend(names) or "")
    ends = {"/muscle/load.subscription": 1, "/muscle/length.publisher": 1, "/muscle/length.subscription": 0}
    for end, is_there in ends.items():
        told_of.clear()
        gate(**{"fiber_file": "18Dec2017a", "control": "force", f"qos_overrides.{end}.depth": 5})
        assert told_of == ([] if is_there else [f"qos_overrides.{end}.depth"])
    gate(**{"fiber_file": "18Dec2017a", "control": "force", "qos_overrides./muscle/load.subscription.relibility": "x"})
    assert "mean 'reliability'?" in str(looked[-1])
    assert looked[:-1] == [None] * 3


def test_wrong_quality_of_service_fails_the_configuration(gate: Callable[..., Any]) -> None:
    """In words of the parameter rather than of the middleware."""
    from rclpy.lifecycle import TransitionCallbackReturn

    node = gate(**{"fiber_file": "18Dec2017a", "qos_overrides./muscle/length.subscription.depth": -3})
    assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
    assert "depth' is -3" in str(node.failure)


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


@pytest.mark.slow
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


def test_a_file_named_later_takes_the_place_of_a_fibre_that_came_as_parameters(gate: Callable[..., Any]) -> None:
    """As with ``--params-file`` of a fibre file; what the user set stays, and without a file the first is back."""
    from rclpy.parameter import Parameter

    tree = yaml.safe_load(find_fibre_file("18Dec2017a").read_text(encoding="utf-8"))["/**"]["ros__parameters"]
    node = gate(mode="lockstep", **_flat(tree))
    node.trigger_configure()
    assert node.set_parameters([Parameter(F, value=71.0)])[0].successful
    for name, value in dump(node).items():
        node.set_parameters([Parameter(name, value=value)])
    for file in ("13Dec2017a", "", "13Dec2017a"):
        node.trigger_cleanup()
        assert node.set_parameters([Parameter("fiber_file", value=file)])[0].successful
        node.trigger_configure()
        fibre = load_fibre(file or "18Dec2017a")
        values = dump(node)
        assert (values["fibre"], values["source"]) == (fibre.name, fibre.source)
        assert values["models.3state_coop.koop"] == fibre.values["koop"]
        assert values[F] == 71.0


def _flat(tree: dict[str, Any], above: str = "") -> dict[str, object]:
    """A tree of parameters by names with dots."""
    made: dict[str, object] = {}
    for name, value in tree.items():
        made |= _flat(value, f"{above}{name}.") if isinstance(value, dict) else {f"{above}{name}": value}
    return made


@pytest.mark.slow
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


def test_a_fibre_has_no_parameters_while_there_is_none(gate: Callable[..., Any]) -> None:
    """A dump that is loaded into a node before it is configured is told what to do first."""
    from rclpy.parameter import Parameter

    node = gate(autostart=False, mode="lockstep", fiber_file="18Dec2017a")
    for name, words in ((F, "is there while the node is configured; configure it first"), ("models.x", "not known")):
        with pytest.raises(Exception, match=words):
            node.set_parameters([Parameter(name, value=71.0)])


def test_a_small_number_survives_dump_and_load(gate: Callable[..., Any]) -> None:
    """`ros2 param dump` writes 1e-05, and `ros2 param load` sends that back as text; other text is no number."""
    from rclpy.parameter import Parameter

    node = gate(autostart=False, mode="lockstep", fiber_file="18Dec2017a")
    node.trigger_configure()
    assert node.set_parameters([Parameter("models.3state_coop.Fpe0", value="1e-05")])[0].successful
    assert node.get_parameter("models.3state_coop.Fpe0").value == 1e-5
    assert not node.set_parameters([Parameter("models.3state_coop.Fpe0", value="small")])[0].successful
