"""Residuals against noise: whether, where and when something is missing, and the law of what remains."""
