"""Noise of a study's recordings: where it shows, what is known of it, and draws."""
