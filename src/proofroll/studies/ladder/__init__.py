"""Ladder of models: a quantity by ever fuller models, and with each optional term on and off."""
