"""A body for the muscle to move: small MuJoCo scenes and the loop that couples them with a fibre model."""
