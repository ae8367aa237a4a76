"""The least model of a ball that rolls on a surface: a closed form, or five equations without constraints."""

from proofroll.engines.reduced.adapter import Reduced

__all__ = ["Reduced"]
