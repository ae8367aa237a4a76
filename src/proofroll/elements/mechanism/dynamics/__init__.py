"""Motion of a tree: poses, velocities, loads, smooth motion in joint coordinates."""
