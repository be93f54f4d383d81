"""What a model does: steady harmonics, motion in time, static deflection, stability and whirl."""
