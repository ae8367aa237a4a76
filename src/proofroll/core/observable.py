"""Declaration of an observable by its kind of element; lists, plots and verdicts read it."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Self


class Role(StrEnum):
    """Role of an observable, which decides how it is compared with the truth."""

    MOTION = "motion"  # a variable of the dataset, true to its error bar
    REACTION = "reaction"  # as motion, but without time 0, where the certificate judges it
    RESIDUAL = "residual"  # zero for a perfect run; the truth's own residual is the resolution of the measurement
    EVENT = "event"  # times or kinds of events, with the brackets of the truth as error bar


@dataclass(frozen=True)
class Observable:
    """A quantity of a run that can be compared with the truth.

    Attributes:
        name: as files and commands write it.
        unit: of its values; ``1`` for a number.
        meaning: one line for a person.
        role: see :class:`Role`.
        symbol: as an equation writes it; by default the name.
        floor: least size to which a relative tolerance refers, in its unit; None: it has no size of its own, so that a
            tolerance must be absolute.
        headline: True if summaries show it: the motion, and the forces that a person asks for first.
        watched: True if a first look judges it though no summary shows it.
        always: part of its size against which it is judged without a tolerance, too, events by their number; 0: it is
            not.
        asked_as: word in a scene's ``asks`` for which a first look judges it, e.g. ``orientation``; empty: none.
        decides: True if stability maps and ladders use it by default.
        asked_for: True if a person may ask for a recommendation by it.
        audit: True if it compares the reactions that an engine reports with the motion that it computed.
        hangs_on_events: True if it is unpredictable once the time of an event is ill-posed.
        at_impacts: False if it has no value beside an impact, whose length is an engine's own, nor where the question
            is ill-posed; if it is not ``of_contacts``, nor beside a change of a slip.
        of_contacts: True if it is zero wherever nothing touches.
        apart: True if it is the distance of what may touch.
        sums_samples: True if runs sum it over their samples, which have no impulses: it is compared up to the first
            impact.
        difference_of: larger variable whose small difference, with its round-off, it is; empty: none.
        vectors: number of the vector of each component, for values whose last axis is not one of axes of the world.
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
    always: float = 0.0
    asked_as: str = ""
    decides: bool = False
    asked_for: bool = True
    audit: bool = False
    hangs_on_events: bool = True
    at_impacts: bool = True
    of_contacts: bool = False
    apart: bool = False
    sums_samples: bool = False
    absent: str = ""
    difference_of: str = ""
    vectors: tuple[int, ...] = ()

    def __deepcopy__(self, _: object) -> Self:
        """The observable itself, which is immutable: a scene has hundreds, and every engine gets a copy of it."""
        return self

    @property
    def shown(self) -> str:
        """Symbol, or the name where there is none."""
        return self.symbol or self.name.replace("_", " ")
