"""What figures and tables call a parameter set: as the paper does, where it has a name for its model."""

from __future__ import annotations

from xb_muscle_ros.models.registry import model_of_set

_NAMES = {
    "hill": "Hill (no SE)",
    "hill_se": "Hill (with SE)",
    "2state": "2-state XB",
    "2state_coop": "2-state XB coop",
    "3state_coop": "3-state XB coop",
    "4state_coop": "4-state XB coop",
}


def title_of(set_name: str) -> str:
    """Title of a parameter set, for example ``3-state XB coop v3``."""
    model = model_of_set(set_name)
    return _NAMES.get(model, model) + set_name[len(model) :].replace("_", " ")
