"""Names of everything that a diagnosis may answer, and which of them data can hardly tell apart.

The families were laid down before any concealed data were diagnosed: members act on the same thing in nearly the same
way, so that naming the family is worth something even where the member cannot be told.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType


class Name(str, enum.Enum):
    """Mechanisms, then faults of the measurement."""

    VISCOUS_DRAG = "viscous_drag"
    PASSIVE_VISCOELASTICITY = "passive_viscoelasticity"
    WEAKLY_BOUND_HEADS = "weakly_bound_heads"
    FILAMENT_FRICTION = "filament_friction"
    ACTIVE_TITIN = "active_titin"
    STATIC_CALCIUM_STIFFNESS = "static_calcium_stiffness"
    LENGTH_DEPENDENT_ACTIVATION = "length_dependent_activation"
    LATTICE_SPACING = "lattice_spacing"
    FILAMENT_OVERLAP = "filament_overlap"
    STRAIN_RECRUITED_HEADS = "strain_recruited_heads"
    PERSISTENT_THICK_FILAMENT = "persistent_thick_filament"
    FORCIBLE_DETACHMENT = "forcible_detachment"
    NONLINEAR_CROSSBRIDGE = "nonlinear_crossbridge"
    HALF_SARCOMERE_SPREAD = "half_sarcomere_spread"
    SERIES_COMPLIANCE = "series_compliance"
    THIN_FILAMENT_COOPERATIVITY = "thin_filament_cooperativity"
    THICK_FILAMENT_COOPERATIVITY = "thick_filament_cooperativity"
    TEMPERATURE = "temperature"
    PHOSPHATE = "phosphate"
    PCA_SHIFT = "pca_shift"
    RUN_DOWN = "run_down"
    FORCE_OFFSET = "force_offset"
    FORCE_DRIFT = "force_drift"
    LENGTH_GAIN = "length_gain"
    TIME_SHIFT = "time_shift"
    TRANSDUCER_LAG = "transducer_lag"


_FAMILIES: Mapping[str, tuple[Name, ...]] = {
    "parallel_viscoelasticity": (Name.VISCOUS_DRAG, Name.PASSIVE_VISCOELASTICITY),
    "weak_binding": (Name.WEAKLY_BOUND_HEADS, Name.FILAMENT_FRICTION),
    "calcium_dependent_elasticity": (Name.ACTIVE_TITIN, Name.STATIC_CALCIUM_STIFFNESS),
    "length_dependence": (Name.LENGTH_DEPENDENT_ACTIVATION, Name.LATTICE_SPACING, Name.FILAMENT_OVERLAP),
    "regulation": (
        Name.STRAIN_RECRUITED_HEADS,
        Name.PERSISTENT_THICK_FILAMENT,
        Name.THIN_FILAMENT_COOPERATIVITY,
        Name.THICK_FILAMENT_COOPERATIVITY,
    ),
    "heads_under_strain": (Name.FORCIBLE_DETACHMENT, Name.NONLINEAR_CROSSBRIDGE),
    "heterogeneity": (Name.HALF_SARCOMERE_SPREAD,),
    "compliance": (Name.SERIES_COMPLIANCE,),
    "rates": (Name.TEMPERATURE, Name.PHOSPHATE),
    "calcium_of_solutions": (Name.PCA_SHIFT,),
    "force_scale": (Name.RUN_DOWN,),
    "force_zero": (Name.FORCE_OFFSET, Name.FORCE_DRIFT),
    "length_scale": (Name.LENGTH_GAIN,),
    "timing": (Name.TIME_SHIFT, Name.TRANSDUCER_LAG),
}
FAMILY: Mapping[Name, str] = MappingProxyType(
    {name: family for family, members in _FAMILIES.items() for name in members}
)
"""Family of every name."""
MECHANISMS: tuple[Name, ...] = tuple(Name)[: tuple(Name).index(Name.PCA_SHIFT)]
"""Names that are physics."""
MEASUREMENT: tuple[Name, ...] = tuple(Name)[len(MECHANISMS) :]
"""Names that are faults of the measurement: the rows of `measurement.artefacts.ARTEFACTS`."""
