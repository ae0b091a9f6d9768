"""What a simulation left out: where a recording differs from it, which mechanism says why, and how sure that is."""
