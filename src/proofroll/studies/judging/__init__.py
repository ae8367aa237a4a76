"""Judgement of one trajectory: it is read, compared with the truth, and described."""
