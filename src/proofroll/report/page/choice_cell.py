"""Cells of the matrix of engines: speed where a tolerance is held, or the reason why it is not."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from proofroll.core.number_format import error, number
from proofroll.core.verdict import LimitResult, Verdict
from proofroll.report.page.candidates import Candidate

# States of a cell besides verdicts.
NO_RUN, CANNOT, PARTLY = "none", "cannot", "partly"
SEVERITY = list(map(str, Verdict))
# States of an engine's cell from the best to the worst.
ORDER = [
    *(Verdict.AGREES, PARTLY, Verdict.CONVERGES, Verdict.UNCONFIRMED, Verdict.INCOMPLETE, Verdict.DIFFERS),
    *(Verdict.FAILED, Verdict.ANOTHER_SCENE, Verdict.ILL_POSED, Verdict.NOT_JUDGED, Verdict.REFUSED, NO_RUN, CANNOT),
]
# Ratio of rough costs below which two engines tie.
TIE = 2.0
_WHY = {
    LimitResult.WITHIN: "finer steps come closer",
    LimitResult.NO_LADDER: "the closest of what was run",
    LimitResult.NOT_SHOWN: "no limit of small steps is shown",
    LimitResult.ANOTHER: "its limit of small steps is another",
}


class ChoiceCell(NamedTuple):
    """Cell of an engine in a scene or a kind of scenes at a tolerance.

    Attributes:
        state: verdict, for colour and glyph; ``none``: nothing was run; ``cannot``: the formulation lacks a capability
            that every scene requires; ``partly``: some scenes are held.
        text: speed if the tolerance is held, else the least error, or the number of scenes that hold it.
        title: the same in sentences.
        href: HTML id of the evidence; empty: there is none.
        cost: of the slowest scene; infinite unless the tolerance is held in all and costs were measured.
        clean: True if clean runs measured the cost; else it is known to a factor of about two.
        name: setting and step; for several scenes the ones that they share, or empty.
        why: short reason why the tolerance is not held; empty: it is.
        scenes, lacking: numbers of the column's scenes in which it was judged, and of those in which only others were.
        absent: number of the latter without a run of it, as it may be unable to represent them; others were left out.
        engine, formulation: names of an engine and its best formulation, or of several; empty: not of an engine.
        by_scene: best cell of that engine in each scene.
    """

    state: str
    text: str
    title: str
    href: str = ""
    cost: float = math.inf
    clean: bool = False
    name: str = ""
    why: str = ""
    scenes: int = 1
    lacking: int = 0
    absent: int = 0
    engine: str = ""
    formulation: str = ""
    by_scene: tuple["ChoiceCell", ...] = ()

    @property
    def holds(self) -> bool:
        """True if the tolerance is held in all scenes, and the cost is known."""
        return math.isfinite(self.cost)

    @property
    def share(self) -> str:
        """Words for the part of the column's scenes in which it was judged; empty: in all."""
        return f" in {self.scenes} of {self.scenes + self.lacking} scenes" if self.lacking else ""

    @property
    def rank(self) -> tuple[float, float, int]:
        """Sort key: what holds in all scenes comes first, the cheapest first; then by state."""
        return self.absent if self.holds else math.inf, self.cost, ORDER.index(self.state)

    def ties(self, best: "ChoiceCell") -> bool:
        """True if its cost overlaps with that of the first."""
        rough = not (self.clean and best.clean)
        return self is not best and self.holds and rough and self.cost < TIE * best.cost

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


def speed(cost: float, clean: bool) -> str:
    """Seconds of motion per second of computing, as ``90×``; rough ones are marked and rounded to coarse steps."""
    if cost <= 0:
        return "not timed"
    value = 1 / cost
    power = 10.0 ** math.floor(math.log10(value))
    leading = value / power
    step = 0.1 if clean or leading < 2 else 0.5 if leading < 5 else 1.0
    rounded = float(f"{round(leading / step) * step * power:.2g}")
    return f"{'' if clean else '≈ '}{f'{rounded:.0f}' if rounded >= 10 else f'{rounded:g}'}×"


def cell_of(steps: Sequence[Candidate], tolerance: float, forces: bool) -> ChoiceCell:
    """Cell of one study: the cheapest candidate that holds the tolerance, else the closest, else why there is none."""
    whole = [item for item in steps if item.blame is None]
    sized = [(size, item) for item in whole if (size := item.tolerance(forces)) is not None]
    held = [(item.cost if item.cost is not None else math.inf, size, item) for size, item in sized if size <= tolerance]
    if held:
        cost, size, item = min(held, key=lambda entry: entry[:2])
        text = "not timed" if math.isinf(cost) else speed(cost, item.clean)
        spent = (
            text if math.isinf(cost) else f"{text} real time ({number(cost, 2)} s of computing per second of motion)"
        )
        title = f"{item.name}: within {number(size)}, {spent}"
        return ChoiceCell(
            state=Verdict.AGREES, text=text, title=title, href=item.href, cost=cost, clean=item.clean, name=item.name
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
        return ChoiceCell(state, off, title, item.href, name=item.name, why=why)
    if whole:
        lacking = "no forces" if whole[0].motion is not None else "no motion"
        title = f"{whole[0].name}: reports {lacking}"
        return ChoiceCell(Verdict.INCOMPLETE, lacking, title, whole[0].href, why=f"reports {lacking}")
    item = steps[0]
    state = item.blame or Verdict.FAILED
    word = "missing" if item.status == "missing" else str(state)  # its engine is not installed
    return ChoiceCell(state, word, f"{item.name}: {item.message}".rstrip(": "), item.href, why=word)


def _beyond(size: float, tolerance: float, digits: int = 1) -> str:
    """Text of an error with enough digits to show that it exceeds the tolerance."""
    text = error(size, digits)
    return (
        text
        if digits > 4 or not math.isfinite(size) or float(text) > tolerance
        else _beyond(size, tolerance, digits + 1)
    )


def joined(cells: Mapping[str, ChoiceCell], titles: Mapping[str, str], *, counted: bool = True) -> ChoiceCell:
    """One cell for several studies or scenes: the worst; its cost is that of the slowest if all hold the tolerance.

    ``counted``: where some hold it and others do not, their number stands in place of the least error.
    """
    worst = max(cells.values(), key=lambda item: (SEVERITY.index(item.state), item.cost))
    if len(cells) == 1:
        return worst
    title = "; ".join(f"{titles[name]}: {cell.title}" for name, cell in cells.items())
    held = sum(cell.state == Verdict.AGREES for cell in cells.values())
    shared = len({cell.name for cell in cells.values()}) == 1
    worst = worst._replace(title=title, name=worst.name if shared else "")
    if held == len(cells):
        return worst
    if not counted:
        return worst._replace(cost=math.inf)
    why = f"{worst.why}; holds {held} of {len(cells)}"
    return worst._replace(text=f"{held} of {len(cells)}", cost=math.inf, why=why)
