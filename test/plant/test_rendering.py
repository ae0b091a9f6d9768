"""Pictures without a screen."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant import rendering
from xb_muscle_ros.plant.rendering import choose_way, film_maker, write_film, write_pictures

pytest.importorskip("mujoco", reason="needs the extra mujoco")


def pictures(count: int) -> list[np.ndarray]:
    """Each of another grey."""
    return [np.full((32, 48, 3), 20 * k, dtype=np.uint8) for k in range(count)]


def test_where_nothing_can_be_drawn_one_line_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "paper")
    with pytest.raises(
        UserError, match=r"nothing can be drawn off screen here \(paper: .*paper.*\); install .*libosmesa6"
    ):
        choose_way()


def test_the_first_way_that_works_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    def run(command: list[str], env: dict[str, str], **_: object) -> subprocess.CompletedProcess[str]:
        tried.append(env["MUJOCO_GL"])
        return subprocess.CompletedProcess(command, len(tried) % 2, "", "a\nno driver\n")

    # Put back after the test, whatever it sets.
    monkeypatch.setenv("MUJOCO_GL", "")
    monkeypatch.setattr(rendering.subprocess, "run", run)
    assert choose_way() == "osmesa"
    assert tried == ["egl", "osmesa"]
    assert os.environ["MUJOCO_GL"] == "osmesa"


def test_pictures_are_files_in_order(tmp_path: Path) -> None:
    from matplotlib.image import imread

    assert write_pictures(tmp_path, pictures(3)) == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"frame_000{k}.png" for k in range(3)]
    assert imread(tmp_path / "frame_0002.png")[0, 0, 0] == pytest.approx(40 / 255, abs=1e-3)


def test_a_film_gets_every_picture(tmp_path: Path) -> None:
    """A program in ffmpeg's place keeps what it is sent."""
    maker = tmp_path / "maker"
    maker.write_text(f"#!{sys.executable}\nimport sys\nopen(sys.argv[-1], 'wb').write(sys.stdin.buffer.read())\n")
    maker.chmod(0o755)
    write_film(tmp_path / "film.mp4", pictures(5), 25.0, str(maker))
    assert (tmp_path / "film.mp4").read_bytes() == b"".join(p.tobytes() for p in pictures(5))


def test_a_film_that_cannot_be_made_leaves_nothing(tmp_path: Path) -> None:
    maker = tmp_path / "maker"
    maker.write_text("#!/bin/sh\necho no codec >&2\nexit 3\n")
    maker.chmod(0o755)
    with pytest.raises(UserError, match=r"cannot write .*no codec; use --frames"):
        write_film(tmp_path / "film.mp4", pictures(200), 25.0, str(maker))
    assert [path.name for path in tmp_path.iterdir()] == ["maker"]


@pytest.mark.slow
def test_the_leg_is_drawn(tmp_path: Path) -> None:
    """In a process of its own, as the script does: MuJoCo chooses how to draw when it is first imported."""
    pytest.importorskip("myo_sim", reason="needs the extra body")
    try:
        way = choose_way()
    except UserError as error:
        pytest.skip(str(error))
    from matplotlib.image import imread

    program = [sys.executable, "-m", "xb_muscle_ros.plant.leg.film", "--out", str(tmp_path), "--frames"]
    done = subprocess.run(
        [*program, "--duration", "0.02", "--size", "160", "180"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert way in done.stdout
    first, last = (imread(tmp_path / f"frame_000{k}.png") for k in (0, 2))
    assert first.shape[:2] == (180, 160)
    assert np.std(first[..., :3]) > 0.05
    assert not np.array_equal(first, last)
    again = subprocess.run(program, capture_output=True, text=True, check=False)
    assert again.returncode == 2
    assert "--overwrite" in again.stderr


def test_film_maker_is_a_program_or_nothing() -> None:
    found = film_maker()
    assert not found or Path(found).is_file()
