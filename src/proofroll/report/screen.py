"""What goes to a terminal: text of engines and files must not command it."""

from __future__ import annotations

import re
from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

# Control characters but line feed, which is layout, and what reverses or ends a line in Unicode.
_COMMANDS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


def printable(text: str) -> str:
    """The text without characters that a terminal obeys instead of showing them."""
    return _COMMANDS.sub("", text)


def escaped(text: str) -> str:
    """JSON with such characters written as numbers, so that nothing is lost."""
    return _COMMANDS.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


class Screen(Console):
    """A console on which nothing but its own styles reaches the terminal as a command."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """See :class:`rich.console.Console`."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)
