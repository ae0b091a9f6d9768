"""Muscles of any MuJoCo model as cross-bridge fibres."""
