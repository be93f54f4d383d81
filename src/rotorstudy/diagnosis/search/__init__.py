"""The search: hypotheses, their fits and posterior odds, and the best set of causes."""
