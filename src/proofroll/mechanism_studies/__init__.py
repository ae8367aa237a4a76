"""Studies of mechanisms that no harness knows: equilibrium, and linearisation about it."""
