"""Blajer's sphere that rolls inside a vertical cylinder (2006): figures, statements, first slips, maps of regimes."""
