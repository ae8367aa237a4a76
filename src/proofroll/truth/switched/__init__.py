"""Truths of motions that contacts, friction, stops, limits or kinks switch."""
