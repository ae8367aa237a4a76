"""Studies of a ball on a surface: its first slip, maps of its regimes, and their pages."""
