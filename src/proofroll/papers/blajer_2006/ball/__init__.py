"""A ball in an upright cylinder: the element of one that rolls evenly, and its mechanics."""
