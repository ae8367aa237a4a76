"""Studies of a ball on a wall: its first slip, and maps of its regimes."""
