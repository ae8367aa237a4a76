"""Declaration of an observable by its kind of element; lists, plots and verdicts read it."""

from dataclasses import dataclass
from enum import StrEnum


class Role(StrEnum):
    """Role of an observable, which decides how it is held against the truth."""

    MOTION = "motion"  # a variable of the dataset, true to its error bar
    REACTION = "reaction"  # as motion, but without time 0, where the certificate judges it
    RESIDUAL = "residual"  # zero for a perfect run; what the truth leaves is what the measurement cannot resolve
    EVENT = "event"  # times or kinds of events, with the brackets of the truth as error bar


@dataclass(frozen=True)
class Observable:
    """A quantity of a run that can be held against the truth.

    Attributes:
        name: as files and commands write it.
        unit: of its values; ``1`` for a number.
        meaning: one line for a person.
        role: see :class:`Role`.
        symbol: as an equation writes it; by default the name.
        floor: least size to which a relative tolerance refers, in its unit; None: it has no size of its own, so that a
            tolerance must be absolute.
        headline: whether summaries show it: the motion, and the forces that a person asks for first.
        watched: whether a first look judges it though no summary shows it.
        always: whether it is judged without a tolerance, too: by half of its size, events by their number.
        asked_as: word in a scene's ``asks`` for which a first look judges it, e.g. ``orientation``; empty: none.
        decides: whether a trade-off, a stability map and a recommendation go by it by default.
        asked_for: whether a person may ask for a recommendation by it.
        column: whether a trade-off shows it beside what decides, by default.
        audit: whether it holds the reactions that an engine reports against the motion that it made.
        hangs_on_events: whether it is a matter of luck where the time of an event is ill-posed.
        difference_of: variable that it is a small difference of, and whose round-off it has; empty: none.
        absent: reason for which no run of the scene has it, and the remedy; empty: runs have it.
    """

    name: str
    unit: str
    meaning: str
    role: Role
    symbol: str = ""
    floor: float | None = None
    headline: bool = False
    watched: bool = False
    always: bool = False
    asked_as: str = ""
    decides: bool = False
    asked_for: bool = True
    column: bool = False
    audit: bool = False
    hangs_on_events: bool = True
    absent: str = ""
    difference_of: str = ""

    @property
    def shown(self) -> str:
        """Symbol, or the name where there is none."""
        return self.symbol or self.name.replace("_", " ")
