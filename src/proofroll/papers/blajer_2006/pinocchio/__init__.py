"""A ball on a surface in Pinocchio."""
