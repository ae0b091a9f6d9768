"""Concealed truths: fibres, effects and measurements made without any of the models that a diagnosis uses."""
