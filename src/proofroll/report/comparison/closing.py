"""Closing notes of a comparison, a line each: shared schemes, caveats, equations of the truth, families of contact."""

import math
from collections.abc import Sequence

from proofroll.core.verdict import Verdict
from proofroll.report.comparison.records import ReportedComparison, ReportedRow
from proofroll.report.labels import engine_title

# Two rows count as one scheme if their errors differ by less than this relative part, in at least so many observables
# whose error exceeds so many error bars of the truth.
_SAME, _SEEN, _SEVERAL = 1e-3, 10.0, 2


def closing_notes(content: ReportedComparison) -> list[str]:
    """Notes on the rows of a comparison that hold whatever their verdicts; at most four lines."""
    rows = [row for row in content.rows if row.verdict != Verdict.REFUSED]
    equations: dict[str, list[ReportedRow]] = {}
    caveats: dict[str, list[ReportedRow]] = {}
    families: dict[str, list[ReportedRow]] = {}
    for row in rows:
        for note, groups in ((row.shared, equations), (row.caveat, caveats), (row.family, families)):
            if note:
                groups.setdefault(note, []).append(row)
    notes = {
        "Same integration scheme (agreement is not independent evidence)": _one_scheme(content.rows),
        "Caveats": caveats,
        "Equations of the truth": equations,
        "Contact law": families,
    }
    return [
        f"{head}: {'; '.join(f'{_owners(owners, content.rows)}: {note}' for note, owners in groups.items())}."
        for head, groups in notes.items()
        if groups
    ]


def _owners(owners: Sequence[ReportedRow], rows: Sequence[ReportedRow]) -> str:
    """Settings of some rows by engine; an engine alone if all of its rows are among them."""
    settings: dict[str, dict[str, None]] = {}
    for row in owners:
        settings.setdefault(row.name, {})[
            " ".join(filter(None, ((row.formulation or "").replace("_", " "), row.setting)))
        ] = None
    whole = {row.name for row in rows} - {row.name for row in rows if row not in owners}
    titles = {name: engine_title(name) for name in settings}
    return ", ".join(titles[name] + f" {', '.join(words)}" * (name not in whole) for name, words in settings.items())


def _one_scheme(rows: Sequence[ReportedRow]) -> dict[str, list[ReportedRow]]:
    """Declared scheme of fixed steps -> its rows, of several engines; and rows of equal errors with no such scheme.

    Codes with one scheme print the same digits, right or wrong; so do those with one wrong model.
    """
    schemes: dict[str, list[ReportedRow]] = {}
    groups: list[list[ReportedRow]] = []
    for row in rows:
        if row.scheme and row.resolution == "dt" and row.observables:
            schemes.setdefault(row.scheme, []).append(row)
        group = next((rows_alike for rows_alike in groups if _same_digits(rows_alike[0], row)), None)
        if group is None:
            groups.append([row])
        else:
            group.append(row)
    declared = {scheme: owners for scheme, owners in schemes.items() if len({row.name for row in owners}) > 1}
    alike = [
        group
        for group in groups
        if len(group) > 1 and not any(all(row in owners for row in group) for owners in declared.values())
    ]
    numbers = ["", *(f" ({number})" for number in range(2, len(alike) + 1))]
    equal = {f"equal errors to three digits{number}": group for number, group in zip(numbers, alike, strict=False)}
    return declared | equal


def _same_digits(row: ReportedRow, rival: ReportedRow) -> bool:
    """True if two rows have the same step and equal errors in all shared observables above the truth's error bars."""
    if row.resolution != "dt" or (row.resolution, row.resolution_value) != (rival.resolution, rival.resolution_value):
        return False
    pairs = [(row.observables[name], rival.observables[name]) for name in row.observables.keys() & rival.observables]
    seen = [(a.largest, b.largest) for a, b in pairs if max(a.largest, b.largest) > _SEEN * a.truth_error_bar]
    alike = all(math.isfinite(a) and math.isclose(a, b, rel_tol=_SAME) for a, b in seen)
    return len(seen) >= _SEVERAL and alike
