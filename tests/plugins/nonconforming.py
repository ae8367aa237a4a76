"""Engines that each break one promise of the protocol; ``FAILS``: engine -> conformance check that must fail."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from placed_balls import gravity_of, placed, scene_with
from tiny import Tiny, TinySettings

from proofroll.core.engine import Regularised
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody
from proofroll.papers.blajer_2006.ball.rolling_equations import reduced_rates
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample

FAILS: dict[type[Tiny], str] = {}


class Breaking(Tiny):
    """Base of engines that must fail the conformance check ``breaks``; own settings become the only preset."""

    def __init_subclass__(cls, breaks: str = "") -> None:
        """Adds the engine to ``FAILS``."""
        if breaks:
            FAILS[cls] = breaks
        if "settings" in vars(cls):
            cls.presets = {"midpoint": {"matched": cls.settings()}}

    def sample(self) -> BallSample:
        """Reported sample; subclasses change it in ``_told``."""
        return self._told(super().sample())

    def _told(self, right: BallSample) -> BallSample:
        return right


class Unannounced(Breaking, breaks="name_is_the_entry_point"):
    """Has a name that is no entry point."""

    name = "unannounced"


class Versionless(Breaking, breaks="version_is_told"):
    """Returns a number as its version."""

    @staticmethod
    def version() -> Any:
        """Version of a wrong type."""
        return 2


class ProvidesText(Breaking, breaks="provides_capabilities"):
    """Declares a capability that does not exist."""

    provides: ClassVar[Any] = frozenset({"rolling", MechanismCapability.UNBOUNDED_FRICTION})


@dataclass
class MutableSettings:
    """Settings in a dataclass that is not frozen."""

    formulation: str = "midpoint"
    preset: str = "matched"
    dt: float = 1e-3
    resolution: ClassVar[str] = "dt"
    order: ClassVar[int] = 2


class Mutable(Breaking, breaks="settings_are_a_frozen_dataclass"):
    """Has settings that can be changed after they are made."""

    settings = MutableSettings


class MixedUp(Breaking, breaks="presets_are_complete"):
    """Has a preset whose settings name another preset."""

    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"default": TinySettings()}}


@dataclass(frozen=True)
class OrderlessSettings(TinySettings):
    """Settings whose order is not an integer."""

    @property
    def order(self) -> Any:
        """Order of a wrong type."""
        return 1.5


class Orderless(Breaking, breaks="resolution_and_order_are_told"):
    """Declares an order that is not an integer."""

    settings = OrderlessSettings


@dataclass(frozen=True)
class HalfSettings(TinySettings):
    """Settings with an unknown precision."""

    precision: ClassVar[str] = "half"


class Half(Breaking, breaks="precision_is_told"):
    """Declares an unknown precision."""

    settings = HalfSettings


@dataclass(frozen=True)
class LaxSettings(TinySettings):
    """Settings that accept any step."""

    dt: float = 1e-3


class Lax(Breaking, breaks="bad_settings_give_one_line"):
    """Accepts a negative step."""

    settings = LaxSettings


class Boastful(Breaking, breaks="provides_what_it_says"):
    """Declares rolling resistance, but refuses every scene with it."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> RunOnBody:
        """Refuses scenes with rolling resistance."""
        if MechanismCapability.TURNING_FRICTION in scene.requires:
            raise Refused("no resistance, after all")
        return super().build(scene, settings)


class Floating(Breaking, breaks="provides_for_some_scene"):
    """Provides only a capability that no scene requires."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {"midpoint": frozenset({"levitation"})}


class Silent(Breaking, breaks="builds_or_refuses"):
    """Refuses scenes without a reason."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> RunOnBody:
        """Refuses scenes without resistance to rolling with an empty text."""
        if MechanismCapability.TURNING_FRICTION not in scene.requires:
            raise Refused("")
        return super().build(scene, settings)


class Heavy(Breaking, breaks="certificate_holds"):
    """Builds a ball of twice the inertia."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        ball = placed(scene).ball
        heavy = dataclasses.replace(ball, inertia_ratio=2 * ball.inertia_ratio)
        super().__init__(scene_with(scene, ball=heavy), settings)


class Doubled(Heavy, breaks="certificate_holds"):
    """Builds a ball of twice the mass, and declares the mass as regularised."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        ball = placed(scene).ball
        Tiny.__init__(self, scene_with(scene, ball=dataclasses.replace(ball, mass=2 * ball.mass)), settings)

    def built(self) -> BallBuilt:
        """Model with an excuse for everything."""
        return _excused(super().built())


class Pulled(Breaking, breaks="certificate_holds"):
    """Builds 1.5 times the gravity, and declares gravity as regularised."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        gravity = dataclasses.replace(gravity_of(scene), magnitude=1.5 * gravity_of(scene).magnitude)
        super().__init__(scene_with(scene, gravity=gravity), settings)

    def built(self) -> BallBuilt:
        """Model with an excuse for everything."""
        return _excused(super().built())


def _excused(built: BallBuilt) -> BallBuilt:
    """Certificate data with an infinite tolerance for every quantity."""
    names = ("mass", "inertia", "gravity", "position", "acceleration", "angular acceleration", "N", "F2", "F3")
    excuse = Regularised(float("inf"), "our engine is soft")
    return dataclasses.replace(built, regularised=dict.fromkeys(names, excuse))


class Mute(Breaking):
    """Reports only the rolling resistance of its model, and no force."""

    def built(self) -> BallBuilt:
        """Certificate data with the scene's rolling resistance alone."""
        return BallBuilt(rolling_resistance=self.body.contact.rolling_resistance)

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, force=None)


class Damped(Mute, breaks="first_steps_fit_the_scene"):
    """Damps its velocity by 4 % per second without declaring it."""

    def rates(self, x: Any) -> Any:
        """Rates with damping."""
        return super().rates(x) - np.array([0, 0, 0.04, 0.04, 0.04]) * x


class Clamped(Mute, breaks="first_steps_fit_the_scene"):
    """Clamps its angular velocity at 30 rad/s after the start without declaring it."""

    def _told(self, right: BallSample) -> BallSample:
        silent = super()._told(right)
        return dataclasses.replace(silent, w_WB=np.clip(silent.w_WB, -30, 30) if self.t else silent.w_WB)


class Unresisting(Mute, breaks="first_steps_fit_the_scene"):
    """Reports rolling resistance, but ignores it."""

    def rates(self, x: Any) -> Any:
        """Rates without rolling resistance."""
        contact = dataclasses.replace(self.body.contact, rolling_resistance=0.0)
        return reduced_rates(dataclasses.replace(self.body, contact=contact), x)[0]


class Drifting(Breaking, breaks="moves_as_the_truth"):
    """Reports positions that move 0.1 % faster than its velocity."""

    def _told(self, right: BallSample) -> BallSample:
        ahead = self.body.surface.position(self.x[:2] + 1e-3 * self.t * self.x[2:4])
        return dataclasses.replace(right, p_WB=ahead)


class Beating(Breaking, breaks="moves_as_the_truth"):
    """Adds an oscillation to the position that is zero at every hundredth of a second, the usual samples."""

    def _told(self, right: BallSample) -> BallSample:
        along = self.body.surface.frame(self.x[:2])[:, 2]
        return dataclasses.replace(right, p_WB=right.p_WB + 1e-4 * np.sin(200 * np.pi * self.t) * along)


class Wasteful(Breaking, breaks="builds_only_what_is_required"):
    """Builds rolling resistance that the scene does not require."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.resists = True  # a torque of zero is a torque all the same


class Thrifty(Breaking, breaks="builds_only_what_is_required"):
    """Reports a model without terms that the scene requires."""

    def built(self) -> BallBuilt:
        """Certificate data without optional terms."""
        return dataclasses.replace(super().built(), terms=frozenset())


class Turning(Breaking, breaks="builds_only_what_is_required"):
    """Integrates an orientation that the scene does not ask for, without a declared reason."""

    def built(self) -> BallBuilt:
        """Certificate data with the orientation among the terms."""
        right = super().built()
        return dataclasses.replace(right, terms=(right.terms or frozenset()) | {MechanismCapability.ORIENTATION})

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, q_WB=np.array([1.0, 0, 0, 0]))


class Row(Breaking, breaks="samples_are_well_formed"):
    """Reports positions of shape (3, 1)."""

    def _told(self, right: BallSample) -> BallSample:
        return BallSample(right.p_WB[:, None], right.v_WB, right.w_WB)


class Stretched(Breaking, breaks="samples_are_well_formed"):
    """Reports quaternions of length 1.01 after the start."""

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, q_WB=np.array([1.01 if self.t else 1.0, 0, 0, 0]))


class Hushed(Breaking, breaks="samples_are_well_formed"):
    """Reports a force at time 0 only."""

    def _told(self, right: BallSample) -> BallSample:
        return right if self.t == 0 else dataclasses.replace(right, force=None)


class Secretly(Breaking, breaks="samples_are_well_formed"):
    """Keeps its state in single precision without declaring it; velocities are computed in double precision."""

    @property
    def x(self) -> Any:
        """State as doubles."""
        return np.array(self.own, dtype=np.float64)

    @x.setter
    def x(self, value: Any) -> None:
        self.own = np.array(value, dtype=np.float32)

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, p_WB=right.p_WB.astype(np.float32).astype(np.float64))


class Views(Breaking, breaks="reading_back_changes_nothing"):
    """Returns the array that it changes in later steps."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.p = np.zeros(3)

    def _told(self, right: BallSample) -> BallSample:
        self.p[:] = right.p_WB
        return BallSample(self.p, right.v_WB, right.w_WB, force=right.force)

    def advance(self, t: float) -> None:
        """Advances, and overwrites the last sample's position."""
        super().advance(t)
        self.sample()


class OneBuffer(Breaking, breaks="reading_back_changes_nothing"):
    """Returns the same arrays each time, overwritten by the next sample."""

    buffer: BallSample | None = None

    def _told(self, right: BallSample) -> BallSample:
        if self.buffer is None:
            self.buffer = right
        for name in ("p_WB", "v_WB", "w_WB", "force"):
            getattr(self.buffer, name)[:] = getattr(right, name)
        return self.buffer


class OneForAll(OneBuffer, breaks="reading_back_changes_nothing"):
    """Returns the same arrays from all its runs."""

    def _told(self, right: BallSample) -> BallSample:
        if OneForAll.buffer is None:
            OneForAll.buffer = right
        return super()._told(right)


class Moody(Breaking, breaks="advance_is_repeatable"):
    """Moves a little differently each time it is built."""

    count = 0

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        Moody.count += 1
        self.x = self.x * (1 + 1e-15 * Moody.count)


class Forgetful(Breaking, breaks="advance_in_two_parts"):
    """Omits a step in each call of advance."""

    def advance(self, t: float) -> None:
        """Advances by one step less than required."""
        if t > self.t:
            self.t += self.dt
        super().advance(t)


class Restless(Breaking, breaks="sampling_changes_nothing"):
    """Changes its state when it is sampled."""

    def _told(self, right: BallSample) -> BallSample:
        if self.t > 0:
            self.x = self.x * (1 + 1e-15)
        return right


class Lazy(Breaking, breaks="samples_cost_the_same"):
    """Defers its slow steps from ``advance`` to ``sample``."""

    due = 0.0

    def advance(self, t: float) -> None:
        """Records the time."""
        self.due = t

    def sample(self) -> BallSample:
        """State after the deferred steps."""
        while self.t < self.due - self.dt / 2:
            time.sleep(2e-3)
            super().advance(min(self.t + self.dt, self.due))
        return super().sample()


class HandedOver(Lazy, breaks="samples_cost_the_same"):
    """Defers cheap steps to ``sample``; a call of ``advance`` costs more than a hundred of them."""

    def advance(self, t: float) -> None:
        """Records the time, with a fixed cost."""
        time.sleep(5e-3)
        super().advance(t)

    def sample(self) -> BallSample:
        """State after the deferred steps, with a fixed cost for the sample."""
        time.sleep(2e-3 + 2e-5 * (self.due - self.t) / self.dt)
        self.t = self.due
        return Tiny.sample(self)


class Shared(Breaking, breaks="engines_do_not_disturb_each_other"):
    """Keeps the state of all its runs in one place."""

    state: ClassVar[dict[str, Any]] = {}

    @property
    def x(self) -> Any:
        """State of the run that moved last."""
        return Shared.state["x"]

    @x.setter
    def x(self, value: Any) -> None:
        Shared.state["x"] = value


class Millimetres(Breaking, breaks="velocities_are_the_rates"):
    """Reports velocities in mm/s after the start."""

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, v_WB=right.v_WB * (1000 if self.t else 1))


class BodyFrame(Breaking, breaks="velocities_are_the_rates"):
    """Reports a constant orientation, though its angular velocity is not zero."""

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, q_WB=np.array([1.0, 0, 0, 0]))


class FirstOrder(Breaking, breaks="order_is_as_declared"):
    """Declares order 2, but has order 1."""

    def advance(self, t: float) -> None:
        """Advances by Euler's method."""
        for _ in range(round((t - self.t) / self.dt)):
            self.x = self.x + self.dt * self.rates(self.x)
        self.t = t


@dataclass(frozen=True)
class AdaptiveSettings:
    """Settings with a tolerance that has no effect."""

    formulation: str = "midpoint"
    preset: str = "matched"
    rtol: float = 1e-10
    resolution: ClassVar[str] = "rtol"
    order: ClassVar[None] = None
    dt: ClassVar[float] = 1e-3


class Deaf(Breaking, breaks="tolerance_has_an_effect"):
    """Has a tolerance without effect."""

    settings = AdaptiveSettings
