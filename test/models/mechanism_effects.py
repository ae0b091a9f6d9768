"""A value for each mechanism beside the families at which it is felt; the first one switches it on."""

from __future__ import annotations

from collections.abc import Mapping

EFFECT: Mapping[str, Mapping[str, float]] = {
    "viscous_drag": {"drag": 0.01},
    "passive_viscoelasticity": {"pv_stiffness": 1.0, "pv_tau": 0.05, "pv_ratio": 0.5},
    "weakly_bound_heads": {"weak_stiffness": 40.0, "weak_detachment": 500.0},
    "filament_friction": {"friction_force": 0.2, "friction_way": 0.01, "friction_release": 5.0},
    "active_titin": {"titin_stiffness": 2.0, "titin_calcium": 0.5},
    "static_calcium_stiffness": {"calcium_stiffness": 2.0, "stiffness_calcium": 0.5},
    "length_dependent_activation": {"calcium_per_length": 2.0},
    "lattice_spacing": {"attachment_per_length": 2.0},
    "filament_overlap": {"overlap_per_length": -2.0},
    "strain_recruited_heads": {"strain_recruitment": 150.0},
    "persistent_thick_filament": {"thick_persistence": 2.0},
    "nonlinear_crossbridge": {"head_curvature": 0.1},
    "half_sarcomere_spread": {"hs_spread": 0.1},
    "temperature": {"warmer": 5.0},
    "phosphate": {"phosphate_detachment": 5.0},
    # The limits that are narrowest here: what a stretch of 4 % L0 does is felt.
    "active_force_length": {"fl_min": 0.8, "fl_max": 1.2},
    "passive_force_length": {"fp_max": 2.0, "fl_max": 1.2},
}

BESIDE: Mapping[str, str] = {
    "active_force_length": "3state_coop_slack",
    "passive_force_length": "3state_coop_slack",
}
"""Model that a mechanism is tried with, where it does not go with ``3state_coop``."""
