"""A stand-in for tf2_msgs where ROS comes as wheels, which lack it: made by ROS' own generators, compiled here.

Its one message is written down from the package's public definition.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np

PACKAGE = "tf2_msgs"
DEFINITION = "geometry_msgs/TransformStamped[] transforms\n"
_PREFIX = Path(sys.prefix)
# Wheels may have left their metadata twice; each entry point counts once.
_GENERATE = """
import importlib.metadata, sys
import rosidl_cli.entry_points as found
def once(group, *, specs=None, strict=False):
    return {e.name: e for e in importlib.metadata.entry_points(group=group) if specs is None or e.name in specs}
found.get_entry_points = once
from rosidl_cli.cli import main
sys.exit(main())
"""
_SUPPORTS = ("rosidl_typesupport_c", "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")


def can_be_made() -> bool:
    """Whether generators, headers and a compiler are at hand."""
    headers = _PREFIX / "include" / "rosidl_runtime_c"
    return headers.is_dir() and all(map(shutil.which, ("gcc", "g++")))


def make(folder: Path) -> dict[str, str]:
    """Make the package in an empty folder.

    Returns:
        variables of the environment of a process that uses it: folders that go to the front.
    """
    (folder / "msg").mkdir(parents=True)
    (folder / "msg" / "TFMessage.msg").write_text(DEFINITION)
    kinds = [f"-t{kind}" for kind in ("c", "cpp", "py")] + [
        f"-ts={kind[len('rosidl_typesupport_') :]}" for kind in _SUPPORTS
    ]
    generate = [sys.executable, "-c", _GENERATE, "generate", "-o", "out", *kinds, "-I", str(_PREFIX / "share")]
    _run([*generate, PACKAGE, "msg/TFMessage.msg"], folder)
    out, library, package = folder / "out", folder / "lib", folder / "python" / PACKAGE
    for part in ("c", "cpp", "fastrtps_c", "introspection_c"):
        shutil.copytree(out / part / "msg", folder / "include" / PACKAGE / "msg", dirs_exist_ok=True)
    shutil.copytree(out / "py", package)
    (package / "__init__.py").touch()
    library.mkdir()

    def build(made: Path, source: Path, *others: Path, needs: tuple[str, ...]) -> None:
        compiler = "g++" if source.suffix == ".cpp" else "gcc"
        where = [folder / "include", *sorted((_PREFIX / "include").iterdir()), _PREFIX / "include", np.get_include()]
        include = [f"-I{path}" for path in (*where, sysconfig.get_path("include"))]
        find = [f for path in (library, _PREFIX / "lib") for f in (f"-L{path}", f"-Wl,-rpath,{path}")]
        libraries = [f"-l{name}" for name in needs]
        sources = [str(path) for path in (source, *others)]
        _run([compiler, "-fPIC", "-shared", "-w", *include, *sources, "-o", str(made), *find, *libraries], folder)

    def of(kind: str) -> Path:
        return library / f"lib{PACKAGE}__{kind}.so"

    own, base = f"{PACKAGE}__rosidl_generator_c", "geometry_msgs__rosidl_generator_c"
    detail = out / "c" / "msg" / "detail"
    c = [detail / f"tf_message__{part}.c" for part in ("functions", "description", "type_support")]
    common = ("std_msgs__rosidl_generator_c", "builtin_interfaces__rosidl_generator_c", "rosidl_runtime_c", "rcutils")
    build(of("rosidl_generator_c"), *c, needs=(base, *common))
    fast = ("geometry_msgs__rosidl_typesupport_fastrtps_c", "rosidl_typesupport_fastrtps_c")
    source = out / "fastrtps_c" / "msg" / "detail" / "tf_message__type_support_c.cpp"
    build(of(_SUPPORTS[1]), source, needs=(own, *fast, "rosidl_typesupport_fastrtps_cpp", "fastcdr"))
    looked = ("geometry_msgs__rosidl_typesupport_introspection_c", "rosidl_typesupport_introspection_c")
    source = out / "introspection_c" / "msg" / "detail" / "tf_message__type_support.c"
    build(of(_SUPPORTS[2]), source, needs=(own, *looked))
    build(of(_SUPPORTS[0]), out / "c" / "msg" / "tf_message__type_support.cpp", needs=(own, "rosidl_typesupport_c"))
    source = out / "py" / "msg" / "_tf_message_s.c"
    build(of("rosidl_generator_py"), source, needs=(own, "geometry_msgs__rosidl_generator_py"))
    for kind in _SUPPORTS:
        needs = (
            f"{PACKAGE}__rosidl_generator_py",
            f"{PACKAGE}__{kind}",
            own,
            "rosidl_typesupport_c",
            "rosidl_runtime_c",
        )
        build(package / f"{PACKAGE}_s__{kind}.so", out / "py" / f"_{PACKAGE}_s.ep.{kind}.c", needs=needs)
    return {"PYTHONPATH": str(package.parent), "LD_LIBRARY_PATH": str(library)}


def _run(command: list[str], folder: Path) -> None:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, f"{' '.join(command[:3])}: {done.stdout[-500:]}{done.stderr[-2000:]}"
