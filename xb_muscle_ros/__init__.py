"""Cross-bridge muscle for robots and physiologists: fibre length and calcium in, force out.

``import xb_muscle_ros as xb`` gives the public names; each is loaded when it is first used. ``__init__.pyi`` tells
editors and type checkers what they are.
"""

import sys
from importlib import import_module
from types import ModuleType

__version__ = "0.2.0"

_HOMES = {
    "api.diagnosing": ("DiagnosisResult", "diagnose"),
    "api.evaluating": ("EvaluationResult", "evaluate"),
    "api.exporting": ("export_trials",),
    "api.fitting": ("FitResult", "fit"),
    "api.inputs": ("read_trials", "write_trials"),
    "api.inspecting": ("InspectionResult", "inspect"),
    "api.making": ("make_trial",),
    "api.new_fibre": ("new_fibre",),
    "api.protocols": ("ProtocolResult", "analyse_protocol", "run_protocol"),
    "api.replaying": ("ReplayResult", "replay"),
    "api.simulating": ("SimulationResult", "simulate"),
    "errors": ("DataWarning", "StateViolation", "UserError"),
    "models.batch": ("MuscleBatch",),
    "models.fibre_file": ("Fibre", "changed", "load_fibre"),
    "models.fibre_writing": ("write_fibre",),
    "models.muscle": ("Muscle", "Outputs"),
    "plant.mjcf.muscles": ("CrossBridgeMuscles",),
    "trials.protocol": ("StretchShortenStretch",),
    "trials.simulated": ("Simulated",),
    "trials.trial": ("Phase", "Trial", "TrialFacts"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
__all__ = ["__version__", *sorted(_HOME_OF)]


class _Package(ModuleType):
    """Keeps a public function (`fit`) where the folder of its name is imported: that would take its place."""

    def __setattr__(self, name: str, value: object) -> None:
        if name not in _HOME_OF or not isinstance(value, ModuleType):
            super().__setattr__(name, value)

    def __getattr__(self, name: str) -> object:
        if name not in _HOME_OF:
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'; public are {', '.join(__all__)}")
        value: object = getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)
        setattr(self, name, value)
        return value

    def __dir__(self) -> list[str]:
        return sorted({*vars(self), *__all__})


sys.modules[__name__].__class__ = _Package
