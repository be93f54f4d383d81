"""Blind tests: effects hidden in simulated measurements, diagnosed without the truth, then compared with it.

`injection` makes the measurement and the truth from a `setting`, by `hiding` and `observation`, with physics of its own
(`machine`; `physics` and `chain`, listed in the table `acts`). `sealing` locks the truth away before anything is
diagnosed, `scoring` compares, `criteria` holds the acceptance criteria, `summary` makes one Dataset of it, `run` does
all of it. Only `run` knows the diagnosis, and the diagnosis knows nothing of this.
"""
