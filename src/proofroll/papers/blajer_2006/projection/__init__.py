"""A ball on a surface in the projection method."""
