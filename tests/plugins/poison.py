"""Content as somebody malicious would write it: markup, handlers and templates in every string and in every name."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass, replace
from enum import Enum
from typing import Any

from proofroll.core.verdict import Verdict
from proofroll.running.case import Status

# What the code of the report itself says or compares with; nobody else can write these.
OUR_WORDS = frozenset({*Verdict, *Status, "well-posed", "agree", "disagree", "model form", "time step"})


@dataclass
class Poison:
    """Poisons each string in its own way, equal strings alike, and remembers how.

    Attributes:
        doses: what was given to which string.
        said: the strings that describe something; the others are names of entries only.
    """

    doses: dict[str, str] = field(default_factory=dict)
    said: set[str] = field(default_factory=set)

    def dose(self, text: str) -> str:
        """A string with its poison: whatever runs tells which string it was, and so do elements made of it."""
        number = self.doses.setdefault(text, str(len(self.doses)))
        did = f"(window.poisoned ??= []).push({number})"
        return (
            f"{text}</script></style></title></textarea><script>{did}</script><img src=x onerror='{did}'>"
            f'<b class=poison onclick={did}>&amp;&lt;%{{y}}{{{{7*7}}}}" onfocus="{did}" autofocus=\'#{number}'
        )

    def content(self, value: Any, *, names: bool = True) -> Any:
        """Data with poison in every string that is not a word of our own, and under poisoned names besides.

        Where the page knows the names of an entry, those it does not know change nothing; where it lists whatever
        names there are, it lists the poisoned ones too.

        Args:
            value: records, or what :mod:`json` can write.
            names: also the names of entries.
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
