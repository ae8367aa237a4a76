"""Judgement of one trajectory: read, held against the truth, put into words."""
