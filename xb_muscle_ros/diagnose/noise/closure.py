"""The Gaussian form's own error: what closing the moments leaves out of the distribution's force.

It is 0.3 to 0.6 % F0 where the paper's fibres are stretched, as much as a mechanism's effect may be. It is no physics,
so it is taken out before anything is looked for: the difference of both forms at the base's fitted point is added to
the Gaussian form's forces in every fit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.diagnose.search.whole import only
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.distribution.grid import Characteristics
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.methods import difference
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.models.composition import Composition
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.parameters import complete
from xb_muscle_ros.models.registry import compose, model_of_set
from xb_muscle_ros.trials.trial import Array

# Less than this is rounding, F0.
_LEAST_F0 = 1e-6


def by_distribution(fibre: Fibre) -> Fibre:
    """The fibre with its heads' strain as a distribution, nothing assumed of its shape."""
    values = complete(fibre.values, model_of_set(fibre.model), f"fibre {fibre.name}", Characteristics.name)
    return replace(fibre, method=Characteristics.name, values=MappingProxyType(values))


def has_closure(fibre: Fibre) -> bool:
    """Whether a fibre's model goes by the Gaussian form, and has heads whose distribution that form closes."""
    return fibre.method == Gaussian.name and isinstance(compose(fibre.model, fibre.method), Composition)


def closure_error(problem: Problem, given: Fibre) -> Mapping[str, Array]:
    """Force by the distribution less that of the Gaussian form at a problem's start, F0 at every trial's samples.

    Empty where the fibre's own method is a distribution already, where there are no heads, or where the distribution
    has no solution.

    Args:
        problem: of the base, in the whole model.
        given: the fibre as it was given, without what the whole model has besides.
    """
    if not has_closure(given):
        return {}
    try:
        bare = replace(
            problem, fibre=by_distribution(only(problem.fibre_at(problem.start), given, ())), correction=None
        )
        found = difference(bare, problem.start).force
    except UserError:
        return {}
    # Without a head on its strain, as with cross-bridges off, there is nothing to take out.
    return found if any(np.any(np.abs(values) > _LEAST_F0) for values in found.values()) else {}
