"""Replay of motions: records packed for the page, and the library that draws them."""
