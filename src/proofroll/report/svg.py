"""SVG pictures as elements of a page."""

from __future__ import annotations

import re


def element(text: str, prefix: str) -> str:
    """A picture from matplotlib as an element: its ids begin with ``prefix``, and no style of it reaches the page."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<(metadata|style)\b.*?</\1>", "", text, flags=re.DOTALL)
    start, _, rest = text.partition(">")
    start = re.sub(r' (?:xmlns(?::\w+)?|version|width|height)="[^"]*"', "", start)
    text = f'{start} aria-hidden="true">{rest}'  # whoever shows it says in words what is on it
    # Only ids that something refers to: equal images would share theirs.
    text = re.sub(r' id="([^"]*)"', lambda found: f' id="{prefix}{found[1]}"' if f"#{found[1]}" in text else "", text)
    text = re.sub(r'href="#', f'href="#{prefix}', text)
    return re.sub(r"url\(#", f"url(#{prefix}", text)
