"""Closed lists of texts, as kinds of events and of joints."""

from __future__ import annotations

from enum import StrEnum


class Kind(StrEnum):
    """A text of a closed list; it equals the plain text, and programs, JSON and messages show it as that."""

    def __repr__(self) -> str:
        return repr(self.value)
