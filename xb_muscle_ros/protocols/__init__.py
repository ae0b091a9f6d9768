"""Protocols of a muscle laboratory: what is done to a fibre, and what is read off its answer."""
