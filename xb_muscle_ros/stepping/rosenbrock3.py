"""An L-stable Rosenbrock method of order 3 with an embedded one of order 2, on two right-hand sides a step.

In the form that needs no products with the Jacobian (Hairer and Wanner, Solving Ordinary Differential Equations II,
chapter IV.7): (1/(h gamma) I - J) K_i = f(y + sum A_ij K_j) + (1/h) sum C_ij K_j,  y_new = y + sum M_j K_j,
error = sum E_j K_j.

L-stable, because a fibre at pCa 4.5 switches its thin filament on at up to 1e5 1/s and a control loop steps at 1 ms.
The coefficients solve the order conditions given there under three choices. Both later stages look at one
point, the end of the step (alpha_2 = alpha_3 = 1): published three-stage methods that look at 0.44 of it pass the
kinks of slack springs unseen, and Hill's muscle then shot up to 1e8 F0. beta_21 meets one condition of order 4 more.
The embedded method leaves half of an infinitely stiff component, in place of nothing. `test_rosenbrock3` checks all
of it.
"""

from __future__ import annotations

GAMMA = 0.4358665215084589994
A = ((), (2.2942803602790417198,), (2.2942803602790417198, 0.0))
C = ((), (1.4668059931123387376,), (-2.6471401801395208599, -0.9783497673885093511))
M = (2.4119003002325347665, 0.3261165891295031170, 0.7647601200930139066)
E = (-0.1600625169052610294, -0.1102975075058133692, -0.3996866791992635470)
ORDER = 3
"""Order of the method; the embedded one is one lower."""
