"""A comparison's section says what its scene is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from proofroll.files.scene_file import read_scene_file
from proofroll.report.page.scene_sheet import SceneSheet, ShownParameter, scene_sheet
from proofroll.report.pen import Lettering, Letters

POINTS = [{"speed": v, "rolling_resistance": f} for v in (2.0, 4.0, 6.0) for f in (0.0, 5e-4)]


def entries(sheet: SceneSheet) -> dict[str, ShownParameter]:
    """Parameters by name."""
    return {entry.name: entry for entry in sheet.parameters}


def test_every_parameter_has_values_unit_meaning_and_source() -> None:
    """Nothing of the scene's file is left out; what the comparison varies shows all its values."""
    file, found = read_scene_file("sphere_in_cylinder"), entries(scene_sheet("sphere_in_cylinder", POINTS))
    assert list(found) == list(file.parameters)
    for name, parameter in file.parameters.items():
        assert (found[name].meaning, found[name].source) == (parameter.meaning, parameter.source)
    assert (found["speed"].symbol, found["speed"].values, found["speed"].unit) == ("V0", "2, 4, 6", "m/s")
    assert found["rolling_resistance"].values == "0, 0.0005"
    assert [name for name, entry in found.items() if entry.varied] == ["speed", "rolling_resistance"]
    assert (found["gravity"].values, found["gravity"].unit) == ("9.81", "m/s²")


def test_defaults_that_are_other_parameters_or_unbounded_can_be_read() -> None:
    """Infinity has its sign, and a default that follows another parameter names it by its symbol."""
    found = entries(scene_sheet("sphere_in_cylinder", []))
    assert (found["mu_static"].symbol, found["mu_static"].values) == ("μs", "∞")
    assert found["mu_kinetic"].values == "= μs"
    assert found["radial_spin"].symbol == "ω1(0)"


def test_many_values_are_not_all_listed() -> None:
    """A long list says how many more there are."""
    found = entries(scene_sheet("sphere_in_cylinder", [{"speed": 2.0 + k} for k in range(9)]))
    assert found["speed"].values == "2, 3, 4, 5, 6 and 4 more"


def test_rolling_resistance_is_drawn_where_any_case_has_it() -> None:
    """One drawing stands for all cases."""

    def arm(sheet: SceneSheet) -> bool:
        marks = sheet.drawings[1].marks
        return any(isinstance(mark, Lettering) and mark.parts == [Letters("f", False)] for mark in marks)

    assert arm(scene_sheet("sphere_in_cylinder", [{"speed": 2.0}, {"rolling_resistance": 1e-4}]))
    assert not arm(scene_sheet("sphere_in_cylinder", [{"speed": 2.0}]))


def sheet_of(html: str) -> str:
    """The drawings of a page's first sheet, as markup."""
    return html[html.index('<svg class="drawing"') : html.index("<figcaption", html.index('<svg class="drawing"'))]


def test_drawing_and_parameters_are_on_the_page(written: tuple[dict[str, Any], Path], html: str, parse: Any) -> None:
    """Two pictures with a text for those who do not see them, made of the marks in the data; and all parameters."""
    elements = parse(html)
    pictures = [attributes for tag, attributes in elements.tags if attributes.get("class") == "drawing"]
    title = written[0]["comparisons"][0]["sheet"]["title"]
    assert [picture["aria-label"] for picture in pictures] == [
        f"{title}, as a whole", f"{title}, where the ball touches the wall",
    ]  # fmt: skip
    marks = [mark for drawing in written[0]["comparisons"][0]["sheet"]["drawings"] for mark in drawing["marks"]]
    drawn = [attributes for tag, attributes in parse(sheet_of(html)).tags if tag in {"path", "circle"}]
    paths = [attributes["d"] for attributes in drawn if "d" in attributes]
    assert [path.count("L") + 1 for path in paths] == [len(mark["points"]) for mark in marks if "points" in mark]
    assert sum("r" in attributes for attributes in drawn) == sum("centre" in mark for mark in marks) > 3
    assert "coefficient of rolling resistance" in elements.text
