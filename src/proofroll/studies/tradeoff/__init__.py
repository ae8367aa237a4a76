"""Speed against accuracy: curves of error against cost, error budgets, Pareto fronts and recommendations."""
