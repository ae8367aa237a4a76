"""Random scenes held against the truth: surprises of an engine, by kind."""
