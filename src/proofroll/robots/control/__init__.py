"""Robots under controllers: scenes, records from any simulator, and mistakes of bookkeeping in them."""
