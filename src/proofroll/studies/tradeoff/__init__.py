"""Speed against accuracy: curves of error against cost, error budgets, fronts and recommendations."""
