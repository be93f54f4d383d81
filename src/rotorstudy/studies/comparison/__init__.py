"""Every spectrum method with every estimator on every rotor, under noise and with the faults of real records.

`config` defines what is compared, `trials` simulates records and evaluates them by a spectrum method, `estimates`
passes its harmonics and their stated covariance to every estimator, `ranking` recommends pairs of both.
"""
