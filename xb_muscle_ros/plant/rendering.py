"""Pictures of a MuJoCo model without a screen, and a film of them."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import os
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import replaced

Picture = npt.NDArray[np.uint8]

WAYS = ("egl", "osmesa")
_TRIAL = (
    "import mujoco as m; o = m.MjModel.from_xml_string('<mujoco/>'); d = m.MjData(o); r = m.Renderer(o, 8, 8); "
    "m.mj_forward(o, d); r.update_scene(d); r.render()"
)
_TRIAL_S = 60.0
_VARIABLE = "MUJOCO_GL"


def choose_way() -> str:
    """Set how MuJoCo draws off screen to the first way that works here, tried in a process of its own.

    MuJoCo looks at the variable when it is first imported, and one that fails cannot be mended in the same process.

    Returns:
        the way, ``egl`` (needs a driver, of Debian's ``libegl1`` and ``libgl1-mesa-dri`` for example) or ``osmesa``
        (Debian's ``libosmesa6``), or what the environment asks for.

    Raises:
        UserError: none works.
    """
    asked = os.environ.get(_VARIABLE)
    said = []
    for way in (asked,) if asked else WAYS:
        try:
            done = subprocess.run(
                [sys.executable, "-c", _TRIAL],
                env={**os.environ, _VARIABLE: way},
                capture_output=True,
                text=True,
                timeout=_TRIAL_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            said.append(f"{way}: no answer in {_TRIAL_S:g} s")
            continue
        if done.returncode == 0:
            os.environ[_VARIABLE] = way
            return way
        lines = done.stderr.strip().splitlines()
        said.append(f"{way}: {lines[-1] if lines else f'code {done.returncode}'}")
    raise UserError(
        f"nothing can be drawn off screen here ({'; '.join(said)}); install Debian's libosmesa6, or libegl1 and "
        f"libgl1-mesa-dri, and leave {_VARIABLE} unset"
    )


def film_maker() -> str:
    """The ffmpeg to call: of the system, or of the package imageio-ffmpeg; empty where there is none."""
    found = shutil.which("ffmpeg")
    if found:
        return found
    try:
        return str(importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        return ""


class Camera:
    """Draws a model from the side."""

    def __init__(self, model: Any, width: int, height: int, look_at: npt.ArrayLike, distance_m: float, azimuth: float):
        """Open the drawing; `choose_way` comes first.

        Args:
            model: MjModel.
            width, height: pixels.
            look_at: shape (3,), m.
            distance_m: from there.
            azimuth: degrees; 0 looks along x, 90 along y.
        """
        self._mj = importlib.import_module("mujoco")
        model.vis.global_.offwidth = max(model.vis.global_.offwidth, width)
        model.vis.global_.offheight = max(model.vis.global_.offheight, height)
        self._renderer = self._mj.Renderer(model, height, width)
        for costly in (self._mj.mjtRndFlag.mjRND_SHADOW, self._mj.mjtRndFlag.mjRND_REFLECTION):
            self._renderer.scene.flags[costly] = 0
        self._view = self._mj.MjvCamera()
        self._view.lookat[:] = look_at
        self._view.distance, self._view.azimuth, self._view.elevation = distance_m, azimuth, -8.0

    def picture(self, data: Any) -> Picture:
        """The moment of an MjData, shape (height, width, 3)."""
        self._renderer.update_scene(data, self._view)
        drawn: Picture = self._renderer.render()
        return drawn

    def close(self) -> None:
        """End the drawing."""
        self._renderer.close()


def write_film(path: Path, pictures: Iterable[Picture], per_s: float, ffmpeg: str) -> None:
    """Write an MP4 (H.264); it appears whole or not at all.

    Args:
        path: of the film.
        pictures: of one size, even in both directions.
        per_s: pictures per second.
        ffmpeg: see `film_maker`.

    Raises:
        UserError: ffmpeg fails.
    """
    rest = iter(pictures)
    first = next(rest)
    height, width = first.shape[:2]
    with replaced(path) as temporary:
        command = [
            ffmpeg, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
            "-r", f"{per_s:g}", "-i", "-", "-pix_fmt", "yuv420p", "-f", "mp4", str(temporary),
        ]  # fmt: skip
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            # A program that has given up says why, which is more than that it no longer reads.
            with contextlib.suppress(BrokenPipeError):
                for picture in itertools.chain([first], rest):
                    process.stdin.write(picture.tobytes())
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
            said = process.stderr.read().decode(errors="replace").strip()
            process.stderr.close()
            process.wait()
        if process.returncode != 0:
            raise UserError(f"{ffmpeg} cannot write {path}: {said or f'code {process.returncode}'}; use --frames")


def write_pictures(folder: Path, pictures: Iterable[Picture]) -> int:
    """Write ``frame_0000.png`` and so on; returns how many."""
    from matplotlib.image import imsave

    count = 0
    for count, picture in enumerate(pictures, 1):
        with replaced(folder / f"frame_{count - 1:04d}.png") as temporary:
            imsave(temporary, picture)
    return count
