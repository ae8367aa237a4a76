"""Throughput of engines against accuracy: many copies of a scene, each held against its own truth."""
