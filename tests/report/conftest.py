"""An invented comparison and its report, for the tests of the report."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsing import Drawn, Visit, launched, visiting
from flat_judging import judged_curve
from folded import whole
from invented import figures_part, further, regimes_part
from invented_answers import reported

from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.dataset import observe, scales
from proofroll.core.events import Event
from proofroll.core.truth import truth
from proofroll.core.verdict import Verdict
from proofroll.files.scene_file import load_scene, read_scene_file
from proofroll.files.trajectory_file import write
from proofroll.papers.blajer_2006.report.onsets import RunSlips, TrueSlips
from proofroll.papers.blajer_2006.truth.onset import Onset
from proofroll.report.comparison.plots import PointCurves
from proofroll.report.page.growing import begun
from proofroll.report.page.html import page, studies_page
from proofroll.report.page.records import ReportContent, report_content
from proofroll.report.replay.records import Replay
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.store import Store
from proofroll.studies.comparison.outcome import ComparedPoint, Outcome, Run
from proofroll.studies.comparison.planning import point_name

UNTIL, EVERY = 1.0, 0.02


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Outcome, Store]:
    """An invented comparison: a good row, a rough one, one that is silent about forces, and one that is missing."""
    store = Store(tmp_path_factory.mktemp("report") / "cases")
    rows = [
        Row("alpha[formulation=fine]", "tight"),
        Row("alpha[formulation=fine,preset=default]", "tight", expect=[Verdict.DIFFERS], because="it is coarse"),
        Row("beta", "tight"),
        Row("gamma", "tight"),
    ]
    bounds = dict.fromkeys(("gamma", "z", "N", "F2", "F3", "needed_friction", "gap"), Tolerance(1e-6, True))
    comparison = Comparison(
        name="invented",
        title="An invented comparison",
        question="Does the report say everything?",
        scene="sphere_in_cylinder",
        until=UNTIL,
        every=EVERY,
        vary={"speed": [3.0, 4.0]},
        bands={"tight": Band("a reason for it", bounds)},
        rows=rows,
    )
    times = np.linspace(0.0, UNTIL, round(UNTIL / EVERY) + 1)
    runs, points = [], {}
    for speed in (3.0, 4.0):
        point = {"speed": speed}
        scene = load_scene("sphere_in_cylinder", **point)
        true = truth(scene, times)

        def case(name: str, digest: str = scene.digest, point: dict[str, float] = point, **settings: Any) -> Case:
            facts = EngineFacts(name, "1.0", "code", settings, "dt" if settings else None, 2)
            return Case("sphere_in_cylinder", point, digest, facts, UNTIL, EVERY)

        known = case("truth")
        points[point_name(point)] = ComparedPoint(scene, known, Result(Status.DONE, "done"), store.stored(known))
        write(true, store.trajectory(known))
        sizes = scales(scene, true)
        expected = observe(scene, true)
        plans = [("matched", 1e-9, 0.2), ("default", 1e-3, 0.01), (None, 1e-7, 0.5)]
        for row, (preset, off, seconds) in zip(rows, plans, strict=False):
            settings = {"formulation": "fine" if preset else "only", "preset": preset, "dt": 1e-3}
            run_case = case(row.engine.partition("[")[0], **settings)
            dataset = true.copy(deep=True)
            for name in ("gamma", "z", "N", "F2", "F3"):
                dataset[name] = dataset[name] + off * sizes[name] * np.sin(9 * times)
            if preset is None:
                dataset = dataset.drop_vars(["N", "F2", "F3", "needed_friction"])
            write(dataset, store.trajectory(run_case))
            judgements = [
                judged_curve(
                    name,
                    scene.observables[name].unit,
                    curve,
                    expected[name],
                    truth_error_bar=1e-12,
                    tolerance=bounds[name].absolute(sizes[name]),
                    scale=sizes[name],
                    limit=None,
                )
                for name, curve in observe(scene, dataset).items()
                if name in bounds
            ]
            line = {
                "quantity": "mass", "unit": "kg", "expected": (0.5,), "found": (0.5,), "difference": 1e-17,
                "tolerance": 1e-12, "because": "", "holds": True, "standing": "holds",
            }  # fmt: skip
            result = Result(
                Status.DONE,
                "done",
                seconds_per_second=seconds,
                timings=[seconds],
                certificate=[line],
                versions={row.engine: "1.0"},
                trajectory=store.trajectory(run_case).name,
            )
            silent = sorted(bounds.keys() - {judgement.observable for judgement in judgements})
            motion = store.stored(run_case)
            runs.append(Run(row, point, run_case.engine, result, judgements, [], run_case, silent, trajectory=motion))
        missing = Result(Status.MISSING, "gamma is not installed here", versions={})
        runs.append(Run(rows[3], point, None, missing, [], ["gamma at this point missing"]))
    usual, file = load_scene("sphere_in_cylinder"), read_scene_file("sphere_in_cylinder")
    return Outcome(comparison, usual, file, sorted(runs, key=lambda run: rows.index(run.row)), points), store


@pytest.fixture(scope="session")
def written(made: tuple[Outcome, Store], tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """What stands in report.json, and the folder of a written report."""
    out = tmp_path_factory.mktemp("out")
    whole = begun([made[0]], "proofroll report invented")
    for item in reported():
        whole.add_answer(item)
    whole.write(out)
    return json.loads((out / "report.json").read_text(encoding="utf-8")), out


@pytest.fixture(scope="session")
def content(made: tuple[Outcome, Store]) -> ReportContent:
    """What the report says, as records."""
    return report_content([made[0]], "proofroll report invented")


class Elements(HTMLParser):
    """All start tags with their attributes, and the visible text."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.scripts: list[str] = []
        self.text = ""
        self._inside = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Keeps the element."""
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        self._inside = tag
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002 -- the signature is HTMLParser's
        """Leaves the element."""
        self._inside = ""

    def handle_data(self, data: str) -> None:
        """Keeps the text."""
        if self._inside == "script":
            self.scripts[-1] += data
        elif self._inside != "style":
            self.text += data


@pytest.fixture(scope="session")
def parse() -> Callable[[str], Elements]:
    """Reads HTML as a browser does that has opened every fold; the same page once."""
    return lru_cache(maxsize=4)(lambda html: Elements(whole(html)))


@pytest.fixture(scope="session")
def html(written: tuple[dict[str, Any], Path]) -> str:
    """The written page, with its folds opened."""
    return whole((written[1] / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def unpack(parse: Callable[[str], Elements]) -> Callable[[str, str], str]:
    """The text of a compressed element of a page, as the browser would unpack it."""

    def unpacked(html: str, name: str) -> str:
        elements = parse(html)
        scripts = [attributes for tag, attributes in elements.tags if tag == "script"]
        (index,) = [i for i, attributes in enumerate(scripts) if attributes.get("id") == name]
        return gzip.decompress(base64.b64decode(elements.scripts[index])).decode("utf-8")

    return unpacked


@dataclass
class Parts:
    """What a page is made of."""

    content: ReportContent
    curves: list[list[PointCurves]]
    pictures: dict[str, str]
    replay: Replay | None

    def write(self, file: Path) -> Path:
        """The page as a file, with that of the further studies beside it."""
        file.write_text(page(self.content, self.curves, self.replay), encoding="utf-8")
        (file.parent / "studies.html").write_text(studies_page(self.content, self.pictures), encoding="utf-8")
        return file


@pytest.fixture(scope="session")
def everything(made: tuple[Outcome, Store], tmp_path_factory: pytest.TempPathFactory) -> Parts:
    """The invented comparison with bounded friction at its first point, so that each part of a report is there.

    Its first row has a ladder of steps: for z a limit, for γ one that holds the truth exactly.
    """
    whole = begun([made[0]], "proofroll report invented")
    for part in (figures_part(tmp_path_factory.mktemp("figures")), regimes_part(), *further()):
        whole.parts.append(part)
        whole.make(part, lambda: None)
    for item in reported():
        whole.add_answer(item)
    comparison = whole.content.comparisons[0]
    event = Event("slip", 0.5, 0.5, 0.51)
    onset = Onset(0.5, None, None, None, None, np.inf, 1e-3, "well-posed", None, None)
    assert comparison.evidence is not None
    truths = comparison.evidence.truths
    truths[0] = replace(truths[0], own=TrueSlips(0.3, 0.2, onset, [event]))
    comparison.runs[:] = [replace(run, own=RunSlips([event], "agree")) for run in comparison.runs]
    gamma, z = (item.engines for item in whole.curves[0][0].observables[:2])
    gamma[0] = replace(gamma[0], limit=[0.0, 1e-12, None])
    z[:2] = replace(z[0], limit=[3e-7, 1e-7, 2.0]), replace(z[1], tolerance=1e-4)
    return Parts(whole.content, whole.curves, whole.pictures, whole.replay)


@pytest.fixture(scope="session")
def report_page(everything: Parts, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page that has every part of a report."""
    return everything.write(tmp_path_factory.mktemp("page") / "report.html")


@pytest.fixture(scope="session")
def visit() -> Iterator[Callable[..., AbstractContextManager[Visit]]]:
    """Opens a file in a browser, as a context; one browser serves all tests of a process."""
    with launched() as browser:
        yield partial(visiting, browser)


@pytest.fixture(scope="session")
def drawn_page(report_page: Path, visit: Callable[..., AbstractContextManager[Visit]]) -> Iterator[Drawn]:
    """The page that has every part of a report, as a reader has it at its end."""
    with visit(report_page) as seen:
        at_first = seen.page.locator("figure[data-o]").last.locator("svg").count()
        seen.unfold()
        yield Drawn(seen, at_first, seen.draw())
