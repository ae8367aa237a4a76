"""Words of scenes and comparisons: tables of their keys, for a page and for the terminal."""
