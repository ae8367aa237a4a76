"""A ball on a surface in Exudyn."""
