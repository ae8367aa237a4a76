"""The report as a whole: its parts, their order, what is said of all of them, and what becomes of a part that fails."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass, replace
from html import unescape
from pathlib import Path
from typing import Any, ClassVar

import pytest
from folded import whole
from invented import further, stability_study
from invented_answers import reported
from report_schema import SCHEMA, problems

from proofroll.core.errors import ProofrollError
from proofroll.report.page.first_sentences import three_sentences
from proofroll.report.page.growing import Report, begun
from proofroll.report.page.html import page, studies_page
from proofroll.report.pages import slug
from proofroll.report.parts import PartEntry, absent, all_parts, attempt, part_kinds, parts_of
from proofroll.report.stability.part import StabilityPart
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.stability.axes import QUICK, Effort
from proofroll.studies.stability.map import stability_path
from proofroll.studies.study_store import keep_study

POISON = "</script><script>alert('poison')</script><img src=x onerror=alert(1)>\"'"
COMMAND = "proofroll report"


@pytest.fixture(scope="module")
def report(made: tuple[Outcome, Store]) -> Report:
    """A report with one comparison and a map; no test changes it."""
    whole = begun([made[0]], COMMAND)
    for part in further():
        whole.parts.append(part)
        whole._put(part, part.entry())
    for item in reported():
        whole.add_answer(item)
    return whole


@pytest.fixture(scope="module")
def written_page(report: Report) -> str:
    """Its page."""
    return page(report.content, report.curves)


@pytest.fixture(scope="module")
def written_studies(report: Report) -> str:
    """The page of its further studies."""
    return studies_page(report.content, report.pictures)


@pytest.mark.drill
def test_every_part_of_the_default_report_is_found_in_its_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Figures, regime maps, stability: one for each file of a study, and each by its name alone."""
    assert "stability_plane" not in [part.head["name"] for part in all_parts([], tmp_path)], "it is made on request"
    monkeypatch.setattr(StabilityPart, "keeps", lambda part, out: bool(part and out))
    parts = all_parts([], tmp_path)
    keys = [kind.key for kind in part_kinds()]
    assert keys == ["figures", "regimes", "stability"]
    assert "stability_plane" in [part.head["name"] for part in parts], "where it is kept it is there"
    assert [part.key for part in parts] == sorted((part.key for part in parts), key=keys.index)
    assert {part.key for part in parts} == set(keys)
    for part in parts:
        comparisons, found = parts_of(["paper", part.head["name"]], [], tmp_path)
        assert comparisons == ["paper"]
        assert [other.head for other in found] == [part.head]


def test_a_comparison_that_is_cut_names_its_file(report: Report) -> None:
    """Where combinations are left out, both commands that have them name the file as it was asked for, as one word."""
    first, *others = report.content.comparisons
    cut = replace(report.content, comparisons=[replace(first, left_out=3, asked="my claim.toml"), *others])
    text = unescape(whole(page(cut, report.curves)))
    for command in ("compare", "report"):
        assert f"<code>proofroll {command} 'my claim.toml'</code>" in text


def test_content_is_made_once_for_each_part(made: tuple[Outcome, Store]) -> None:
    """What is written and shown is one content; a further part makes another, which has it."""
    whole, (part, *_) = begun([made[0]], COMMAND), further()
    before = whole.content
    assert whole.content is before
    whole.parts.append(part)
    whole._put(part, part.entry())
    assert [entry.name for entry in whole.content.further] == [part.asked.name]
    assert not before.further


@pytest.mark.nightly
def test_sections_answer_in_order(written_page: str, written_studies: str, parse: Any) -> None:
    """What agrees, what to use, why; each section is there, has a heading and says something."""
    elements = parse(written_page)
    ids = [attributes["id"] for tag, attributes in elements.tags if tag == "section" and "id" in attributes]
    assert ids == [
        "answer",
        "verdicts",
        "evidence-invented",
        "studies",
        "made",
    ]
    links = {attributes["href"] for tag, attributes in elements.tags if tag == "a"}
    assert "studies.html#study-stability" in links
    elements = parse(written_studies)
    ids = [attributes["id"] for tag, attributes in elements.tags if tag == "section" and "id" in attributes]
    assert ids == ["chapter-sphere_in_cylinder", "study-stability"]
    assert "1 of 2 boundaries are passed in silence" in elements.text
    assert "good depends on mass" in elements.text
    assert "with at most 3 values for each axis" in elements.text
    assert "stability/sphere_in_cylinder/good-V0-8.py" in elements.text
    hashes = [attributes["href"].partition("#") for tag, attributes in elements.tags if tag == "a"]
    links = {name for file, _, name in hashes if not file}
    assert links <= {attributes.get("id") for _, attributes in elements.tags}
    curve = slug(stability_study().points[0].curve)
    assert {f"study-stability.{curve}-v0-{value}" for value in (4, 8)} <= links, (
        "each cell of the map leads to its boundary"
    )


@pytest.mark.drill
def test_exactly_three_sentences_from_the_data(report: Report) -> None:
    """What agrees best, what is silent, what to use; other data give other sentences, none at all still give three."""
    found = report.content.findings
    assert len(found) == 3
    assert found[0].startswith(
        "Of 4 settings in one comparison, 1 agrees with the truth in every observable and every case, 1 agrees without "
        "reporting all that is judged"
    )
    assert found[1].startswith(
        "1 setting differs from the truth and runs to the end without a warning, worst alpha fine, as installed"
    )
    assert found[1].endswith("1 of 2 boundaries of stability and accuracy are passed without a warning.")
    assert found[2] == "The fastest confirmed to hold 1e-4 of the path: alpha for sphere in cylinder (invented)."
    nothing = three_sentences([], {}, [])
    assert len(nothing) == 3
    assert all(sentence.endswith(".") for sentence in nothing)


def test_a_further_study_is_told_with_its_result(written_page: str, parse: Any) -> None:
    """The page has a line for each study of a scene, with what it found and a link to its own page."""
    text = " ".join(parse(written_page).text.partition("Further studies")[2].split())
    assert "Sphere in cylinder" in text
    assert "Where engines stop being right: 1 of 2 boundaries are silent" in text


def poisoned(value: Any) -> Any:
    """The content with poison at the end of every string."""
    if isinstance(value, dict):
        return {key: poisoned(item) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{item.name: poisoned(getattr(value, item.name)) for item in fields(value)})
    if isinstance(value, (list, tuple)):
        return [poisoned(item) for item in value]
    return value + POISON if isinstance(value, str) else value


def test_nothing_in_a_further_study_becomes_markup(
    report: Report, written_page: str, written_studies: str, parse: Any
) -> None:
    """Poison in every string of the map is text on the page."""
    missing = [absent(report.parts[0], f"broken {POISON}")]
    bad = replace(report.content, entries={**poisoned(report.content.entries), "figures": missing})
    for html, least, scripts in (
        (page(bad, report.curves), 0, parse(written_page).scripts),
        (studies_page(bad, {}), 40, parse(written_studies).scripts),
    ):
        elements = parse(html)
        assert elements.text.count("alert('poison')") > least
        for tag, attributes in elements.tags:
            assert tag != "img"
            assert not any(name.startswith("on") for name in attributes)
        assert sum(tag == "script" for tag, _ in elements.tags) == len(scripts)


@pytest.mark.drill
def test_json_has_no_nan_and_no_path_outside(report: Report, tmp_path: Path) -> None:
    """Everything that is written can be read by any JSON reader, and every file it names is below the report."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    report.write(tmp_path)
    content = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"), parse_constant=refuse)
    assert list(problems(content, SCHEMA)) == []
    assert content["stability"][0]["study"]["points"]
    comparison = content["comparisons"][0]
    named = [item["trajectory"] for item in (*comparison["runs"], *comparison["truths"]) if item["trajectory"]]
    named += [p["reproducer"] for p in content["stability"][0]["study"]["points"] if p["reproducer"]]
    assert len(named) == 9
    for name in named:
        assert not Path(name).is_absolute()
        assert ".." not in Path(name).parts
    assert all(name.startswith("cases/") for name in named[:-1])


class Broken:
    """A part that cannot be made."""

    key: ClassVar[str] = "stability"
    order: ClassVar[float] = 30
    words: ClassVar[str] = "a part"

    def __init__(self, error: BaseException) -> None:
        self.error = error

    @property
    def head(self) -> dict[str, str]:
        """What it is."""
        return dict.fromkeys(("name", "title", "question", "scene"), "broken") | {"command": "proofroll stability it"}

    def keeps(self, out: Path) -> bool:
        """Nothing."""
        return not out

    def make(self, *_: Any) -> None:
        """Fails."""
        raise self.error

    def entry(self) -> PartEntry:
        """Of what was made."""
        return PartEntry(**self.head)

    def pictures(self, prefix: str) -> dict[str, str]:
        """None."""
        return {prefix: ""}


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("error0")
@pytest.mark.parametrize("error", [ProofrollError("there is no truth here"), ZeroDivisionError("by zero")])
def test_a_part_that_fails_leaves_a_sentence(
    made: tuple[Outcome, Store], tmp_path: Path, parse: Any, error: Exception
) -> None:
    """The report stands; the section says in one sentence what is missing and which command makes it."""
    whole, part = begun([made[0]], COMMAND), Broken(error)
    assert whole.expect([part], tmp_path) == [part]
    whole.write(tmp_path)
    text = parse((tmp_path / "report.html").read_text(encoding="utf-8")).text
    assert "It has not been made yet; proofroll stability it makes it." in text
    said = whole.make(part, part.make)
    whole.write(tmp_path)
    assert str(error) in said.missing
    assert "Traceback" not in said.missing
    text = parse((tmp_path / "report.html").read_text(encoding="utf-8")).text
    assert said.missing in text
    assert "An invented comparison" in text


def test_an_interrupted_part_takes_nothing_away(made: tuple[Outcome, Store], tmp_path: Path) -> None:
    """What was written before an interrupt is still there, whole, and says what is missing."""
    whole, part = begun([made[0]], COMMAND), Broken(KeyboardInterrupt())
    whole.expect([part], tmp_path)
    whole.write(tmp_path)
    with pytest.raises(KeyboardInterrupt):
        whole.make(part, part.make)
    content = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert content["stability"][0]["missing"].startswith("It has not been made yet")
    assert content["comparisons"][0]["runs"]


@pytest.mark.drill
def test_what_is_kept_is_taken_and_what_is_outdated_is_not(tmp_path: Path) -> None:
    """The whole map, or a quick one; none of another code."""
    (stability,) = further()
    assert not stability.keeps(tmp_path)
    axes = stability.asked.axes
    paths = [stability_path(tmp_path, stability.asked.scene, axes, [], effort) for effort in (QUICK, Effort())]
    assert len(set(paths)) == 2, "a quick map does not take the place of the whole one"
    paths[0].parent.mkdir()
    keep_study(stability_study(), paths[0])
    assert stability.keeps(tmp_path)
    assert stability.folder == f"stability/{paths[0].stem}"
    old = stability_study()
    keep_study(replace(old, measured=replace(old.measured, code="another")), paths[0])
    assert not stability.keeps(tmp_path)


def test_an_attempt_survives_what_nobody_foresaw() -> None:
    """An error of our own becomes a sentence of one line, not the end of the report."""
    part = Broken(RuntimeError("first line\nsecond"))
    said = attempt(part, part.make)
    assert said is not None
    assert said.missing == (
        "an error of proofroll's own, RuntimeError: first line second; proofroll stability it makes it."
    )
