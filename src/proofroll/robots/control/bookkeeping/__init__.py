"""Bookkeeping of a controller: its law with the conventions that go wrong, known mistakes, and motion in the air."""
