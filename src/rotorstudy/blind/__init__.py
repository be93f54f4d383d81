"""Blind tests: effects are hidden in simulated measurements, diagnosed without the truth, and compared with it.

`machines` simulates and shares nothing with what is tested; only `run` calls the diagnosis, which imports nothing here.
"""
