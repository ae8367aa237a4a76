"""Reads ``comparisons/*.toml``: claims about engines on a scene, with a reason for every tolerance."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from proofroll.core.bounds import require_bounds, require_pair
from proofroll.core.comparison import Band, Comparison, Edge, ExceptAt, Row, Tolerance
from proofroll.core.convergence import LADDER_RUNGS
from proofroll.core.errors import InputError, choices, error_location, require_known
from proofroll.core.observable import Observable
from proofroll.core.plugins import parse_engine, require_engine
from proofroll.core.time_grid import time_grid
from proofroll.core.validation import strict, validated
from proofroll.core.verdict import Verdict
from proofroll.files.data_folders import study_folders
from proofroll.files.scene_file import SCENE_IS_A_FOLDER, load_scene, scene_names
from proofroll.files.scene_sources import command_line
from proofroll.files.toml import named_file, read_toml, study_of

# Most combinations of parameters; a run takes about a second, so more are a mistake.
_MOST_POINTS = 10_000
# Most words of a row's short reason.
_SHORTEST = 12


def comparison_names() -> list[str]:
    """Names of all comparisons in the order of a report, without files of other studies (``study = "…"``)."""
    paths = [path for folder in study_folders() for path in folder.glob("*.toml") if study_of(path) is None]
    return [path.stem for path in sorted(paths, key=lambda path: (_order(path), path.stem))]


def further_comparison_names() -> list[str]:
    """Sorted names, with their folder, of the comparisons in subfolders, which a report without names leaves out."""
    folders = {path: folder for folder in study_folders() for path in folder.glob("*/*.toml")}
    comparisons = [path for path in folders if path.name != "scene.toml" and study_of(path) is None]
    return sorted(path.relative_to(folders[path]).with_suffix("").as_posix() for path in comparisons)


def _order(path: Path) -> float:
    """Order that a file declares for a report; infinite if there is none or the file is broken."""
    try:
        order = read_toml(path).get("order", math.inf)
    except InputError:
        return math.inf
    return order if isinstance(order, (int, float)) else math.inf


def load_comparison(name: str) -> Comparison:
    """Reads a comparison by its path, or by its name in a folder of studies, with or without ``.toml``.

    Raises:
        InputError: there is no such file, or it is broken.
    """
    path = named_file(name)
    if path is None and Path(name).suffix not in ("", ".toml"):
        raise InputError("comparison", name, "there is no such file")
    if path is None:
        suggestions = choices([*comparison_names(), *further_comparison_names(), *scene_names()], Path(name).stem)
        raise InputError(
            "comparison", name, f"there is no such comparison or scene; choose one of {suggestions} or a file"
        )
    content = read_toml(path)
    if "gravity" in content:
        raise InputError("comparison", name, SCENE_IS_A_FOLDER)
    if "study" in content:
        again = command_line("report", name)
        raise InputError(f"{path}: study", content["study"], f"is no comparison; {again} runs it")
    with error_location(path.name):
        return replace(_checked(path, content), asked=name)


def _checked(path: Path, content: dict[str, Any]) -> Comparison:
    place = path.name
    tolerances = _table(f"{place}: tolerances", content.pop("tolerances", {}))
    bands = {name: _band(f"{place}: tolerances.{name}", table) for name, table in tolerances.items()}
    tables = content.get("rows")
    if not isinstance(tables, list) or not tables:
        raise InputError(f"{place}: rows", tables, "give at least one engine; write [[rows]] before each")
    content["rows"] = [_prepared(f"{place}: rows.{index}", row) for index, row in enumerate(tables)]
    # No file may have these.
    program: dict[str, object] = {"asked": "", "left_out": 0, "budget": None, "spent": 0.0, "absent": {}}
    comparison = validated(Comparison, content, place, name=path.stem, bands=bands, **program)
    for name, values in comparison.vary.items():
        if not values:
            raise InputError(f"{place}: vary.{name}", values, "give at least one value, or leave it out")
    if math.prod(map(len, comparison.vary.values())) + len(comparison.points) > _MOST_POINTS:
        raise InputError(f"{place}: vary", list(comparison.vary), f"that is more than {_MOST_POINTS} points; vary less")
    for index, point in enumerate(comparison.points):
        for name, value in point.items():
            if isinstance(value, Edge) and not -math.inf < value.edge_between[0] < value.edge_between[1] < math.inf:
                raise InputError(f"points.{index}.{name}", list(value.edge_between), "give the lower value first")
    observables = load_scene(comparison.scene).observables
    for name, band in bands.items():
        bands[name] = replace(band, bounds=_in_units(f"{place}: tolerances.{name}", observables, band.bounds))
    rows = [
        _checked_row(f"{place}: rows.{index}", row, comparison, observables)
        for index, row in enumerate(comparison.rows)
    ]
    _check_times(comparison)
    _check_brief(place, comparison)
    return replace(comparison, bands=bands, rows=rows)


def _check_brief(place: str, comparison: Comparison) -> None:
    parameters = {name for point in comparison.combinations() for name in point}
    for name in comparison.brief:
        require_known(f"{place}: brief", name, sorted(parameters), "nothing varies it; choose from")
    if comparison.brief and not comparison.briefly().combinations():
        raise InputError(f"{place}: brief", comparison.brief, "no combination has these values; keep at least one")


def _check_times(comparison: Comparison) -> None:
    time_grid(comparison.until, comparison.every)
    require_bounds("until", comparison.until, above=0)
    if comparison.every > comparison.until:
        advice = f"samples lie further apart than the run is long, {comparison.until:g} s; sample more often"
        raise InputError("every", comparison.every, advice)
    require_bounds("time_limit", comparison.time_limit, above=0)
    require_bounds("order", comparison.order, unbounded=True)


def _table(place: str, value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(place, value, "this must be a table of names and values")
    return dict(value)


def _band(place: str, content: object) -> Band:
    table = _table(place, content)
    because = table.pop("because", "")
    if not (isinstance(because, str) and because):
        raise InputError(f"{place}.because", because or None, "every tolerance needs its reason; add it")
    return Band(because, {name: Tolerance.parse(f"{place}.{name}", text) for name, text in table.items()})


def _prepared(place: str, content: object) -> dict[str, Any]:
    """Table of a row in the form that :func:`validated` expects: texts become tolerances and lists."""
    row = _table(place, content)
    for key in ("limit", "bound"):
        if key in row:
            bounds = _table(f"{place}.{key}", row[key])
            row[key] = {name: Tolerance.parse(f"{place}.{key}.{name}", text) for name, text in bounds.items()}
    if isinstance(row.get("expect"), str):
        row["expect"] = [row["expect"]]
    exceptions = row.get("except_at", [])
    for exception in exceptions if isinstance(exceptions, list) else []:
        if isinstance(exception, dict) and isinstance(exception.get("expect"), str):
            exception["expect"] = [exception["expect"]]
    if "expect_for" in row:
        expected = _table(f"{place}.expect_for", row["expect_for"])
        row["expect_for"] = {k: [v] if isinstance(v, str) else v for k, v in expected.items()}
    return row


def _checked_row(place: str, row: Row, comparison: Comparison, observables: Mapping[str, Observable]) -> Row:
    """A row with its bounds in the units of the scene, after checks that its types do not express."""
    try:
        if (engine := parse_engine(row.engine).name) != "truth":
            require_engine(engine)
    except InputError as error:
        raise error.within(f"{place}.engine", row.engine) from None
    require_known(f"{place}.tolerance", row.tolerance, comparison.bands)
    if row.ladder != [1.0]:
        _check_ladder(place, row.ladder)
    _check_expectations(place, row)
    for name in [*row.expect_for, *row.order]:
        _require_observable(place, name, observables)
    for name, pair in row.order.items():
        require_pair(f"{place}.order.{name}", pair)
    limit, bound = (_in_units(place, observables, bounds) for bounds in (row.limit, row.bound))
    _check_points(f"{place}.only", comparison, row.only)
    if len(row.short.split()) > _SHORTEST:
        advice = f"it is shown on a card and has {len(row.short.split())} words; say it in {_SHORTEST}"
        raise InputError(f"{place}.short", row.short, advice)
    for exception in row.except_at:
        _check_points(f"{place}.except_at", comparison, exception.where)
        if not exception.where or not comparison.combinations(exception.where):
            raise InputError(f"{place}.except_at", exception.where, "name values that some point of the comparison has")
    if not comparison.combinations(row.only):
        raise InputError(f"{place}.only", row.only, "no point of the comparison fits, so the row would never be run")
    return replace(row, limit=limit, bound=bound)


def _check_expectations(place: str, row: Row) -> None:
    claims = [row.expect, *row.expect_for.values(), *(exception.expect for exception in row.except_at)]
    for claim in claims:
        if Verdict.DIFFERS in claim and {Verdict.AGREES, Verdict.UNCONFIRMED} & set(claim):
            advice = "that holds for any engine; say with except_at where it agrees and where it differs"
            raise InputError(f"{place}.expect", " or ".join(claim), advice)
    if {*itertools.chain.from_iterable(claims)} - {Verdict.AGREES} and not row.because:
        raise InputError(f"{place}.because", None, "an expectation other than agreement needs its reason; add it")


def _check_points(place: str, comparison: Comparison, chosen: Mapping[str, list[float]]) -> None:
    """Raises InputError unless the comparison has every chosen value."""
    values_of: dict[str, list[float]] = {}
    for point in comparison.combinations():
        for key, value in point.items():
            if isinstance(value, float):
                values_of.setdefault(key, []).append(value)
    for key, values in chosen.items():
        if key not in values_of:
            raise InputError(f"{place}.{key}", values, f"the comparison varies {', '.join(values_of)}")
        for value in values:
            if value not in values_of[key]:
                listed = ", ".join(f"{item:g}" for item in dict.fromkeys(values_of[key]))
                raise InputError(f"{place}.{key}", value, f"the comparison has only {listed}")


def _check_ladder(place: str, ladder: list[float]) -> None:
    falling = all(0 < finer < coarser < math.inf for coarser, finer in itertools.pairwise(ladder))
    if len(ladder) != LADDER_RUNGS or not falling or 1.0 not in ladder:
        raise InputError(f"{place}.ladder", ladder, "give three positive factors, largest first, one of them 1; or [1]")
    if not math.isclose(ladder[0] / ladder[1], ladder[1] / ladder[2]):
        raise InputError(f"{place}.ladder", ladder, "neighbouring factors must have the same ratio")


def _require_observable(place: str, name: str, observables: Mapping[str, Observable]) -> None:
    require_known(f"{place}: observable", name, observables, "there is no such observable; choose from")


def _in_units(
    place: str, observables: Mapping[str, Observable], bounds: Mapping[str, Tolerance]
) -> dict[str, Tolerance]:
    """Bounds in the units of their observables; raises InputError for an unknown name, another unit, or no size."""
    for name, bound in bounds.items():
        _require_observable(place, name, observables)
        if bound.relative and observables[name].floor is None:
            raise InputError(
                f"{place}: {name}", "%", f"it has no size of its own; give a number in {observables[name].unit}"
            )
    return {name: bound.in_unit(f"{place}: {name}", observables[name].unit) for name, bound in bounds.items()}


strict(Comparison, Row, ExceptAt)
