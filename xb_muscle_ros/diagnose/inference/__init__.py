"""What fits of many sets say together: evidence, inclusion probabilities, held-out gains."""
