"""Blind tests: effects hidden in simulated measurements, diagnosed without the truth, then compared with it.

`injection` makes the measurement and the truth by physics of its own (`machine`, `physics`, `chain`), `sealing` locks
the truth away before anything is diagnosed, `scoring` compares, `criteria` holds the acceptance criteria, `run` does
all of it. Only `run` knows the diagnosis, and the diagnosis knows nothing of this.
"""
