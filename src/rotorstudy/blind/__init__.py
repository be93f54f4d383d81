"""Blind tests: effects are hidden in simulated measurements, diagnosed without the truth, and compared with it.

`setting` draws the machine, `hiding` the effect, `observation` what is measured; `injection` combines them into a case.
The physics is independent of the tables of effects (`machine`, `physics`, `physics_in_time`, `chain`, listed in
`simulated_effects`). `sealing` publishes the hash of the truth before the diagnosis, `scoring` compares, `criteria`
judges, `summary` collects the results in a Dataset, `run` executes the test. Only `run` calls the diagnosis, which
imports nothing from here.
"""
