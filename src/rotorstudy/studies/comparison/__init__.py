"""Every spectrum method with every estimator on every rotor, under noise and with the faults of real records.

`config` says what is compared, `trials` makes records and shows them to a spectrum method trial by trial, `estimates`
gives its harmonics, with the covariance it states, to every estimator, `ranking` says which pair to use for what.
"""
