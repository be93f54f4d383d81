"""Several runs of one machine: joint fit, comparison of two states, balancing."""
