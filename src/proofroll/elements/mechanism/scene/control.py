"""Controller of a mechanism: at its instants it sets targets of actuators, which hold until the next instant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from proofroll.core.errors import InputError, no_such_key, require_known
from proofroll.core.parameters import Parameters
from proofroll.elements.mechanism.scene import checks
from proofroll.elements.mechanism.scene.policy import PolicySource

if TYPE_CHECKING:
    from proofroll.elements.mechanism.scene.drives import Actuator

TARGET, EFFORT = "target", "effort"


@dataclass(frozen=True)
class Control:
    """Controller with instants k/rate, k = 0, 1, 2, …; a value belongs to the steps that begin at its instant.

    Attributes:
        rate: instants per second.
        actuators: names, in the order of a policy's arrays; all of kind position.
        policy: of the targets, joint coordinates: pose + scale · action; None: the actuators' own targets, read at the
            instants.
        scale: of an action [rad or m].
        pose: coordinates for an action of zero, and the targets before the first ones arrive.
        delay: whole instants until a target acts.
        held: ``target`` (the effort follows the state between instants), or ``effort`` (it is held, too).
    """

    rate: float = field(metadata={"unit": "Hz"})
    actuators: tuple[str, ...] = ()
    policy: PolicySource | None = None
    scale: float = 1.0
    pose: tuple[float, ...] = ()
    delay: int = 0
    held: str = TARGET

    def __post_init__(self) -> None:
        if isinstance(self.actuators, str) or not isinstance(self.actuators, Sequence):
            raise InputError("control.actuators", self.actuators, "give a list of names")
        rate = checks.number("control.rate", self.rate)
        if rate <= 0:
            raise InputError("control.rate", rate, "give instants per second, above 0")
        names = tuple(checks.name(name, "control.actuators") for name in self.actuators)
        pose = checks.numbers("control.pose", self.pose or (0.0,) * len(names), len(names)) if names else ()
        checks.assign(self, rate=rate, actuators=names, pose=pose, scale=checks.number("control.scale", self.scale))
        require_known("control.held", self.held, (TARGET, EFFORT))
        if not isinstance(self.delay, int) or isinstance(self.delay, bool) or self.delay < 0:
            raise InputError("control.delay", self.delay, "a delay is a whole number of instants, at least 0")

    def instant(self, k: int) -> float:
        """Time of an instant [s]."""
        return k / self.rate

    def check(self, actuators: Sequence[Actuator]) -> None:
        """Raises InputError unless all of its actuators exist, and are of kind position."""
        kinds = {item.name: item.kind for item in actuators}
        for name in self.actuators:
            require_known("control.actuators", name, sorted(kinds), "there is no such actuator; choose from")
            if kinds[name] != "position":
                advice = f"it is of kind {kinds[name]}; a controller sets targets of kind position"
                raise InputError("control.actuators", name, advice)


_KEYS = ("rate", "actuators", "call", "scale", "pose", "delay", "held")


def made_control(table: Any, numbers: Parameters) -> Control | None:
    """Controller of a table ``[control]`` of a scene file; None: there is no table. ``call`` names the policy.

    Raises:
        InputError: a key is unknown, or a value makes no sense.
    """
    if table is None or isinstance(table, Control):
        return table
    if not isinstance(table, Mapping):
        raise InputError("control", table, "give a table [control]")
    for key in table:
        if key not in _KEYS:
            raise no_such_key(f"control.{key}", table[key], _KEYS)
    for key in ("rate", "actuators"):
        if key not in table:
            raise InputError(f"control.{key}", None, "this key is required; add it")
    filled = numbers.filled(dict(table), "control", {"rate": "Hz", "scale": "rad or m", "pose": "rad or m"})
    call = filled.pop("call", None)
    if call is not None and not isinstance(call, str):
        raise InputError("control.call", call, "give the policy as module:make")
    return Control(policy=None if call is None else PolicySource(call), **filled)


def constant(actuator: Actuator, value: Any) -> Actuator:
    """Actuator whose effort at the joint is a value [N m, N], or what holds it."""
    return replace(actuator, kind="torque", target=value, kp=0.0, kd=0.0, gear=1.0, limit=None)
