"""Route 1 of the truth: joint coordinates, all contacts at once; equations are those of elements/mechanism/dynamics."""
