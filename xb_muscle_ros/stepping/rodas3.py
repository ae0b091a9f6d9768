"""RODAS3: a stiffly accurate, L-stable Rosenbrock method of order 3 with an embedded one of order 2.

Coefficients from Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II: Rosenbrock
solvers, Atmospheric Environment 31 (1997) 3459-3472, in the form that needs no products with the Jacobian:
(1/(h gamma) I - J) K_i = f(y + sum A_ij K_j) + (1/h) sum C_ij K_j,  y_new = y + sum M_j K_j,  error = sum E_j K_j.

L-stable, because a fibre at pCa 4.5 switches its thin filament on at up to 1e5 1/s and a control loop steps at 1 ms;
one step costs three right-hand sides, one Jacobian and one small decomposition, whatever the stiffness.
"""

from __future__ import annotations

GAMMA = 0.5
A = ((), (0.0,), (2.0, 0.0), (2.0, 0.0, 1.0))
C = ((), (4.0,), (1.0, -1.0), (1.0, -1.0, -8.0 / 3.0))
M = (2.0, 0.0, 1.0, 1.0)
E = (0.0, 0.0, 0.0, 1.0)
ORDER = 3
"""Order of the method; the embedded one is one lower."""
