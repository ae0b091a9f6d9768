"""Layouts of plotting programs show what the node publishes."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

from xb_muscle_ros.trials.simulated import MOMENTS

FIELDS = {"length": {"position"}, "calcium": {"position"}, "force": {"position", "velocity", "effort"}}
FIBRE = "18Dec2017a"


def test_plotjuggler(repo_root: Path) -> None:
    """Topic, name and field of every curve; a JointState's series are called topic/name/field there."""
    tree = ElementTree.parse(repo_root / "config" / "plotjuggler.xml")
    curves = [curve.attrib["name"] for curve in tree.iter("curve")]
    known = {f"/muscle/{topic}/{FIBRE}/{field}" for topic, fields in FIELDS.items() for field in fields}
    known |= {f"/muscle/moments/{FIBRE}/{moment}/position" for moment in MOMENTS}
    assert len(curves) == len(set(curves)) == 10
    assert set(curves) <= known
    assert FIBRE in {path.stem for path in (repo_root / "config" / "fibers").glob("*.yaml")}


def test_foxglove(repo_root: Path) -> None:
    """Topic and field of every path, and every panel is laid out once."""
    text = (repo_root / "config" / "foxglove.json").read_text(encoding="utf-8")
    tree = json.loads(text)
    paths = [path["value"] for panel in tree["configById"].values() for path in panel.get("paths", [])]
    for path in paths:
        found = re.fullmatch(r"/muscle/(\w+)\.(\w+)\[(\d)\]", path)
        assert found, path
        topic, field, index = found.groups()
        assert field in {**FIELDS, "moments": {"position"}}[topic]
        assert int(index) < (len(MOMENTS) if topic == "moments" else 1)
    moments = tree["configById"]["Plot!moments"]["paths"]
    assert [p["label"] for p in moments] == list(MOMENTS)
    laid_out = re.findall(r'"(\w+!\w+)"', json.dumps(tree["layout"]))
    assert sorted(laid_out) == sorted(tree["configById"])
