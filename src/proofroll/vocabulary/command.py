"""Keys of scenes, comparisons and studies on a terminal, for ``check --keys``."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from proofroll.cli import options


@dataclasses.dataclass(frozen=True)
class KeyEntry:
    """A key of a file.

    Attributes:
        chapter: kind of file or scene.
        table: its table, as TOML writes it; empty: the top of the file.
        key: the key; empty for a table that is described in words.
        type: kind of its value.
        default: value without the key, ``required`` or ``none``.
        meaning: of the key, with its unit.
    """

    chapter: str
    table: str
    key: str
    type: str
    default: str
    meaning: str


def show_keys(word: str, as_json: bool) -> None:
    """Prints the entries of a word, or all if it is empty. Raises InputError if there are none."""
    entries = [*all_entries()]
    chosen = entries_about(word, entries) if word else entries
    if as_json:
        options.write_json({"keys": [dataclasses.asdict(entry) for entry in chosen]})
    else:
        options.show_lines(lines_of(chosen))


def all_entries() -> Iterator[KeyEntry]:
    """Every key in the order of the page."""
    from proofroll.vocabulary.document import CHAPTERS, REST, keys, kind_of

    for chapter, tables in CHAPTERS.items():
        plain = chapter.replace("`", "")
        for table in tables:
            kind = kind_of(table)
            header = table.header + (f' with kind = "{kind}"' if kind else "")
            for key, typed, default, text in keys(table):
                yield KeyEntry(
                    chapter=plain,
                    table=header,
                    key=key,
                    type=typed,
                    default=default,
                    meaning=text.replace("`", "").replace("\\|", "|"),
                )
        for section in REST.get(chapter, "").split("### ")[1:]:
            title, _, text = section.partition("\n")
            yield KeyEntry(
                chapter=plain,
                table=title.replace("`", ""),
                key="",
                type="",
                default="",
                meaning=" ".join(text.replace("`", "").split()),
            )


def entries_about(word: str, entries: list[KeyEntry]) -> list[KeyEntry]:
    """Entries of a key or a table of this name; if there are none, those with the word in their meaning or type.

    Raises:
        InputError: no entry has the word.
    """
    from proofroll.core.errors import require_known

    asked = word.strip("[]").lower()
    named = [entry for entry in entries if asked in {entry.key.lower(), *_names(entry.table)}]
    if not named:
        texts = ((entry, f"{entry.meaning} {entry.type} {entry.table}".lower()) for entry in entries)
        named = [entry for entry, text in texts if asked in text]
    if not named:
        names = dict.fromkeys(name for entry in entries for name in (entry.key, *_names(entry.table)) if name)
        require_known("word", word, names, "no key or meaning has it; the keys are")
    return named


def _names(table: str) -> list[str]:
    """Names in the header of a table, without brackets."""
    return [part.strip("[] ").lower() for part in table.partition(" with")[0].split(",") if part.strip("[] ")]


def lines_of(entries: list[KeyEntry]) -> Iterator[str]:
    """Lines for a terminal: chapters, tables, and a line for each key."""
    chapter = table = None
    for entry in entries:
        if entry.chapter != chapter:
            chapter, table = entry.chapter, None
            yield chapter
        if entry.table != table:
            table = entry.table
            yield f"  {table or 'the file itself'}"
        yield (
            f"    {entry.key} ({entry.type}; {entry.default}): {entry.meaning}" if entry.key else f"    {entry.meaning}"
        )
