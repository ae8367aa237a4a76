"""A ball on a surface in MuJoCo."""
