"""Bodies, joints, loops and springs."""
