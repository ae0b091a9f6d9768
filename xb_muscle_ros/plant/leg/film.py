"""``scripts/render_leg``: the standing leg, pushed, as a film."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import matching, refuse_older
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import make_fibres
from xb_muscle_ros.plant.leg.stance import Aim, find_stance
from xb_muscle_ros.plant.rendering import Camera, Picture, choose_way, film_maker, write_film, write_pictures
from xb_muscle_ros.plant.translation import RampAndHold

_PER_S = 25.0
_DISTANCE_M, _AZIMUTH = 2.6, 160.0
_SLACK_COLOUR, _PULLING_COLOUR = np.array([0.55, 0.6, 0.75]), np.array([0.85, 0.1, 0.05])
_WHOLE_F0 = 0.6
"""Share of F0 that has the whole colour."""


def main(argv: Sequence[str] | None = None) -> int:
    """Make the film; 2 after one line where that cannot be."""
    try:
        return _run(_arguments(argv))
    except UserError as error:
        print(f"render_leg: {error}", file=sys.stderr)
        return 2


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="render_leg", description="MyoLeg stands, its platform moves: leg.mp4.")
    parser.add_argument("--out", type=Path, default=Path("out/render_leg"), metavar="FOLDER", help="for the film")
    parser.add_argument("--fiber", default="18Dec2017a", metavar="NAME", help="fibre (default 18Dec2017a)")
    parser.add_argument("--model", default="3state_coop_slack", help="of the muscles (default 3state_coop_slack)")
    parser.add_argument("--duration", type=float, default=0.9, metavar="S", help="of the motion (default 0.9)")
    parser.add_argument("--displacement", type=float, default=-0.075, metavar="M", help="of the platform")
    parser.add_argument("--slow", type=float, default=4.0, metavar="TIMES", help="slow motion (default 4)")
    parser.add_argument("--size", type=int, nargs=2, default=(640, 720), metavar=("WIDTH", "HEIGHT"), help="pixels")
    parser.add_argument("--frames", action="store_true", help="PNG files in place of a film")
    parser.add_argument("--overwrite", action="store_true", help="replace an older film")
    return parser.parse_args(argv)


def _run(arguments: argparse.Namespace) -> int:
    if not 0.02 <= arguments.duration <= 60.0 or not 0.1 <= arguments.slow <= 100.0:
        asked = f"--duration is {arguments.duration:g} s and --slow is {arguments.slow:g}"
        raise UserError(f"{asked}; allowed are 0.02 to 60 and 0.1 to 100")
    if any(not 16 <= pixels <= 4096 or pixels % 2 for pixels in arguments.size):
        raise UserError(f"--size is {arguments.size[0]} {arguments.size[1]}; allowed are even numbers from 16 to 4096")
    out: Path = arguments.out
    refuse_older(matching(out, r"leg\.mp4|frame_\d+\.png"), arguments.overwrite)
    way = choose_way()
    ffmpeg = "" if arguments.frames else film_maker()
    pictures = _pictures(arguments)
    if ffmpeg:
        write_film(out / "leg.mp4", pictures, _PER_S, ffmpeg)
        print(f"{out / 'leg.mp4'} (drawn by {way})")
        return 0
    count = write_pictures(out, pictures)
    why = "" if arguments.frames else "; no ffmpeg for a film: install it, or pip install imageio-ffmpeg"
    print(f"{out}: {count} frames, frame_0000.png and so on (drawn by {way}){why}")
    return 0


def _pictures(arguments: argparse.Namespace) -> Iterator[Picture]:
    """Of the stance and the push, seen from the platform; tendons redden with the force of their muscle."""
    body = Body()
    stance = find_stance(body, Aim())
    drive = make_fibres(load_fibre(arguments.fiber, arguments.model), arguments.fiber, False)(body, stance)
    platform = RampAndHold(arguments.displacement)
    mj, model, data, muscles = body.mj, body.model, body.data, drive.muscles
    tendons = model.actuator_trnid[muscles.index, 0]
    mj.mj_resetData(model, data)
    body.place(stance.qpos)
    drive.reset()
    width, height = arguments.size
    camera = Camera(model, width, height, [*body.com_m[:2], 0.8 * body.com_m[2]], _DISTANCE_M, _AZIMUTH)
    every = max(1, round(1.0 / (_PER_S * arguments.slow * body.tick_s)))
    try:
        for k in range(round(arguments.duration / body.tick_s) + 1):
            body.frame_accelerates(platform.mean_acceleration(k * body.tick_s, body.tick_s))
            mj.mj_step1(model, data)
            drive.advance()
            if k % every == 0:
                share = np.clip(-data.ctrl[muscles.index] / (_WHOLE_F0 * muscles.f0_n), 0.0, 1.0)[:, None]
                model.tendon_rgba[tendons, :3] = (1.0 - share) * _SLACK_COLOUR + share * _PULLING_COLOUR
                yield camera.picture(data)
            mj.mj_step2(model, data)
    finally:
        camera.close()


if __name__ == "__main__":
    raise SystemExit(main())
