"""A two-stage Rosenbrock method of order 2, L-stable, for which any matrix will do in place of the Jacobian.

Verwer, Spee, Blom and Hundsdorfer, A second-order Rosenbrock method applied to photochemical dispersion problems, SIAM
J. Sci. Comput. 20 (1999) 1456-1480:
(I - g h A) K1 = f(y),  (I - g h A) K2 = f(y + h K1) - 2 K1,  y_new = y + h (3 K1 + K2)/2, with an error of order 1 in
y + h K1. Because A need not be exact, hundreds of strain bins cost no more than their own detachment rates on its
diagonal.
"""

from __future__ import annotations

import math

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)
ORDER = 2
# The embedded error is of order 1 and far above the error of the step itself: counted in full it would cut steps of
# 1 ms to a few µs. A fifth of it keeps forces within 0.03 % F0 at the fixed stepper's guard.
ERROR_SHARE = 0.2
