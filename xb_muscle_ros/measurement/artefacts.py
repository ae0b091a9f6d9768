"""The artefacts a measurement may have, as one table: name, size to expect, and what shares one value.

What real sets show of the ordinary ones (how, and by which script: docs/evidence.md, Ordinary measurement error):

- ``pca_shift``: what a Hill curve leaves of isometric force at 3 to 7 pCa in eight rat soleus fibres is worth an SD of
  0.045, and fits of `3state_coop` to six recordings find one of 0.05; 0.11 at most.
- ``length_gain``: a stretch of 3.83 % L0 is recorded as 3.59 to 3.67 %, one of 6.4 % as 6.3 to 6.5 %, one of 9 mm as
  9.1; within a set to 1 %. Fits tell it to 5 %: that L0 is known to 1 or 2 % is what the prior is for.
- ``run_down``: 0.2 to 0.3 % for each trial of the experiment in cat soleus, none in rat gastrocnemius; up to 0.8 % from
  bag to bag where trials in between are not there.
- ``force_offset``: resting force at one length, from trial to trial, SD 0.5 % F0 in cat soleus, 0.03 to 0.18 % in rat
  gastrocnemius; isometric force of one solution 0.01 to 0.7 %; fits of rat soleus 0.5 %.
- ``time_shift``: fits find -1.1 ms where length was recorded beside force. Where it was not (`rat_soleus_fibres`, good
  to 2 ms), -2.4 to -3.9 ms: give such sets more room.
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple


class Scope(enum.Enum):
    """What shares one value of an artefact."""

    TRIAL = "trial"
    SOLUTION = "solution"
    STUDY = "study"


class Artefact(NamedTuple):
    """One row of the table.

    Attributes:
        name: fixed; the same in fits, diagnoses and reports.
        unit: of its value.
        meaning: what it does to the recording, in a line.
        scope: what shares one value.
        sd: standard deviation to expect: the prior of a fit, normal around 0.
        lower, upper: beyond these it is no artefact but another experiment.
        on_input: it changes what the fibre was given (length, calcium), so that the model has to run again.
    """

    name: str
    unit: str
    meaning: str
    scope: Scope
    sd: float
    lower: float
    upper: float
    on_input: bool


_ROWS = (
    Artefact(
        "pca_shift", "1", "true pCa minus stated pCa of a bathing solution", Scope.SOLUTION, 0.05, -0.5, 0.5, True
    ),
    Artefact("length_gain", "1", "true over recorded length change, minus 1", Scope.STUDY, 0.02, -0.3, 0.3, True),
    Artefact(
        "run_down", "1", "share of its force that is lost from trial to trial", Scope.STUDY, 0.005, -0.2, 0.2, False
    ),
    Artefact("force_offset", "F0", "recorded force at no force", Scope.TRIAL, 0.005, -0.2, 0.2, False),
    Artefact("force_drift", "F0/s", "rise of recorded force at constant force", Scope.TRIAL, 0.002, -0.1, 0.1, False),
    Artefact(
        "time_shift", "s", "by how much force is recorded later than length", Scope.STUDY, 7e-4, -0.01, 0.01, False
    ),
    Artefact("transducer_lag", "s", "time constant of the force transducer", Scope.STUDY, 5e-4, 0.0, 0.02, False),
)  # fmt: skip

ARTEFACTS: Mapping[str, Artefact] = MappingProxyType({row.name: row for row in _ROWS})
"""All measurement artefacts by name."""

ORDINARY: tuple[str, ...] = ("pca_shift", "length_gain", "run_down", "force_offset", "time_shift")
"""Those that every real set has a little of, in the order of the table: part of every model unless asked otherwise."""
