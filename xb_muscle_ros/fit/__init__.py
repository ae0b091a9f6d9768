"""A fibre's parameters from its recordings, and how well they are known."""
