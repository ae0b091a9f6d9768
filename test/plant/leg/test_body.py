"""MyoLeg as a body to stand with."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.leg import body as module
from xb_muscle_ros.plant.leg.body import Body


def test_soles_are_the_engine_s_contacts(body: Body) -> None:
    """What contacts say of their depth, the points say too."""
    body.data.qpos[2] -= 0.0005
    body.place(body.data.qpos.copy())
    heights = body.heights_m()
    depths = [contact.dist for contact in body.data.contact[: body.data.ncon]]
    # Every heel and toe touches; midfoot ends, which are no points of the sole, may touch as well.
    for height in heights:
        assert np.min(np.abs(np.array(depths) - height)) < 1e-9


def test_platform_is_a_plane_where_the_model_has_its_own(body: Body) -> None:
    floor = body.model.geom("floor")
    assert floor.type == body.mj.mjtGeom.mjGEOM_PLANE
    assert abs(float(np.min(body.heights_m()))) < 2e-3


def test_posture_changes_and_their_difference_are_inverse(body: Body) -> None:
    start = body.data.qpos.copy()
    change = np.linspace(-0.01, 0.01, body.model.nv)
    assert body.difference(start, body.moved(start, change)) == pytest.approx(change, abs=1e-9)


def test_coupled_knees_follow_the_model(body: Body) -> None:
    qpos = body.data.qpos.copy()
    qpos[body.coordinates("knee_angle")] = 0.3
    body.place(body.coupled(qpos))
    equality = body.data.efc_type == body.mj.mjtConstraint.mjCNSTR_EQUALITY
    assert np.max(np.abs(body.data.efc_pos[equality])) < 1e-12


def test_frame_that_accelerates_pushes_the_other_way(body: Body) -> None:
    body.frame_accelerates(2.0)
    assert body.model.opt.gravity @ body.FORWARD == pytest.approx(-2.0)
    assert body.model.opt.gravity[2] == -9.81


def test_bodies_do_not_share_what_one_of_them_changes(body: Body) -> None:
    body.model.actuator_gainprm[:] = 0.0
    assert Body().model.actuator_gainprm.any()


def test_without_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "myo_sim", None)
    module._compiled.cache_clear()
    with pytest.raises(UserError, match=r"myo_sim cannot be imported .*pip install 'xb_muscle_ros\[body\]'"):
        Body()


def test_nothing_is_written_beside_the_user_s_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    module._compiled.cache_clear()
    Body()
    assert list(tmp_path.iterdir()) == []
