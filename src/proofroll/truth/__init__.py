"""The truth of a scene, by two independent routes that must agree; their difference is its error bar."""

from proofroll.truth.truth import truth

__all__ = ["truth"]
