"""Names of what a diagnosis may answer, known without any model: the blind benchmark draws its effects from them.

Mechanisms name themselves, with their family, beside their equations; those of the benchmark stand here once more, in
the order in which a diagnosis lists them, so that its generator has them without importing a model. A mechanism that
is not among them comes after these: see `answers`. The families were laid down before any concealed data were
diagnosed: members act on the same thing in nearly the same way, so that naming the family is worth something even
where the member cannot be told.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar


class Name(str):
    """Name of a mechanism or of a measurement artefact: a text, the same object wherever it is the same text."""

    __slots__ = ()
    _made: ClassVar[dict[str, Name]] = {}

    def __new__(cls, text: str) -> Name:
        """The one name of a text."""
        return cls._made.setdefault(text, super().__new__(cls, text))

    VISCOUS_DRAG: ClassVar[Name]
    PASSIVE_VISCOELASTICITY: ClassVar[Name]
    WEAKLY_BOUND_HEADS: ClassVar[Name]
    FILAMENT_FRICTION: ClassVar[Name]
    ACTIVE_TITIN: ClassVar[Name]
    STATIC_CALCIUM_STIFFNESS: ClassVar[Name]
    LENGTH_DEPENDENT_ACTIVATION: ClassVar[Name]
    LATTICE_SPACING: ClassVar[Name]
    FILAMENT_OVERLAP: ClassVar[Name]
    STRAIN_RECRUITED_HEADS: ClassVar[Name]
    PERSISTENT_THICK_FILAMENT: ClassVar[Name]
    FORCIBLE_DETACHMENT: ClassVar[Name]
    NONLINEAR_CROSSBRIDGE: ClassVar[Name]
    HALF_SARCOMERE_SPREAD: ClassVar[Name]
    SERIES_COMPLIANCE: ClassVar[Name]
    THIN_FILAMENT_COOPERATIVITY: ClassVar[Name]
    THICK_FILAMENT_COOPERATIVITY: ClassVar[Name]
    TEMPERATURE: ClassVar[Name]
    PHOSPHATE: ClassVar[Name]
    PCA_SHIFT: ClassVar[Name]
    RUN_DOWN: ClassVar[Name]
    FORCE_OFFSET: ClassVar[Name]
    FORCE_DRIFT: ClassVar[Name]
    LENGTH_GAIN: ClassVar[Name]
    TIME_SHIFT: ClassVar[Name]
    TRANSDUCER_LAG: ClassVar[Name]


for _attribute in Name.__annotations__:
    if _attribute.isupper():
        setattr(Name, _attribute, Name(_attribute.lower()))
_ALL = tuple(Name._made.values())
MECHANISMS: tuple[Name, ...] = _ALL[: _ALL.index(Name.PCA_SHIFT)]
"""Names that are physics."""
MEASUREMENT: tuple[Name, ...] = _ALL[len(MECHANISMS) :]
"""Names that are measurement artefacts: the rows of `measurement.artefacts.ARTEFACTS`."""
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
FAMILY: Mapping[str, str] = MappingProxyType(
    {name: family for family, members in _FAMILIES.items() for name in members}
)
"""Family of every name."""
