"""The answer to a tolerance in a scene: the cheapest setting of each engine that holds it, found by a search."""
