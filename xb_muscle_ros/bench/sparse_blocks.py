"""Large sparse optimisation problems from one small form at many samples, with all derivatives, in CasADi's symbols."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


class Triplets(NamedTuple):
    """Entries of a sparse matrix; those of one place add up.

    Attributes:
        rows, columns: shape (n,).
        values: n symbols.
    """

    rows: Indices
    columns: Indices
    values: Any


class Block:
    """Constraints and a difference between force and data of one form, at many samples.

    Attributes:
        count: number of samples.
    """

    def __init__(
        self,
        unknowns: Any,
        inputs: Any,
        constraints: Any,
        difference: Any,
        where: Indices,
        rows: Indices,
        values: Array,
    ) -> None:
        """Differentiate the form.

        Args:
            unknowns, inputs, constraints, difference: symbols of one sample.
            where: of the unknowns among all, shape (unknowns, samples), ascending for each sample.
            rows: of the constraints among all, shape (constraints, samples).
            values: of the inputs, shape (inputs, samples).
        """
        self.count = where.shape[1]
        self._where, self._rows, self._values = where, rows, ca.DM(values)
        weight, multipliers = ca.SX.sym("weight"), ca.SX.sym("multipliers", constraints.numel())
        cost = difference**2
        slopes = ca.jacobian(constraints, unknowns)
        curvature = ca.triu(ca.hessian(weight * cost + ca.dot(multipliers, constraints), unknowns)[0])
        self._slopes_at, self._curvature_at = _places(slopes), _places(curvature)
        given = [unknowns, inputs]

        def mapped(given: list[Any], wanted: Any) -> Any:
            return ca.Function("form", given, wanted).map(self.count)

        self._forward = mapped(given, [constraints, cost, ca.gradient(cost, unknowns)])
        self._slopes = mapped(given, [_entries(slopes)])
        self._curvature = mapped([*given, weight, multipliers], [_entries(curvature)])

    def forward(self, x: Any) -> tuple[Triplets, Any, Triplets]:
        """Constraints, sum of squared differences, and its gradient."""
        constraints, cost, gradient = self._forward(self._own(x), self._values)
        return _column(self._rows, constraints), ca.sum2(cost), _column(self._where, gradient)

    def slopes(self, x: Any) -> Triplets:
        """Derivatives of the constraints."""
        row, column = self._slopes_at
        values = ca.vec(self._slopes(self._own(x), self._values))
        return Triplets(_flat(self._rows[row]), _flat(self._where[column]), values)

    def curvature(self, x: Any, weight: Any, multipliers: Any) -> Triplets:
        """Second derivatives of the Lagrangian, upper triangle."""
        row, column = self._curvature_at
        own = ca.reshape(multipliers[_flat(self._rows).tolist()], *self._rows.shape)
        values = self._curvature(self._own(x), self._values, ca.repmat(weight, 1, self.count), own)
        return Triplets(_flat(self._where[row]), _flat(self._where[column]), ca.vec(values))

    def _own(self, x: Any) -> Any:
        return ca.reshape(x[_flat(self._where).tolist()], *self._where.shape)


def _flat(indices: Indices) -> Indices:
    """Sample by sample, as CasADi stacks columns."""
    return indices.ravel(order="F")


def _column(rows: Indices, values: Any) -> Triplets:
    flat = _flat(rows)
    return Triplets(flat, np.zeros_like(flat), ca.vec(values))


def _places(matrix: Any) -> tuple[Indices, Indices]:
    """Rows and columns of a sparse matrix's entries."""
    sparsity = matrix.sparsity()
    return np.array(sparsity.row(), dtype=np.int64), np.array(sparsity.get_col(), dtype=np.int64)


def _entries(matrix: Any) -> Any:
    """A sparse matrix's entries as a column."""
    return ca.vertcat(*matrix.nonzeros())


def matrix(shape: tuple[int, int], parts: Sequence[Triplets]) -> Any:
    """A sparse matrix from triplets."""
    rows = np.concatenate([p.rows for p in parts])
    columns = np.concatenate([p.columns for p in parts])
    places, into = np.unique(columns * shape[0] + rows, return_inverse=True)
    starts = np.searchsorted(places // shape[0], np.arange(shape[1] + 1))
    pattern = ca.Sparsity(*shape, starts.tolist(), (places % shape[0]).tolist())
    adding = ca.Sparsity(places.size, rows.size, list(range(rows.size + 1)), into.tolist())
    return ca.MX(pattern, ca.mtimes(ca.DM(adding, 1.0), ca.vertcat(*(p.values for p in parts))))


def ipopt(blocks: Sequence[Block], unknowns: int, constraints: int, exact: bool, options: dict[str, Any]) -> Any:
    """A solver for the sum of the blocks' costs under their constraints.

    Args:
        blocks: together they hold every constraint.
        unknowns, constraints: how many there are.
        exact: hand over second derivatives as well.
        options: of CasADi and IPOPT.
    """
    x, none = ca.MX.sym("x", unknowns), ca.MX.sym("p", 0, 1)
    weight, multipliers = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", constraints)
    values, costs, gradients = zip(*(b.forward(x) for b in blocks), strict=True)
    cost, g = sum(costs), ca.densify(matrix((constraints, 1), values))
    gradient = ca.densify(matrix((unknowns, 1), gradients))
    slopes = matrix((constraints, unknowns), [b.slopes(x) for b in blocks])
    names = ["x", "p"]
    given: dict[str, Any] = {
        "grad_f": ca.Function("nlp_grad_f", [x, none], [cost, gradient], names, ["f", "grad_f_x"]),
        "jac_g": ca.Function("nlp_jac_g", [x, none], [g, slopes], names, ["g", "jac_g_x"]),
    }
    if exact:
        curvature = matrix((unknowns, unknowns), [b.curvature(x, weight, multipliers) for b in blocks])
        known, names = [x, none, weight, multipliers], [*names, "lam_f", "lam_g"]
        given["hess_lag"] = ca.Function("nlp_hess_l", known, [curvature], names, ["triu_hess_gamma_x_x"])
    else:
        given["ipopt.hessian_approximation"] = "limited-memory"
    return ca.nlpsol("solver", "ipopt", {"x": x, "p": none, "f": cost, "g": g}, {**options, **given})
