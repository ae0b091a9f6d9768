"""The public functions and their results; ``import xb_muscle_ros as xb`` shows them."""
