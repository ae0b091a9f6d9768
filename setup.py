"""Build script: read by pip and by colcon (package.xml holds the ROS side of the same facts)."""

import re
from pathlib import Path

from setuptools import find_packages, setup

NAME = "xb_muscle_ros"


def files(pattern: str) -> list[str]:
    """Return the files that match, relative to this folder; data_files takes no patterns of its own."""
    return sorted(str(path) for path in Path().glob(pattern) if path.is_file())


def version() -> str:
    """Return the version, which stands in the package."""
    found = re.search(r'^__version__ = "(.+)"$', Path(NAME, "__init__.py").read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise ValueError(f"{NAME}/__init__.py has no line '__version__ = \"...\"'")
    return found[1]


setup(
    name=NAME,
    version=version(),
    description="Cross-bridge muscle for robots and physiologists: fibre length and calcium in, force out",
    license="Apache-2.0",
    maintainer="xb_muscle_ros maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["py.typed", "*.pyi"],
        f"{NAME}.bench": ["*.c"],
        f"{NAME}.diagnose.report": ["*.css", "*.yaml", "templates/*.j2"],
        f"{NAME}.plant": ["*.xml"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", files("launch/*.launch.py")),
        (f"share/{NAME}/config", files("config/*.*")),
        (f"share/{NAME}/config/fibers", files("config/fibers/*.yaml")),
        (f"share/{NAME}/config/fibers/augmented", files("config/fibers/augmented/*.yaml")),
        # `ros2 run` and launch look in lib/<package>; pip puts console scripts only in bin/.
        (f"lib/{NAME}", files("scripts/ros/*")),
    ],
    python_requires=">=3.10",
    install_requires=[
        "setuptools",
        "numpy>=1.26",
        "scipy>=1.11",
        "numba>=0.58",
        "matplotlib>=3.6",
        "jinja2>=3.0",
        "PyYAML>=6.0",
        "sympy>=1.12",
        "tqdm>=4.64",
        "mcap>=1.1",
        "rosbags>=0.11.9,<0.12",
        "lz4>=4.0",
        "zstandard>=0.20",
    ],
    extras_require={
        "mujoco": ["mujoco>=3.1"],
        "body": ["mujoco>=3.4", "myo-sim>=0.2.4"],
        "dask": ["cloudpickle>=2.0", "dask>=2024.1", "distributed>=2024.1"],
        "casadi": ["casadi>=3.6"],
        "pandas": ["pandas>=2.0"],
        "files": ["h5py>=3.8", "pyabf>=2.3", "pymatreader>=1.0", "python-calamine>=0.2"],
        "parquet": ["pyarrow>=14"],
        "docs": ["mkdocs-material>=9.5", "mkdocstrings[python]>=1.0", "ruff"],
        "test": [
            "casadi",
            "distributed",
            "ipykernel",
            "mujoco",
            "myo-sim",
            "h5py",
            "nbclient",
            "openpyxl",
            "pandas",
            "pyabf",
            "pyarrow",
            "pymatreader",
            "python-calamine",
            "pytest",
            "pytest-xdist",
            "hypothesis",
            "ruff",
            "mypy",
            "import-linter",
            "types-PyYAML",
            "scipy-stubs",
            "colcon-core",
            "colcon-ros",
            "colcon-bash",
            "colcon-output",
            "colcon-library-path",
            "xlwt",
        ],
    },
    entry_points={
        "console_scripts": [
            "xb_muscle = xb_muscle_ros.cli.main:console",
            "muscle_node = xb_muscle_ros.node.main:main",
            "plant_node = xb_muscle_ros.plant.plant_node:main",
        ]
    },
    zip_safe=False,
)
