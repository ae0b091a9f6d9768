"""Blinded benchmark of diagnoses: cases with a concealed effect made, diagnosed and scored."""
