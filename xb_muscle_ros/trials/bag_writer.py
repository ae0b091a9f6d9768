"""The `rosbags` writer with three things made to fit: the MCAP file's name, ``custom_data`` and ``ros_distro``.

rosbag2 numbers the files of a bag. And the YAML writer within `rosbags` wraps long lines in ways that add or lose
spaces, in the metadata file and in its copy within the MCAP file; here nothing is wrapped.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import McapWriter

from xb_muscle_ros.trials import fast_yaml

# Whose message definitions and type hashes the bags hold.
ROS_DISTRO = "jazzy"


class _Mcap(McapWriter):
    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self._facts: dict[str, str] = {}

    def begin(self, name: str, facts: dict[str, str]) -> None:
        self.path = self.path.rename(self.path.parent / f"{name}_0.mcap")
        self._facts = facts

    def close(self, version: int, metadata: str) -> None:
        super().close(version, _with_facts(metadata, self._facts))


class BagWriter(Writer):
    """Writes an MCAP bag of rosbag2's version 9 to a folder that does not exist yet.

    Args:
        folder: the folder to make.
        name: the bag's name, which may differ from that of the folder.
        facts: the bag's ``custom_data``.
    """

    STORAGE_PLUGINS = MappingProxyType({StoragePlugin.MCAP: _Mcap})

    def __init__(self, folder: Path, name: str, facts: Mapping[str, str]) -> None:
        super().__init__(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._name = name
        self._facts = dict(facts)

    def open(self) -> None:
        """Make the folder and open the file."""
        super().open()
        assert isinstance(self.storage, _Mcap)  # from STORAGE_PLUGINS
        self.storage.begin(self._name, self._facts)

    def close(self) -> None:
        """Write the metadata and close the file."""
        super().close()
        text = self.metapath.read_text(encoding="utf-8")
        self.metapath.write_text(_with_facts(text, self._facts), encoding="utf-8")


def _with_facts(text: str, facts: dict[str, str]) -> str:
    """The metadata with ``custom_data`` and ``ros_distro`` put in, every value on one line."""
    tree: dict[str, Any] = fast_yaml.load(text)
    tree.get("rosbag2_bagfile_information", tree).update(custom_data=facts, ros_distro=ROS_DISTRO)
    return fast_yaml.dump(tree)
