"""Standing on a platform that moves, with the eighty muscles of MyoLeg."""
