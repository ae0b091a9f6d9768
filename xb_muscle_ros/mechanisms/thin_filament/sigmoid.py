"""Thin filament without cooperativity: a sigmoid of calcium, reached with a short lag."""

from xb_muscle_ros.mechanisms import Expr, Parameter, Quantities, ThinFilament, Values
from xb_muscle_ros.mechanisms.thin_filament.cooperative import N_ON

KAPPA = Parameter("kappa", "µM", "free calcium that makes half of the sites available", 1e-3, 1e3, None, "as released")
HILL_N = Parameter("n", "1", "steepness of the calcium sigmoid", 0.1, 50.0, None, "van der Zee et al. 2026")
LAG = Parameter("tau_act", "s", "lag of thin-filament activation behind calcium", 1e-4, 1.0, 0.005, "as released")


class SigmoidThinFilament(ThinFilament):
    """N follows Ca^n/(kappa^n + Ca^n) with a lag of 5 ms."""

    name = "sigmoid"
    parameters = (KAPPA, HILL_N, LAG)
    states = (N_ON,)

    def available_sites(self, q: Quantities) -> Expr:
        """N itself is the state."""
        return q.n_on

    def derivatives(self, q: Quantities) -> Values:
        # The quotient form would overflow for a large n at high calcium; this one cannot.
        target = 1 / (1 + (q.kappa / q.calcium) ** q.n)
        return {"n_on": (target - q.n_on) / q.tau_act}
