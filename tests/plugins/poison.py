"""Malicious content for a report: markup, handlers and templates in every string and in every name."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum
from typing import Any

from proofroll.core.verdict import Verdict
from proofroll.running.case import Status

# Strings that only our own code writes, and compares with.
OUR_WORDS = frozenset({*Verdict, *Status, "well-posed", "agree", "disagree", "model form", "time step"})


@dataclass
class Poison:
    """Poisons strings, each with its own number, so that a script that runs reveals its string.

    Attributes:
        doses: string -> number of its poison.
        said: strings that are values; other strings of ``doses`` are names of entries only.
    """

    doses: dict[str, str] = field(default_factory=dict)
    said: set[str] = field(default_factory=set)

    def dose(self, text: str) -> str:
        """The string with its poison; scripts that run, and elements that are made, have its number."""
        number = self.doses.setdefault(text, str(len(self.doses)))
        did = f"(window.poisoned ??= []).push({number})"
        return (
            f"{text}</script></style></title></textarea><script>{did}</script><img src=x onerror='{did}'>"
            f'<b class=poison onclick={did}>&amp;&lt;%{{y}}{{{{7*7}}}}" onfocus="{did}" autofocus=\'#{number}'
        )

    def content(self, value: Any, *, names: bool = True) -> Any:
        """Copy of data with poison in every string except our own words; entries are repeated under poisoned names.

        A page that looks up known names ignores the repeated entries; one that lists all names shows them.

        Args:
            value: records, or what :mod:`json` can write.
            names: True to repeat entries under poisoned names.
        """
        if isinstance(value, dict):
            found = {name: self.content(item, names=names) for name, item in value.items()}
            return found | ({self.dose(name): item for name, item in found.items()} if names else {})
        if is_dataclass(value) and not isinstance(value, type):
            told = {item.name: self.content(getattr(value, item.name), names=names) for item in fields(value)}
            return replace(value, **told)
        if isinstance(value, (list, tuple)):
            return [self.content(item, names=names) for item in value]
        if isinstance(value, str) and not isinstance(value, Enum) and value not in OUR_WORDS:
            self.said.add(value)
            return self.dose(value)
        return value
