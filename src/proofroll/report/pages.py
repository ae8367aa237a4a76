"""Utilities of every page: templates with escaping, figures as elements, compressed contents."""

from __future__ import annotations

import base64
import gzip
import html as markup
import json
import re
import zlib
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jinja2


# What decides the address of a row: ids around its table, the label of that, the engine of a part of it, its keys.
_PLACES = re.compile(
    r'<(?:section|details|h[1-4])\b[^>]*? id="(?P<section>[^"]+)"'
    r'|<div class="scroll\b[^>]*? aria-label="(?P<label>[^"]*)"'
    r'|<thead>.*?</thead>|<tbody(?: data-engine="(?P<engine>[^"]*)")?>'
    r'|<tr(?P<row>(?! class="(?:group|note)")[^>]*)>(?P<cell>.*?)(?P<rest></t[hd]>.*?</tr>)',
    re.DOTALL,
)
_KEY = re.compile(r"<td\b[^>]* data-key\b[^>]*>(.*?)</td>", re.DOTALL)

# What is no running text, and what is: between two tags. A browser breaks a line at the hyphen of ``1e-3``.
_NO_TEXT = re.compile(r"(<(script|style|svg|option|title)\b.*?</\2>)", re.DOTALL)
_TEXT = re.compile(r"(?:^|>)([^<]*(?:\de-\d|\bdt \d)[^<]*)(?=<)")
_EXPONENT = re.compile(r"(?:\b(?:dt|rtol) )?\d[\d.]*e-\d+(?: (?:s|m|N|J|rad)\b(?:/s)?)?|\bdt \d[\d.]* s\b")
_WORDS = 12  # of a label or a name in an address


def environment(*folders: Path) -> jinja2.Environment:
    """Templates of the report and of further folders, read now, so that changes during a long run have no effect.

    All values are escaped but those that templates mark as safe.
    """
    import jinja2

    places = dict.fromkeys([Path(__file__).parent / "templates", *folders])  # the first of equal names counts
    files = [path for place in reversed(places) if place.is_dir() for path in place.iterdir() if path.is_file()]
    return jinja2.Environment(
        loader=jinja2.DictLoader({path.name: path.read_text(encoding="utf-8") for path in files}),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def rendered(templates: jinja2.Environment, name: str, **values: Any) -> str:
    """Rendered page with addressed rows and unbroken numbers; a lone surrogate of a message becomes a question mark."""
    text = templates.get_template(name).render(**values).encode("utf-8", "replace").decode("utf-8")
    return unbroken(addressed(text))


def unbroken(html: str) -> str:
    """Page without line breaks inside numbers as ``1e-3 s`` that are part of a longer text."""
    pieces = _NO_TEXT.split(html)
    del pieces[2::3]  # names of elements
    pieces[::2] = (_TEXT.sub(_kept_whole, piece) for piece in pieces[::2])
    return "".join(pieces)


def _kept_whole(match: re.Match[str]) -> str:
    alone = " " not in match[1].strip()
    return match[0] if alone else _EXPONENT.sub(r'<span class="whole">\g<0></span>', match[0])


def addressed(html: str) -> str:
    """Page whose rows of tables each have an id and, in their first cell, a link to it.

    The id is made from the id of the section, the label of the table, and the texts of the first cell and of those with
    the attribute ``data-key``, so that the row has it again in a page of other runs.
    """
    context = {"section": "", "label": "", "engine": ""}
    taken: Counter[str] = Counter()

    def address(match: re.Match[str]) -> str:
        parts = match.groupdict()
        if parts["cell"] is None:
            context.update({name: parts[name] for name in context if parts[name] is not None})
            if match[0].startswith(("<thead", "<tbody>")):
                context["engine"] = ""
            return match[0]
        own_id = re.search(r' id="([^"]*)"', parts["row"])
        of = re.search(r' data-of="([^"]*)"', parts["row"])
        keys = " ".join([parts["cell"], *_KEY.findall(parts["rest"])])
        name = f"{context['engine']} {of[1] if of else ''} {re.sub('<[^>]*>', '', keys)}"
        address = ".".join(
            filter(None, (context["section"], slug(context["label"], _WORDS), slug(name, _WORDS) or "row"))
        )
        taken[address] += 1
        address += f"-{taken[address]}" if taken[address] > 1 else ""
        start = match[0].removesuffix(parts["rest"]) if own_id else f'<tr id="{address}"{parts["row"]}>{parts["cell"]}'
        link = f'<a class="row" href="#{own_id[1] if own_id else address}" aria-label="link to this row"></a>'
        return start + link + parts["rest"]

    return _PLACES.sub(address, html)


def section_id(kind: str, name: str) -> str:
    """HTML id of the section of a study: it has the same in a report of other studies."""
    return f"{kind}-{slug(name)}"


def slug(text: str, most: int | None = None) -> str:
    """Text as a part of an address: its words, in lower case, joined by hyphens.

    Of more than ``most`` words the first remain, with a hash of all.
    """
    words = re.findall(r"(?:(?<!\w)-(?=\d))?\w+", markup.unescape(text).lower())
    kept = words[:most]
    return "-".join([*kept, *([f"{zlib.crc32(' '.join(words).encode()):08x}"] if len(kept) < len(words) else [])])


def packed(content: bytes) -> str:
    """Bytes as text for ``templates/unpack.js``: gzip in base64, without markup, reproducible byte for byte."""
    return base64.b64encode(gzip.compress(content, compresslevel=9, mtime=0)).decode("ascii")


def folded(html: str) -> str:
    """Page whose closed folds (``<details>``) are built only when they are opened.

    The content of each fold but its summary is moved into the element with the id ``folds``, compressed;
    ``templates/page.js`` puts it back. Folds within a fold are moved separately; one with the attribute ``data-whole``
    stays. So a browser parses, lays out and paints only what is open.
    """
    texts: list[str] = []
    levels: list[list[str]] = [[]]
    closed: list[bool] = []
    for piece in re.split(r"(<details\b[^>]*>|</summary>|</details>)", html):
        if piece == "</details>" and closed.pop():
            texts.append("".join(levels.pop()))
            levels[-1].append(f'<div data-fold="{len(texts) - 1}"></div>')
        levels[-1].append(piece)
        if piece.startswith("<details"):
            closed.append(not piece.endswith((" open>", " data-whole>")))
        elif piece == "</summary>" and closed[-1]:
            levels.append([])
    kept = packed(json.dumps(texts, ensure_ascii=False).encode("utf-8", "replace"))
    return "".join(levels[0]).replace('id="folds">', f'id="folds">{kept}', 1)


def element(text: str, prefix: str) -> str:
    """SVG element of a matplotlib figure: its ids begin with ``prefix``, and its styles are removed."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<(metadata|style)\b.*?</\1>", "", text, flags=re.DOTALL)
    start, _, rest = text.partition(">")
    start = re.sub(r' (?:xmlns(?::\w+)?|version|width|height)="[^"]*"', "", start)
    text = f'{start} aria-hidden="true">{rest}'  # the surrounding text describes it
    # Keeps only ids that are referred to, for equal images would share the others.
    text = re.sub(r' id="([^"]*)"', lambda match: f' id="{prefix}{match[1]}"' if f"#{match[1]}" in text else "", text)
    text = re.sub(r'href="#', f'href="#{prefix}', text)
    return re.sub(r"url\(#", f"url(#{prefix}", text)
