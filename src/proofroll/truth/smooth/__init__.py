"""Truths of motions that nothing switches: routes, closed forms, works, singular poses."""
