"""Mechanisms whose contacts differ from the scene's, followed exactly or reported wrongly."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from proofroll.core.events import Event
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import Acting, heading_of
from proofroll.elements.mechanism.contact.start import touches
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample, mechanism_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.projection.contact.contact_modes import coefficients_of
from proofroll.truth.numerics.hybrid import follow, states_of
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll_drill.mutants.base import STEP, planted
from proofroll_drill.mutants.mechanism_models import MechanismMutant, each, times

SLED: Any = ("sled", {})
BALLS: Any = (str(Path(__file__).parent / "two_bounces"), {})
_TOLERANCE = 1e-12


class ContactMutant(MechanismMutant):
    """Follows the changed mechanism by the truth's first route.

    Attributes:
        late: delay of the reported events [s].
    """

    scene: ClassVar[Any] = SLED
    until, every = 0.05, 0.005  # its faults show at once
    honest: ClassVar[bool] = False  # reads back what it built
    law: ClassVar[type[ContactDynamics]] = ContactDynamics
    late: ClassVar[float] = 0.0

    def __init__(self, scene: Scene, settings: Any) -> None:  # noqa: ARG002 -- it has no settings
        self.scenes, self.t = scene, 0.0
        self.mechanism = self.other(mechanism_of(scene))
        self.dynamics = self.law(self.mechanism)
        self.tree = ContactTree(self.dynamics, _TOLERANCE, 1.0)
        self.path = follow(self.tree, self.until + 4 * STEP)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.t = t

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        at = np.array([self.clock(self.t)])
        (number,) = self.path.stretch_at(at)
        state = states_of(self.tree, self.path, at, [number])[0]
        q, v, time = self.dynamics.parts(state)
        record, force, _ = self.dynamics.sample(q, v, self.path.stretches[number].mode, time)
        force = np.nan_to_num(force[:, :3])
        motion = {name: record[name] for name in ("p_WB", "v_WB", "w_WB", "q_WB")}
        sample: MechanismSample = self.misreport(MechanismSample(**motion, contact_force=force))
        return sample

    def events(self) -> list[Event]:
        """Events of its own path: samples show their times to an interval alone."""
        times = {each: each.time + self.late for each in self.path.happenings if each.time + self.late <= self.t}
        return [Event(each.kind, time, time, time, each.name) for each, time in times.items()]

    def built(self) -> MechanismBuilt:
        """Contacts as the scene has them, or as it built them; accelerations are derived from its steps."""
        mechanism = self.mechanism if self.honest else mechanism_of(self.scenes)
        dynamics = ContactDynamics(mechanism)
        found = touches(mechanism, dynamics.at(*mechanism.start()).solution.motion)
        bodies, laws = mechanism.bodies, coefficients_of(mechanism.contacts)
        return MechanismBuilt(
            mass=np.array([body.mass for body in bodies]),
            com=np.array([body.com for body in bodies]),
            inertia=np.array([body.inertia for body in bodies]),
            gravity=np.array(mechanism.gravity),
            contact_gap=np.array([each.gap for each in found]),
            contact_normal=np.array([each.normal for each in found]),
            contact_place=np.array([each.place for each in found]),
            contact_friction=laws["contact_friction"],
            contact_restitution=laws["contact_restitution"],
            contact_static=laws["contact_static"],
            contact_tangential=laws["contact_tangential"],
        )


class TurningMutant(ContactMutant):
    """Two balls on a floor, followed by the truth's first route, which has all laws of a pair."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        name: needs | {MechanismCapability.TURNING_FRICTION} for name, needs in ContactMutant.provides.items()
    }
    scene: ClassVar[Any] = (str(Path(__file__).parent / "rolling_and_sliding"), {})


class Pyramid(ContactDynamics):
    """Friction of most work among the corners of a square, whose axes are x and y."""

    @staticmethod
    def heading(own: Acting, found: Touching) -> Array:
        """The axis that the slip is nearest to."""
        direction = heading_of(own, found)
        most = np.argmax(np.abs(direction))
        return np.asarray(np.sign(direction[most]) * np.eye(3)[most])


def _one_less(_: Any, mechanism: Mechanism) -> Mechanism:
    """All pairs but the last."""
    return dataclasses.replace(mechanism, pairs=mechanism.pairs[:-1])


def _with_zero(_: Any, sample: MechanismSample) -> MechanismSample:
    """Sample with a last force of zero."""
    assert sample.contact_force is not None
    return dataclasses.replace(sample, contact_force=np.append(sample.contact_force, np.zeros((1, 3)), axis=0))


def _on_the_other_body(_: Any, sample: MechanismSample) -> MechanismSample:
    """Sample with the force on the second body."""
    assert sample.contact_force is not None
    return dataclasses.replace(sample, contact_force=-sample.contact_force)


def _swapped_restitutions(_: Any, mechanism: Mechanism) -> Mechanism:
    """Each ball bounces as the other should."""
    one, two = mechanism.pairs
    pairs = dataclasses.replace(one, restitution=two.restitution), dataclasses.replace(two, restitution=one.restitution)
    return dataclasses.replace(mechanism, pairs=pairs)


def _late_impact(self: Any) -> MechanismSample:
    """Sample of free flight for a step from where a ball comes to the floor, before the impact acts."""
    sample = ContactMutant.sample(self)
    p, v = np.array(sample.p_WB), np.array(sample.v_WB)
    for happened in self.path.happenings:
        since = self.t - happened.time
        if since <= 0:
            continue
        number = [pair.name for pair in self.mechanism.pairs].index(happened.name)
        comes, e, g = 9.81 * happened.time, self.mechanism.pairs[number].restitution, 9.81
        p[number, 2] += -comes * STEP - g * STEP**2 / 2 - e * comes * since + g * since**2 / 2
        p[number, 2] += e * (comes + g * STEP) * (since - STEP) - g * (since - STEP) ** 2 / 2
        v[number, 2] += (1 + e) * g * STEP
    return dataclasses.replace(sample, p_WB=p, v_WB=v)


def _pairs(factor: float, field: str, name: str = "") -> Callable[[Any, Mechanism], Mechanism]:
    return each("pairs", name, **{field: times(factor, field)})


_AHEAD = each(
    "geometries", "left_foot", position=lambda foot: (foot.position[0] + 1e-3, foot.position[1], foot.position[2])
)
_LEANING = each("geometries", "floor", normal=lambda _: (1e-3, 0.0, 1.0))
# One impact, at 0.1 s on a sample, and a sequence of bounces.
_ONE = {"scene": ("two_spheres", {}), "until": 0.2, "every": 0.01}
_MANY = {"scene": ("spinning_bounce", {}), "until": 1.0, "every": 0.02}
_FALL = {"scene": BALLS, "until": 0.4, "every": 0.02}
_LESS_RESTITUTION = ("restitution of impacts is 0.9", "restitution of all pairs is 0.9")
_fault, _turning = partial(planted, ContactMutant), partial(planted, TurningMutant)
FAULTS = (
    _fault("FrictionOff", "friction of contacts off", "friction of all contacts is off", other=_pairs(0.0, "friction")),
    _fault(
        "FrictionOnePercent",
        "friction of contacts 1 % off",
        "friction of all contacts is 0.99 ",
        other=_pairs(0.99, "friction"),
    ),
    # one of three feet
    _fault(
        "FrictionOfOneFoot",
        "friction of one contact 1.1 times",
        "friction of left is 1.1",
        other=_pairs(1.1, "friction", "left"),
    ),
    _fault(
        "FrictionOfAnImpact",
        "friction of an impact 1.1 times",
        "friction of impacts is 1.1",
        other=_pairs(1.1, "friction"),
        **_ONE,
    ),
    _fault(
        "FrictionOfBounces",
        "friction of bounces 1.1 times",
        "friction of impacts is 1.1",
        other=_pairs(1.1, "friction"),
        **_MANY,
    ),
    _fault(
        "RestitutionOfAnImpact",
        "restitution of an impact 0.9 times",
        _LESS_RESTITUTION,
        other=_pairs(0.9, "restitution"),
        **_ONE,
    ),
    _fault(
        "RestitutionOfBounces",
        "restitution of bounces 0.9 times",
        _LESS_RESTITUTION,
        other=_pairs(0.9, "restitution"),
        **_MANY,
    ),
    _fault("PyramidForCone", "a pyramid of friction in place of the cone", "friction pyramid", law=Pyramid),
    _fault(
        "ContactLeftOut", "a contact left out", "the contact back is left out", other=_one_less, misreport=_with_zero
    ),
    _fault("FootMoved", "a foot moved 1 mm", "places of contact", honest=True, other=_AHEAD),
    _fault("FootMovedSilently", "a foot moved 1 mm, and not told", "left_foot is at (0.151, 0.1, -0.08)", other=_AHEAD),
    _fault(
        "NormalTurned", "normal of a contact turned", "normals of contact", scene=BALLS, honest=True, other=_LEANING
    ),
    _fault(
        "NormalTurnedSilently",
        "normal of a contact turned, and not told",
        "normal of floor is turned by 0.001 rad",
        other=_LEANING,
        **_FALL,
    ),
    _fault(
        "OtherBody",
        "force of contact on the other body",
        "contact_forces has the wrong sign",
        misreport=_on_the_other_body,
    ),
    _fault(
        "RestitutionSwapped",
        "restitution swapped between pairs",
        "restitution is of another pair",
        other=_swapped_restitutions,
        **_FALL,
    ),
    _fault("LateImpact", "impact one step late", "impacts come one step", late=STEP, sample=_late_impact, **_FALL),
    _turning(
        "RollingResistanceMore",
        "rolling resistance 1.1 times",
        "rolling resistance of rolls is 1.1 times",
        other=_pairs(1.1, "rolling_resistance"),
    ),
    _turning(
        "RollingResistanceByRadius",
        "rolling resistance with the radius as its arm",
        "rolling resistance of rolls is 0.05 times",
        other=_pairs(0.05, "rolling_resistance"),
    ),
    _turning(
        "SpinningFrictionOff",
        "friction against spin off",
        "friction against spin of slides is off",
        other=_pairs(0.0, "spinning_friction"),
    ),
    _turning(
        "StaticForKinetic",
        "static friction in a slip",
        "slides slips with its static friction",
        other=each("pairs", friction=lambda pair: pair.static, static_friction=lambda _: None),
    ),
)
