"""Ladder of models as records, sentences and tables."""
