"""One series element in place of the fibre's own and a tendon."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.plant.mjcf.spring import Spring, with_tendon
from xb_muscle_ros.plant.tendon import strain, tendon_at


def test_strain_is_the_inverse_of_the_curve() -> None:
    slack = tendon_at(0.0, 1.0)
    for force in (0.05, 0.3, 1.0, 1.4):
        assert slack.force_f0(float(strain(np.array(force)))) == pytest.approx(force, rel=1e-12)


@pytest.mark.parametrize("slack_l0", [0.3, 2.0, 8.5])
@pytest.mark.parametrize("toe", [0.1, 0.25, 0.6])
def test_stretches_as_both_do_in_series(slack_l0: float, toe: float) -> None:
    own = Spring(0.0285, toe)
    force = np.linspace(0.0, 1.2, 25)
    both = own.length_l0 * np.log1p(force / toe) + slack_l0 * strain(force)
    one = with_tendon(own, slack_l0)
    np.testing.assert_allclose(one.length_l0 * np.log1p(force / one.force_f0), both, atol=2e-3)
    assert one.length_l0 * np.log1p(1.0 / one.force_f0) == pytest.approx(np.interp(1.0, force, both), rel=1e-3)
