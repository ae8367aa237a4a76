"""Robot files: safe reading, their meaning, and the tables of a scene that they give."""
