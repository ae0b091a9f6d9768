"""Places of a fibre's constants and choices in the vector that the stepping loop takes."""

from __future__ import annotations

import enum


class At(enum.IntEnum):
    """Places of constants. Strains and lengths in power strokes, rates in 1/s, forces in cross-bridge force (F0/2)."""

    F = 0
    W = 1
    K11 = 2
    K12 = 3
    K21 = 4
    K22 = 5
    KON = 6
    KOFF = 7
    KOOP = 8
    KAPPA = 9
    N = 10
    TAU_ACT = 11
    AFFINITY = 12
    """Cooperativity of the sigmoid thin filament: decades by which bound heads raise its affinity for calcium."""
    J1 = 13
    J2 = 14
    JF = 15
    J_SATURATION = 16
    """Force at which recruiting by force is half saturated; 0: it never is."""
    KSE = 17
    KSE0 = 18
    SERIES_FORCE = 19
    SERIES_LENGTH = 20
    """Quadratic spring: T = SERIES_FORCE (y + y²), y = l/SERIES_LENGTH."""
    GAMMA = 21
    TEAR_RATE = 22
    TEAR_STRAIN = 23
    TEAR_STEEPNESS = 24
    REBIND_RATE = 25
    HEAD_CURVATURE = 26
    PHOSPHATE_RATE = 27
    LATTICE_SLOPE = 28
    LATTICE_BEST = 29
    OVERLAP_SLOPE = 30
    OVERLAP_EDGE = 31
    WEAK_STIFFNESS = 32
    WEAK_RATE = 33
    WEAK_STRAIN = 34
    WEAK_LAG = 35
    CREEP = 36
    CREEP_TIME = 37
    UNIT_STIFFNESS = 38
    """Of ties that keep half-sarcomeres together: force per power stroke by which one is longer than their mean."""
    THIN = 39
    THICK = 40
    SERIES = 41


class Thin(enum.IntEnum):
    """Thin filament."""

    COOPERATIVE = 0
    SIGMOID = 1


class Thick(enum.IntEnum):
    """Thick filament."""

    ALWAYS_ON = 0
    FORCE_DEPENDENT = 1


class Series(enum.IntEnum):
    """Series spring."""

    EXPONENTIAL = 0
    QUADRATIC = 1
    RIGID = 2
