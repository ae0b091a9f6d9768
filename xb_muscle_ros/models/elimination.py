"""Gaussian elimination written out for one sparsity pattern: only the products that are not zero, no loops."""

from __future__ import annotations

from collections.abc import Sequence


class Elimination:
    """LU decomposition without pivoting of a matrix known by its pattern, as lines of code.

    A Rosenbrock matrix 1/(h gamma) - J has a dominant diagonal at every step size that its error control accepts, so
    pivoting is not needed; the order of elimination is the one that fills in least (Markowitz, on the diagonal).
    """

    def __init__(self, pattern: Sequence[Sequence[bool]]) -> None:
        self.size = len(pattern)
        self._filled = [[bool(x) or i == j for j, x in enumerate(row)] for i, row in enumerate(pattern)]
        self.order: list[int] = []
        self._lower: dict[int, list[int]] = {}
        self._upper: dict[int, list[int]] = {}
        left = set(range(self.size))
        while left:
            k = min(left, key=lambda i: (self._cost(i, left), i))
            left.remove(k)
            self.order.append(k)
            self._lower[k] = [i for i in sorted(left) if self._filled[i][k]]
            self._upper[k] = [j for j in sorted(left) if self._filled[k][j]]
            for i in self._lower[k]:
                for j in self._upper[k]:
                    self._filled[i][j] = True

    def _cost(self, k: int, left: set[int]) -> int:
        column = sum(self._filled[i][k] for i in left if i != k)
        row = sum(self._filled[k][j] for j in left if j != k)
        return column * row

    def entries(self) -> list[tuple[int, int]]:
        """Places of the matrix that are used, fill-in included."""
        return [(i, j) for i in range(self.size) for j in range(self.size) if self._filled[i][j]]

    def factor(self, a: str) -> list[str]:
        """Lines that turn the variables a_i_j into factors, with 1/pivot in a_k_k."""
        lines = []
        for k in self.order:
            lines.append(f"{a}_{k}_{k} = 1.0 / {a}_{k}_{k}")
            for i in self._lower[k]:
                lines.append(f"{a}_{i}_{k} = {a}_{i}_{k} * {a}_{k}_{k}")
                lines += [f"{a}_{i}_{j} = {a}_{i}_{j} - {a}_{i}_{k} * {a}_{k}_{j}" for j in self._upper[k]]
        return lines

    def solve(self, a: str, x: str) -> list[str]:
        """Lines that turn the right-hand side x_i into the solution."""
        lines = []
        for k in self.order:
            lines += [f"{x}_{i} = {x}_{i} - {a}_{i}_{k} * {x}_{k}" for i in self._lower[k]]
        for k in reversed(self.order):
            terms = "".join(f" - {a}_{k}_{j} * {x}_{j}" for j in self._upper[k])
            lines.append(f"{x}_{k} = ({x}_{k}{terms}) * {a}_{k}_{k}")
        return lines
