"""Text of engines and files without what would control a terminal."""

import re

# Control characters but line feed, and Unicode characters that reverse or end a line.
_COMMANDS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


def printable(text: str) -> str:
    """Text without characters that control a terminal."""
    return _COMMANDS.sub("", text)


def escaped(text: str) -> str:
    """JSON with control characters as escapes, so that nothing is lost."""
    return _COMMANDS.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


# Signs in encodings that lack them.
_SPELLED = {
    "✓": "ok", "○": "o", "◐": "part", "↘": "~", "✗": "!!", "⊘": "refused", "□": "?", "◇": "other", "·": ".",
    "≥": "at least", "≈": "about", "×": "x", "–": "-", "±": "+-", "µ": "u", "…": "...", "→": "->", "Δ": "d",
}  # fmt: skip


def spelled_out(error: UnicodeError) -> tuple[str, int]:
    """Handler of encoding errors (:func:`codecs.register_error`): letters for a sign; ``?`` for other characters."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_SPELLED.get(sign, "?") for sign in error.object[error.start : error.end]), error.end
