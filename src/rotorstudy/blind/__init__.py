"""Blind tests: effects are hidden in simulated measurements, diagnosed without the truth, and compared with it.

`machines` simulates, and shares nothing with what is tested. `injection` draws the cases of a test from it and writes
their records; `sealing` publishes the hash of the truth before the diagnosis, `scoring` compares, `criteria` judges,
`summary` collects the results in a Dataset, `run` executes the test. Only `run` calls the diagnosis, which imports
nothing from here.
"""
