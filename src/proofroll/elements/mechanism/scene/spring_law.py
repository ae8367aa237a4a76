"""Pull of a spring as a formula of its length and of the rate of this: polynomials, gas springs, bump stops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from proofroll.core.errors import InputError, require_known
from proofroll.core.parameters import Parameters
from proofroll.elements.mechanism.scene.kinks import functions_of
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, NO_NUMBER, WrittenFormula, formula_value, names_in

LENGTH, RATE = "L", "dL"
# Units of coefficients that no key of a scene file has.
IN_LAWS = ("N/m^2", "N/m^3", "N s^2/m^2", "1/m")
_ANYWHERE = 0.7390851332151607  # m, m/s: where no formula of round numbers is singular


@dataclass(frozen=True)
class SpringLaw(WrittenFormula):
    """A formula of the length ``L`` [m] of a spring and its rate ``dL`` [m/s]; positive values pull [N].

    Attributes:
        units: of length, rate and pull in those of the formula, which are 1 in SI units.
    """

    units: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        try:
            self.pull(_ANYWHERE, _ANYWHERE)
        except NO_NUMBER:
            advice = f"is no number; use {LENGTH}, {RATE}, parameters, + - * / ^ ( ), pi and " + ", ".join(FUNCTIONS)
            raise InputError("force", f"= {self.text}", advice) from None

    def pull(
        self, length: Any, rate: Any, functions: Mapping[str, Callable[..., Any]] = FUNCTIONS, spring: str = ""
    ) -> Any:
        """Pull for a length [m] and a rate [m/s]: numbers, arrays, or symbols that ``functions`` take.

        ``spring``: name of the spring, whose kinks have sides of their own.
        """
        metre, speed, newton = self.units
        names = {**dict(self.numbers), LENGTH: metre * length, RATE: speed * rate}
        value = formula_value(self._parsed, names, functions_of(spring, functions))
        return value if newton == 1.0 else value * (1.0 / newton)

    def scaled(self, length: float, speed: float, force: float) -> SpringLaw:
        """The same law in units of these sizes in the present ones."""
        metre, second, newton = self.units
        return replace(self, units=(metre * length, second * speed, newton * force))


def read_spring_law(field: str, entry: Any, numbers: Parameters) -> Any:
    """Law of a file. Units of its parameters are not checked: numbers in a formula have none.

    Raises:
        InputError: the formula is wrong, or has an unknown name.
    """
    if not isinstance(entry, str):
        raise InputError(field, entry, f'give a formula of {LENGTH} and {RATE}: "= 50*({LENGTH} - 0.3)^3"')
    text = entry.removeprefix("=").strip()
    for name in sorted({LENGTH, RATE} & numbers.values.keys()):
        raise InputError(field, entry, f"the parameter {name} has the name of a variable of springs; rename it")
    used = names_in(text)
    for name in sorted(used - {LENGTH, RATE, "pi", *FUNCTIONS}):
        choices = [LENGTH, RATE, *sorted(numbers.values)]
        require_known(field, name, choices, "there is no such parameter; choose from")
    parameters = tuple((name, float(value)) for name, value in numbers.values.items() if name in used)
    try:
        return SpringLaw(text, parameters)
    except InputError as error:
        raise InputError(field, error.value, error.advice) from None
