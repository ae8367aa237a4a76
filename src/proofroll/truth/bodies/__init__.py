"""Route 2 of the truth: separate bodies, constraint rows, modes by trial."""
