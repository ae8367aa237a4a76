"""Studies: each answers one question with the same cases, store and verdicts."""
