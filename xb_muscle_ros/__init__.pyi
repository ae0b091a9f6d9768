"""Types of the public names, see ``__init__.py``."""

from xb_muscle_ros.api.diagnosing import DiagnosisResult as DiagnosisResult
from xb_muscle_ros.api.diagnosing import diagnose as diagnose
from xb_muscle_ros.api.evaluating import EvaluationResult as EvaluationResult
from xb_muscle_ros.api.evaluating import evaluate as evaluate
from xb_muscle_ros.api.exporting import export_trials as export_trials
from xb_muscle_ros.api.fitting import FitResult as FitResult
from xb_muscle_ros.api.fitting import fit as fit
from xb_muscle_ros.api.inputs import read_trials as read_trials
from xb_muscle_ros.api.inputs import write_trials as write_trials
from xb_muscle_ros.api.inspecting import InspectionResult as InspectionResult
from xb_muscle_ros.api.inspecting import inspect as inspect
from xb_muscle_ros.api.making import make_trial as make_trial
from xb_muscle_ros.api.new_fibre import new_fibre as new_fibre
from xb_muscle_ros.api.protocols import ProtocolResult as ProtocolResult
from xb_muscle_ros.api.protocols import analyse_protocol as analyse_protocol
from xb_muscle_ros.api.protocols import run_protocol as run_protocol
from xb_muscle_ros.api.replaying import ReplayResult as ReplayResult
from xb_muscle_ros.api.replaying import replay as replay
from xb_muscle_ros.api.simulating import SimulationResult as SimulationResult
from xb_muscle_ros.api.simulating import simulate as simulate
from xb_muscle_ros.errors import DataWarning as DataWarning
from xb_muscle_ros.errors import StateViolation as StateViolation
from xb_muscle_ros.errors import UserError as UserError
from xb_muscle_ros.models.batch import MuscleBatch as MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre as Fibre
from xb_muscle_ros.models.fibre_file import changed as changed
from xb_muscle_ros.models.fibre_file import load_fibre as load_fibre
from xb_muscle_ros.models.fibre_writing import write_fibre as write_fibre
from xb_muscle_ros.models.muscle import Muscle as Muscle
from xb_muscle_ros.models.muscle import Outputs as Outputs
from xb_muscle_ros.plant.mjcf.muscles import CrossBridgeMuscles as CrossBridgeMuscles
from xb_muscle_ros.trials.protocol import StretchShortenStretch as StretchShortenStretch
from xb_muscle_ros.trials.simulated import Simulated as Simulated
from xb_muscle_ros.trials.trial import Phase as Phase
from xb_muscle_ros.trials.trial import Trial as Trial
from xb_muscle_ros.trials.trial import TrialFacts as TrialFacts

__version__: str
__all__: list[str]
