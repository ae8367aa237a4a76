"""A ball that rolls or slips on a surface."""
