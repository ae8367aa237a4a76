"""Cells of the matrix of engines: speed where a tolerance is held, or the reason why it is not."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from proofroll.core.number_format import error, number
from proofroll.core.verdict import SEVERITY, LimitResult, Verdict
from proofroll.report.page.candidates import Candidate

# States of a cell besides verdicts.
NO_RUN, CANNOT, PARTLY = "none", "cannot", "partly"
# States of an engine's cell from the best to the worst.
ORDER = [
    *(Verdict.AGREES, PARTLY, Verdict.CONVERGES, Verdict.UNCONFIRMED, Verdict.INCOMPLETE, Verdict.DIFFERS),
    *(Verdict.FAILED, Verdict.ANOTHER_SCENE, Verdict.ILL_POSED, Verdict.NOT_JUDGED, Verdict.REFUSED, NO_RUN, CANNOT),
]
# Ratio of rough costs below which two engines tie.
TIE = 2.0
_WHY = {
    LimitResult.WITHIN: "finer steps come closer",
    LimitResult.NO_LADDER: "smaller steps were not run",
    LimitResult.NOT_SHOWN: "no limit of small steps is shown",
    LimitResult.ANOTHER: "its limit of small steps is another",
}


class ChoiceCell(NamedTuple):
    """Cell of an engine in a scene or a kind of scenes at a tolerance.

    Attributes:
        state: verdict, for colour and glyph; ``none``: nothing was run; ``cannot``: the formulation lacks a capability
            that every scene requires; ``partly``: some scenes are held.
        text: speed if the tolerance is held, of several scenes from the slowest to the fastest; else the least error,
            or the number of scenes that hold it.
        title: the same in sentences.
        href: HTML id of the evidence; empty: there is none.
        cost: of the slowest scene that is held; infinite unless one is and costs were measured.
        clean: True if clean runs measured the cost; else it is known to a factor of about two.
        open: True if no coarser step of the setting was seen to fail, so that it may be cheaper.
        name: setting and step; for several scenes the ones that they share, or empty.
        why: short reason why the tolerance is not held; empty: it is.
        ladder: clause of it on smaller steps; empty: there is none.
        scenes, lacking: numbers of the column's scenes in which it was judged, and of those in which only others were.
        engine, formulation: names of an engine and its best formulation, or of several; empty: not of an engine.
        by_scene: best cell of that engine in each scene.
        run: the run that holds the tolerance.
    """

    state: str
    text: str
    title: str
    href: str = ""
    cost: float = math.inf
    clean: bool = False
    open: bool = False
    name: str = ""
    why: str = ""
    ladder: str = ""
    scenes: int = 1
    lacking: int = 0
    engine: str = ""
    formulation: str = ""
    by_scene: tuple["ChoiceCell", ...] = ()
    run: Candidate | None = None

    @property
    def holds(self) -> bool:
        """True if the tolerance is held in all scenes, and the cost is known."""
        return self.state == Verdict.AGREES and math.isfinite(self.cost)

    @property
    def each(self) -> tuple["ChoiceCell", ...]:
        """Cell of each scene; the cell itself if it is of one."""
        return self.by_scene or (self,)

    @property
    def held(self) -> int:
        """Number of scenes in which it holds the tolerance."""
        return sum(cell.holds for cell in self.each)

    @property
    def share(self) -> str:
        """Words for the part of the column's scenes in which it holds, or was judged; empty: in all."""
        if self.state == PARTLY and self.by_scene:
            return f" in {self.held} of {self.scenes} scenes"
        return f" in {self.scenes} of {self.scenes + self.lacking} scenes" if self.lacking else ""

    @property
    def rank(self) -> tuple[bool, float, int]:
        """Sort key: what holds in all scenes comes first, the cheapest first; then by state."""
        return not self.holds, self.cost, ORDER.index(self.state)

    def ties(self, best: "ChoiceCell") -> bool:
        """True if its cost overlaps with that of ``best`` in every scene that this holds."""
        pairs = [(mine, other) for mine, other in zip(self.each, best.each, strict=True) if other.holds]
        return self is not best and bool(pairs) and all(mine.near(other) for mine, other in pairs)

    def near(self, other: "ChoiceCell") -> bool:
        """True if the costs of two cells of one scene overlap."""
        return self.holds and not (self.clean and other.clean) and self.cost < TIE * other.cost

    @property
    def setting(self) -> str:
        """Setting and step without engine and formulation; empty if scenes need different ones."""
        words = self.name.removeprefix(f"{self.engine} {self.formulation}".strip()).strip()
        return words.removeprefix("at ").replace(" at ", ", ")

    @property
    def held_with(self) -> str:
        """Formulation and presets that hold its scenes, for a reader; of more than two presets none is named."""
        start = f"{self.engine} {self.formulation}".strip()
        names = [cell.name for cell in self.by_scene if cell.holds]
        presets = {name.removeprefix(start).partition(" at ")[0].strip() for name in names}
        few = len(presets) <= 2 and all(name.startswith(start) for name in names)
        words = self.formulation.replace("_", " ")
        return ", ".join(filter(None, (words, " or ".join(sorted(presets)) if few else "settings vary")))


def speed(cost: float, clean: bool, *, at_least: bool = False) -> str:
    """Seconds of motion per second of computing, as ``90×``; rough ones are marked and rounded to coarse steps.

    ``at_least``: no coarser step was seen to fail; ``≥`` stands before the speed.
    """
    return f"{_sign(clean, at_least)}{_rounded(cost, clean)}×" if cost > 0 else "not timed"


def speeds(cells: Sequence[ChoiceCell]) -> str:
    """Speeds of cells that hold, from the slowest to the fastest, as ``≥ 40–200×``."""
    slowest, fastest = max(cells, key=lambda item: item.cost), min(cells, key=lambda item: item.cost)
    if fastest.cost <= 0:
        return "not timed"
    ends = dict.fromkeys(_rounded(item.cost, item.clean) for item in (slowest, fastest))
    sign = _sign(slowest.clean and fastest.clean, slowest.open or fastest.open)
    return f"{sign}{'–'.join(ends)}×"


def _sign(clean: bool, at_least: bool) -> str:
    return "≥ " if at_least else "" if clean else "≈ "


def _rounded(cost: float, clean: bool) -> str:
    value = 1 / cost
    power = 10.0 ** math.floor(math.log10(value))
    leading = value / power
    step = 0.1 if clean or leading < 2 else 0.5 if leading < 5 else 1.0
    rounded = float(f"{round(leading / step) * step * power:.2g}")
    return f"{rounded:.0f}" if rounded >= 10 else f"{rounded:g}"


def cell_of(steps: Sequence[Candidate], tolerance: float, forces: bool) -> ChoiceCell:
    """Cell of a case or study: the cheapest candidate that holds the tolerance, else the closest, else why none is."""
    whole = [item for item in steps if item.blame is None]
    sized = [(size, item) for item in whole if (size := item.tolerance(forces)) is not None]
    held = [(item.cost if item.cost is not None else math.inf, size, item) for size, item in sized if size <= tolerance]
    if held:
        cost, size, item = min(held, key=lambda entry: entry[:2])
        is_open = item.step is not None and not any(_fails(other, item, tolerance, forces) for other in steps)
        text = "not timed" if math.isinf(cost) else speed(cost, item.clean, at_least=is_open)
        spent = (
            text if math.isinf(cost) else f"{text} real time ({number(cost, 2)} s of computing per second of motion)"
        )
        title = f"{item.name}: within {number(size)}, {spent}"
        return ChoiceCell(
            state=Verdict.AGREES,
            text=text,
            title=title,
            href=item.href,
            cost=cost,
            clean=item.clean,
            open=is_open,
            name=item.name,
            run=item,
        )
    if sized:
        size, item = min(sized, key=lambda entry: entry[0])
        limit, step_error = item.limit(forces, tolerance), item.error(forces)
        state = Verdict.CONVERGES if limit == LimitResult.WITHIN else Verdict.DIFFERS
        luck = step_error is not None and step_error <= tolerance
        size = step_error if step_error is not None and not luck else size
        off = _beyond(size, tolerance)
        by = f"its error of {number(step_error)} is luck, finer steps or their limit are off by" if luck else "off by"
        title, why = f"{item.name}: {by} {_beyond(size, tolerance, 2)}; {_WHY[limit]}", f"{by} {off}, {_WHY[limit]}"
        return ChoiceCell(state, off, title, item.href, name=item.name, why=why, ladder=_WHY[limit])
    if whole:
        lacking = "no forces" if whole[0].motion is not None else "no motion"
        title = f"{whole[0].name}: reports {lacking}"
        return ChoiceCell(Verdict.INCOMPLETE, lacking, title, whole[0].href, why=f"reports {lacking}")
    item = steps[0]
    state = item.blame or Verdict.FAILED
    word = "missing" if item.status == "missing" else str(state)  # its engine is not installed
    return ChoiceCell(state, word, f"{item.name}: {item.message}".rstrip(": "), item.href, why=word)


def _fails(coarser: Candidate, item: Candidate, tolerance: float, forces: bool) -> bool:
    """True if a candidate is a coarser step of the same setting that ran and does not hold the tolerance."""
    if coarser.setting != item.setting or (coarser.step or 0.0) <= (item.step or 0.0):
        return False
    size = coarser.tolerance(forces)
    return bool(coarser.status) if coarser.blame is not None else size is None or size > tolerance


def _beyond(size: float, tolerance: float, digits: int = 1) -> str:
    """Text of an error with enough digits to show that it exceeds the tolerance."""
    text = error(size, digits)
    return (
        text
        if digits > 4 or not math.isfinite(size) or float(text) > tolerance
        else _beyond(size, tolerance, digits + 1)
    )


def told_apart(cases: Sequence[str]) -> list[str]:
    """Cases in words without the parameters that all of them share."""
    parts = [case.split(", ") for case in cases]
    shared = set(parts[0]).intersection(*parts[1:])
    return [", ".join(item for item in case if item not in shared) or "as the scene is" for case in parts]


def of_cases(cells: Mapping[str, ChoiceCell], own: str | None, count: int) -> ChoiceCell:
    """Cell of a scene: that of its own case if all cases are held, without one of the slowest; else the worst.

    Args:
        cells: case in words -> cell.
        own: the case with the scene's own parameters; None: it was not run.
        count: number of judged cases; the others of them were not run.
    """
    worst = max(cells.values(), key=lambda item: (SEVERITY.index(Verdict(item.state)), item.cost))
    held = sum(cell.state == Verdict.AGREES for cell in cells.values())
    titles = zip(told_apart(list(cells)), cells.values(), strict=True)
    title = worst.title if len(cells) == 1 else "; ".join(f"{case}: {cell.title}" for case, cell in titles)
    if held == count:
        return cells.get(own or "", worst)._replace(title=title)
    if not held:
        return worst._replace(title=title)
    text = f"{held} of {count} cases"
    why = f"{worst.why or 'was not run in the others'}; holds {text}"
    return worst._replace(state=PARTLY, text=text, title=title, cost=math.inf, why=why)


def joined(cells: Mapping[str, ChoiceCell], titles: Mapping[str, str]) -> ChoiceCell:
    """One cell for several scenes: the worst; its cost is that of the slowest if all hold the tolerance.

    Speeds are a range, and where some scenes hold the tolerance and others do not, their number stands in place of the
    least error.
    """
    worst = max(cells.values(), key=lambda item: (ORDER.index(item.state), item.cost))
    if len(cells) == 1:
        return worst
    title = "; ".join(f"{titles[name]}: {cell.title}" for name, cell in cells.items())
    held = sum(cell.state == Verdict.AGREES for cell in cells.values())
    shared = len({cell.name for cell in cells.values()}) == 1
    worst = worst._replace(title=title, name=worst.name if shared else "")
    if held == len(cells):
        return worst._replace(text=speeds([*cells.values()])) if worst.holds else worst
    why = f"{worst.why}; holds {held} of {len(cells)}"
    return worst._replace(text=f"{held} of {len(cells)}", cost=math.inf, why=why)
