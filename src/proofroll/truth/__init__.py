"""Routes to the truth, for each kind of element two that share nothing."""
