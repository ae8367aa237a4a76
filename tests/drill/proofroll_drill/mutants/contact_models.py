"""Mechanisms whose contacts differ from the scene's, followed exactly or reported wrongly."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from proofroll.core.events import Event
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.acting import Acting, heading_of
from proofroll.elements.mechanism.contact.dynamics import ContactDynamics
from proofroll.elements.mechanism.contact.start import touches
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample, mechanism_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import coefficients_of
from proofroll.truth.numerics.hybrid import follow, states_of
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll_drill.mutants.base import STEP
from proofroll_drill.mutants.mechanism_models import MechanismMutant

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
        force = np.where(np.isnan(force), 0.0, force)
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


def of_pairs(mechanism: Mechanism, change: Any) -> Mechanism:
    """Each pair changed."""
    return dataclasses.replace(mechanism, pairs=tuple(change(pair) for pair in mechanism.pairs))


def of_geometry(mechanism: Mechanism, name: str, **values: Any) -> Mechanism:
    """One geometry changed."""
    changed = (dataclasses.replace(g, **values) if g.name == name else g for g in mechanism.geometries)
    return dataclasses.replace(mechanism, geometries=tuple(changed))


class FrictionOff(ContactMutant):
    """Every pair is smooth."""

    fault = "friction of contacts off"
    named = ("friction of all contacts is off",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Smooth pairs."""
        return of_pairs(mechanism, lambda pair: dataclasses.replace(pair, friction=0.0))


class FrictionOnePercent(ContactMutant):
    """A hundredth less friction."""

    fault = "friction of contacts 1 % off"
    named = ("friction of all contacts is 0.99 ",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """A hundredth less of each pair."""
        return of_pairs(mechanism, lambda pair: dataclasses.replace(pair, friction=0.99 * pair.friction))


class FrictionOfOneFoot(ContactMutant):
    """One of three feet grips a tenth more."""

    fault = "friction of one contact 1.1 times"
    named = ("friction of left is 1.1",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """The first pair alone."""
        first, *others = mechanism.pairs
        return dataclasses.replace(
            mechanism, pairs=(dataclasses.replace(first, friction=1.1 * first.friction), *others)
        )


class FrictionOfAnImpact(ContactMutant):
    """One impact rubs a tenth more."""

    fault = "friction of an impact 1.1 times"
    scene: ClassVar[Any] = ("two_spheres", {})
    until, every = 0.2, 0.01  # the impact, at 0.1 s, lies on a sample
    named = ("friction of impacts is 1.1",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """A tenth more."""
        return of_pairs(mechanism, lambda pair: dataclasses.replace(pair, friction=1.1 * pair.friction))


class FrictionOfBounces(FrictionOfAnImpact):
    """Each bounce rubs a tenth more."""

    fault = "friction of bounces 1.1 times"
    scene: ClassVar[Any] = ("spinning_bounce", {})
    until, every = 1.0, 0.02


class RestitutionOfAnImpact(ContactMutant):
    """One impact returns nine tenths of its speed."""

    fault = "restitution of an impact 0.9 times"
    scene: ClassVar[Any] = ("two_spheres", {})
    until, every = 0.2, 0.01  # the impact, at 0.1 s, lies on a sample
    named = ("restitution of impacts is 0.9", "restitution of all pairs is 0.9")

    def other(self, mechanism: Mechanism) -> Mechanism:
        """A tenth less."""
        return of_pairs(mechanism, lambda pair: dataclasses.replace(pair, restitution=0.9 * pair.restitution))


class RestitutionOfBounces(RestitutionOfAnImpact):
    """Each bounce returns nine tenths of its speed."""

    fault = "restitution of bounces 0.9 times"
    scene: ClassVar[Any] = ("spinning_bounce", {})
    until, every = 1.0, 0.02


class Pyramid(ContactDynamics):
    """Friction of most work among the corners of a square, whose axes are x and y."""

    @staticmethod
    def heading(own: Acting, found: Touching) -> Array:
        """The axis that the slip is nearest to."""
        direction = heading_of(own, found)
        most = np.argmax(np.abs(direction))
        return np.asarray(np.sign(direction[most]) * np.eye(3)[most])


class PyramidForCone(ContactMutant):
    """Friction is bounded by a square."""

    fault = "a pyramid of friction in place of the cone"
    named = ("friction pyramid",)
    law = Pyramid


class ContactLeftOut(ContactMutant):
    """One foot touches nothing."""

    fault = "a contact left out"
    named = ("the contact back is left out",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """All pairs but the last."""
        return dataclasses.replace(mechanism, pairs=mechanism.pairs[:-1])

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """The last force is zero."""
        assert sample.contact_force is not None
        return dataclasses.replace(sample, contact_force=np.append(sample.contact_force, np.zeros((1, 3)), axis=0))


class FootMoved(ContactMutant):
    """One foot is a millimetre further ahead, and its certificate says so."""

    fault = "a foot moved 1 mm"
    honest = True
    named = ("places of contact",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Ahead."""
        x, y, z = next(g.position for g in mechanism.geometries if g.name == "left_foot")
        return of_geometry(mechanism, "left_foot", position=(x + 1e-3, y, z))


class FootMovedSilently(FootMoved):
    """The same, and its certificate has the scene's place."""

    fault = "a foot moved 1 mm, and not told"
    honest = False
    named = ("left_foot is at (0.151, 0.1, -0.08)",)


class NormalTurned(ContactMutant):
    """The floor leans by a thousandth, and its certificate says so."""

    fault = "normal of a contact turned"
    scene: ClassVar[Any] = BALLS
    honest = True
    named = ("normals of contact",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Another floor."""
        return of_geometry(mechanism, "floor", normal=(1e-3, 0.0, 1.0))


class NormalTurnedSilently(NormalTurned):
    """The same, and its certificate has the scene's normal."""

    fault = "normal of a contact turned, and not told"
    until, every = 0.4, 0.02
    honest = False
    named = ("normal of floor is turned by 0.001 rad",)


class OtherBody(ContactMutant):
    """The force on the second body is reported."""

    fault = "force of contact on the other body"
    named = ("contact_forces has the wrong sign",)

    def misreport(self, sample: MechanismSample) -> MechanismSample:
        """Minus."""
        assert sample.contact_force is not None
        return dataclasses.replace(sample, contact_force=-sample.contact_force)


class RestitutionSwapped(ContactMutant):
    """Each ball bounces as the other should."""

    fault = "restitution swapped between pairs"
    scene = BALLS
    until, every = 0.4, 0.02
    named = ("restitution is of another pair",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Swapped."""
        one, two = mechanism.pairs
        swapped = (one.restitution, two.restitution)[::-1]
        pairs = (dataclasses.replace(p, restitution=e) for p, e in zip((one, two), swapped, strict=True))
        return dataclasses.replace(mechanism, pairs=tuple(pairs))


class LateImpact(ContactMutant):
    """The ball goes on for a step before the impact acts."""

    fault = "impact one step late"
    scene = BALLS
    until, every = 0.4, 0.02
    named = ("impacts come one step",)
    late = STEP

    def sample(self) -> MechanismSample:
        """Free flight from where the ball is a step after it has come to the floor."""
        sample = super().sample()
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
