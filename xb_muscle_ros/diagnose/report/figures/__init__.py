"""Figures of a diagnosis, as vector graphics with the captions that belong to them."""
