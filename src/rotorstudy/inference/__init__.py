"""From a spectrum to parameters: one fit with its covariance, linear estimators, bounds, identifiability."""
