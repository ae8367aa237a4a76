"""Engines that each break one promise of the protocol; ``FAILS`` says which check must notice."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from tiny import Tiny, TinySettings

from proofroll.core.engine import Regularised
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import changed
from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.elements.ball_on_surface.rolling_equations import reduced_rates
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample

FAILS: dict[type[Tiny], str] = {}


class Breaking(Tiny):
    """An engine that the check ``breaks`` must notice. Settings of its own are its only preset."""

    def __init_subclass__(cls, breaks: str = "") -> None:
        """Lists it."""
        if breaks:
            FAILS[cls] = breaks
        if "settings" in vars(cls):
            cls.presets = {"midpoint": {"matched": cls.settings()}}

    def sample(self) -> BallSample:
        """Sample as reported, right or not."""
        return self._told(super().sample())

    def _told(self, right: BallSample) -> BallSample:
        return right


class Unannounced(Breaking, breaks="name_is_the_entry_point"):
    """No package has an entry point of this name."""

    name = "unannounced"


class Versionless(Breaking, breaks="version_is_told"):
    """The version is a number."""

    @staticmethod
    def version() -> Any:
        """Not text."""
        return 2


class ProvidesText(Breaking, breaks="provides_capabilities"):
    """Says what it provides in its own words."""

    provides: ClassVar[Any] = frozenset({"rolling", BallCapability.ROLLING})


@dataclass
class MutableSettings:
    """Not frozen."""

    formulation: str = "midpoint"
    preset: str = "matched"
    dt: float = 1e-3
    resolution: ClassVar[str] = "dt"
    order: ClassVar[int] = 2


class Mutable(Breaking, breaks="settings_are_a_frozen_dataclass"):
    """Its settings can be changed after the fact."""

    settings = MutableSettings


class MixedUp(Breaking, breaks="presets_are_complete"):
    """Its preset calls itself something else."""

    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"default": TinySettings()}}


@dataclass(frozen=True)
class OrderlessSettings(TinySettings):
    """A step, and no whole order."""

    @property
    def order(self) -> Any:
        """Half an order."""
        return 1.5


class Orderless(Breaking, breaks="resolution_and_order_are_told"):
    """Says no order that is one."""

    settings = OrderlessSettings


@dataclass(frozen=True)
class HalfSettings(TinySettings):
    """An unknown precision."""

    precision: ClassVar[str] = "half"


class Half(Breaking, breaks="precision_is_told"):
    """Computes in neither single nor double precision."""

    settings = HalfSettings


@dataclass(frozen=True)
class LaxSettings(TinySettings):
    """Takes any step."""

    dt: float = 1e-3


class Lax(Breaking, breaks="bad_settings_give_one_line"):
    """Accepts a negative step."""

    settings = LaxSettings


class Boastful(Breaking, breaks="provides_what_it_says"):
    """Says that it provides rolling resistance, and refuses every scene with it."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """Refuses what it said it provides."""
        if BallCapability.ROLLING_RESISTANCE in scene.requires:
            raise Refused("no resistance, after all")
        return super().build(scene, settings)


class Floating(Breaking, breaks="provides_for_some_scene"):
    """Provides what no scene requires, and nothing else."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {"midpoint": frozenset({"levitation"})}


class Silent(Breaking, breaks="builds_or_refuses"):
    """Refuses without a word."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """No reason given."""
        if BallCapability.CURVED_SURFACE not in scene.requires:
            raise Refused("")
        return super().build(scene, settings)


class Heavy(Breaking, breaks="certificate_holds"):
    """Builds a ball of twice the inertia."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        ball = scene.elements[0].ball
        heavy = dataclasses.replace(ball, inertia_ratio=2 * ball.inertia_ratio)
        super().__init__(changed(scene, ball=heavy), settings)


class Doubled(Heavy, breaks="certificate_holds"):
    """Builds a ball of twice the mass, and calls that a softened mass."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        ball = scene.elements[0].ball
        Tiny.__init__(self, changed(scene, ball=dataclasses.replace(ball, mass=2 * ball.mass)), settings)

    def built(self) -> BallBuilt:
        """Model with an excuse for everything."""
        return _excused(super().built())


class Pulled(Breaking, breaks="certificate_holds"):
    """Lives in one and a half times the gravity, and calls that softened."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        gravity = dataclasses.replace(scene.elements[0].gravity, magnitude=1.5 * scene.elements[0].gravity.magnitude)
        super().__init__(changed(scene, gravity=gravity), settings)

    def built(self) -> BallBuilt:
        """Model with an excuse for everything."""
        return _excused(super().built())


def _excused(built: BallBuilt) -> BallBuilt:
    """The same with every quantity softened without limit."""
    names = ("mass", "inertia", "gravity", "position", "acceleration", "angular acceleration", "N", "F2", "F3")
    excuse = Regularised(float("inf"), "our engine is soft")
    return dataclasses.replace(built, regularised=dict.fromkeys(names, excuse))


class Mute(Breaking):
    """Says nothing of what it built but what it must, and gives no force."""

    def built(self) -> BallBuilt:
        """The scene's own resistance, whatever it does with it."""
        return BallBuilt(rolling_resistance=self.body.contact.rolling_resistance)

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, force=None)


class Damped(Mute, breaks="first_steps_fit_the_scene"):
    """Its velocity is damped by 4 % per second, and it does not say so."""

    def rates(self, x: Any) -> Any:
        """Rates with damping."""
        return super().rates(x) - np.array([0, 0, 0.04, 0.04, 0.04]) * x


class Clamped(Mute, breaks="first_steps_fit_the_scene"):
    """Its spin is clamped at 30 rad/s as soon as it moves, and it does not say so."""

    def _told(self, right: BallSample) -> BallSample:
        silent = super()._told(right)
        return dataclasses.replace(silent, w_WB=np.clip(silent.w_WB, -30, 30) if self.t else silent.w_WB)


class Unresisting(Mute, breaks="first_steps_fit_the_scene"):
    """Says that there is rolling resistance, and ignores it."""

    def rates(self, x: Any) -> Any:
        """Rates without it."""
        contact = dataclasses.replace(self.body.contact, rolling_resistance=0.0)
        return reduced_rates(dataclasses.replace(self.body, contact=contact), x)[0]


class Drifting(Breaking, breaks="moves_as_the_truth"):
    """Its position moves by a thousandth faster than its velocity says."""

    def _told(self, right: BallSample) -> BallSample:
        ahead = self.body.surface.position(self.x[:2] + 1e-3 * self.t * self.x[2:4])
        return dataclasses.replace(right, p_WB=ahead)


class Beating(Breaking, breaks="moves_as_the_truth"):
    """Off by a beat that is over at every hundredth of a second, where everybody samples."""

    def _told(self, right: BallSample) -> BallSample:
        along = self.body.surface.frame(self.x[:2])[:, 2]
        return dataclasses.replace(right, p_WB=right.p_WB + 1e-4 * np.sin(200 * np.pi * self.t) * along)


class Wasteful(Breaking, breaks="builds_only_what_is_required"):
    """Carries rolling resistance along that was not asked for."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.resists = True  # a torque of zero is a torque all the same


class Thrifty(Breaking, breaks="builds_only_what_is_required"):
    """Leaves out what the scene requires."""

    def built(self) -> BallBuilt:
        """Nothing but rolling."""
        return dataclasses.replace(super().built(), terms=frozenset())


class Turning(Breaking, breaks="builds_only_what_is_required"):
    """Follows the orientation without being asked, and without saying why."""

    def built(self) -> BallBuilt:
        """Among its terms."""
        right = super().built()
        return dataclasses.replace(right, terms=(right.terms or frozenset()) | {BallCapability.ORIENTATION})

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, q_WB=np.array([1.0, 0, 0, 0]))


class Row(Breaking, breaks="samples_are_well_formed"):
    """Gives its position as a row of a matrix."""

    def _told(self, right: BallSample) -> BallSample:
        return BallSample(right.p_WB[None], right.v_WB, right.w_WB)


class Stretched(Breaking, breaks="samples_are_well_formed"):
    """Gives quaternions that grow longer on the way."""

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, q_WB=np.array([1.01 if self.t else 1.0, 0, 0, 0]))


class Hushed(Breaking, breaks="samples_are_well_formed"):
    """Gives a force at time 0, and none later."""

    def _told(self, right: BallSample) -> BallSample:
        return right if self.t == 0 else dataclasses.replace(right, force=None)


class Secretly(Breaking, breaks="samples_are_well_formed"):
    """Computes in single precision, and does not say so; its velocity is put together in doubles."""

    @property
    def x(self) -> Any:
        """The state."""
        return np.array(self.own, dtype=np.float64)

    @x.setter
    def x(self, value: Any) -> None:
        self.own = np.array(value, dtype=np.float32)

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, p_WB=right.p_WB.astype(np.float32).astype(np.float64))


class Views(Breaking, breaks="reading_back_changes_nothing"):
    """Gives the array that it goes on working with."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.p = np.zeros(3)

    def _told(self, right: BallSample) -> BallSample:
        self.p[:] = right.p_WB
        return BallSample(self.p, right.v_WB, right.w_WB, force=right.force)

    def advance(self, t: float) -> None:
        """Moves what it gave before."""
        super().advance(t)
        self.sample()


class OneBuffer(Breaking, breaks="reading_back_changes_nothing"):
    """Gives the same arrays each time, which the next sample fills anew."""

    buffer: BallSample | None = None

    def _told(self, right: BallSample) -> BallSample:
        if self.buffer is None:
            self.buffer = right
        for name in ("p_WB", "v_WB", "w_WB", "force"):
            getattr(self.buffer, name)[:] = getattr(right, name)
        return self.buffer


class OneForAll(OneBuffer, breaks="reading_back_changes_nothing"):
    """The same for all that are built."""

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
    """Leaves out a step whenever it is stopped."""

    def advance(self, t: float) -> None:
        """Starts late."""
        if t > self.t:
            self.t += self.dt
        super().advance(t)


class Restless(Breaking, breaks="sampling_changes_nothing"):
    """Moves when it is looked at."""

    def _told(self, right: BallSample) -> BallSample:
        if self.t > 0:
            self.x = self.x * (1 + 1e-15)
        return right


class Lazy(Breaking, breaks="samples_cost_the_same"):
    """Notes the time, and moves when it is looked at; each step takes a while."""

    due = 0.0

    def advance(self, t: float) -> None:
        """Later."""
        self.due = t

    def sample(self) -> BallSample:
        """State after the steps that were put off."""
        while self.t < self.due - self.dt / 2:
            time.sleep(2e-3)
            super().advance(min(self.t + self.dt, self.due))
        return super().sample()


class HandedOver(Lazy, breaks="samples_cost_the_same"):
    """Hands its cheap steps over, which costs more than a hundred of them."""

    def advance(self, t: float) -> None:
        """Later."""
        time.sleep(5e-3)
        super().advance(t)

    def sample(self) -> BallSample:
        """State after the steps that were put off, and a moment for the look at it."""
        time.sleep(2e-3 + 2e-5 * (self.due - self.t) / self.dt)
        self.t = self.due
        return Tiny.sample(self)


class Shared(Breaking, breaks="engines_do_not_disturb_each_other"):
    """Keeps its state where every other one keeps it too."""

    state: ClassVar[dict[str, Any]] = {}

    @property
    def x(self) -> Any:
        """The state of whoever moved last."""
        return Shared.state["x"]

    @x.setter
    def x(self, value: Any) -> None:
        Shared.state["x"] = value


class Millimetres(Breaking, breaks="velocities_are_the_rates"):
    """Gives its velocity in mm/s, but only after the start."""

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, v_WB=right.v_WB * (1000 if self.t else 1))


class BodyFrame(Breaking, breaks="velocities_are_the_rates"):
    """Gives an orientation that does not turn as its angular velocity says."""

    def _told(self, right: BallSample) -> BallSample:
        return dataclasses.replace(right, q_WB=np.array([1.0, 0, 0, 0]))


class FirstOrder(Breaking, breaks="order_is_as_declared"):
    """Declares the second order and has the first."""

    def advance(self, t: float) -> None:
        """Euler."""
        for _ in range(round((t - self.t) / self.dt)):
            self.x = self.x + self.dt * self.rates(self.x)
        self.t = t


@dataclass(frozen=True)
class AdaptiveSettings:
    """A tolerance without effect."""

    formulation: str = "midpoint"
    preset: str = "matched"
    rtol: float = 1e-10
    resolution: ClassVar[str] = "rtol"
    order: ClassVar[None] = None
    dt: ClassVar[float] = 1e-3


class Deaf(Breaking, breaks="tolerance_has_an_effect"):
    """Its tolerance does nothing."""

    settings = AdaptiveSettings
