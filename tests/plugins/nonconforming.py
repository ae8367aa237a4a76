"""Engines that each break one promise of the protocol; ``FAILS`` says which check must notice."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from tiny import Tiny, TinySettings

from proofroll.core.engine import Built, Regularised, Sample
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import changed
from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.elements.ball_on_surface.rolling_equations import reduced_rates


class Unannounced(Tiny):
    """No package has an entry point of this name."""

    name = "unannounced"


class Versionless(Tiny):
    """The version is a number."""

    @staticmethod
    def version() -> Any:
        """Not text."""
        return 2


class ProvidesText(Tiny):
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


class Mutable(Tiny):
    """Its settings can be changed after the fact."""

    settings = MutableSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"matched": MutableSettings()}}


class MixedUp(Tiny):
    """Its preset calls itself something else."""

    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"default": TinySettings()}}


@dataclass(frozen=True)
class OrderlessSettings(TinySettings):
    """A step, and no whole order."""

    @property
    def order(self) -> Any:
        """Half an order."""
        return 1.5


class Orderless(Tiny):
    """Says no order that is one."""

    settings = OrderlessSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"matched": OrderlessSettings()}}


@dataclass(frozen=True)
class LaxSettings(TinySettings):
    """Takes any step."""

    dt: float = 1e-3


class Lax(Tiny):
    """Accepts a negative step."""

    settings = LaxSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"matched": LaxSettings()}}


class Boastful(Tiny):
    """Says that it provides rolling resistance, and refuses every scene with it."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """Refuses what it said it provides."""
        if BallCapability.ROLLING_RESISTANCE in scene.requires:
            raise Refused("no resistance, after all")
        return super().build(scene, settings)


class Floating(Tiny):
    """Provides what no scene requires, and nothing else."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {"midpoint": frozenset({"levitation"})}


class Silent(Tiny):
    """Refuses without a word."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """No reason given."""
        if BallCapability.CURVED_SURFACE not in scene.requires:
            raise Refused("")
        return super().build(scene, settings)


class Heavy(Tiny):
    """Builds a ball of twice the inertia."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        ball = scene.elements[0].ball
        heavy = dataclasses.replace(ball, inertia_ratio=2 * ball.inertia_ratio)
        super().__init__(changed(scene, ball=heavy), settings)


class Doubled(Heavy):
    """Builds a ball of twice the mass, and calls that a softened mass."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        ball = scene.elements[0].ball
        Tiny.__init__(self, changed(scene, ball=dataclasses.replace(ball, mass=2 * ball.mass)), settings)

    def built(self) -> Built:
        """With an excuse for everything."""
        return _excused(super().built())


class Pulled(Tiny):
    """Lives in one and a half times the gravity, and calls that softened."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        gravity = dataclasses.replace(scene.elements[0].gravity, magnitude=1.5 * scene.elements[0].gravity.magnitude)
        super().__init__(changed(scene, gravity=gravity), settings)

    def built(self) -> Built:
        """With an excuse for everything."""
        return _excused(super().built())


def _excused(built: Built) -> Built:
    """The same with every quantity softened without limit."""
    names = ("mass", "inertia", "gravity", "position", "acceleration", "angular acceleration", "N", "F2", "F3")
    excuse = Regularised(float("inf"), "our engine is soft")
    return dataclasses.replace(built, regularised=dict.fromkeys(names, excuse))


class Mute(Tiny):
    """Says nothing of what it built but what it must, and gives no force."""

    def built(self) -> Built:
        """The scene's own resistance, whatever it does with it."""
        return Built(rolling_resistance=self.body.contact.rolling_resistance)

    def sample(self) -> Sample:
        """The state alone."""
        return dataclasses.replace(super().sample(), force=None)


class Damped(Mute):
    """Its velocity is damped by 4 % per second, and it does not say so."""

    def rates(self, x: Any) -> Any:
        """With damping."""
        return super().rates(x) - np.array([0, 0, 0.04, 0.04, 0.04]) * x


class Clamped(Mute):
    """Its spin is clamped at 30 rad/s as soon as it moves, and it does not say so."""

    def sample(self) -> Sample:
        """Never faster."""
        right = super().sample()
        return dataclasses.replace(right, w_WB=np.clip(right.w_WB, -30, 30) if self.t else right.w_WB)


class Unresisting(Mute):
    """Says that there is rolling resistance, and ignores it."""

    def rates(self, x: Any) -> Any:
        """Without."""
        contact = dataclasses.replace(self.body.contact, rolling_resistance=0.0)
        return reduced_rates(dataclasses.replace(self.body, contact=contact), x)[0]


class Drifting(Tiny):
    """Its position moves by a thousandth faster than its velocity says."""

    def sample(self) -> Sample:
        """Ahead of itself."""
        right = super().sample()
        ahead = self.body.surface.position(self.x[:2] + 1e-3 * self.t * self.x[2:4])
        return dataclasses.replace(right, p_WB=ahead)


class Beating(Tiny):
    """Off by a beat that is over at every hundredth of a second, where everybody samples."""

    def sample(self) -> Sample:
        """A tenth of a millimetre along the wall."""
        right = super().sample()
        along = self.body.surface.frame(self.x[:2])[:, 2]
        return dataclasses.replace(right, p_WB=right.p_WB + 1e-4 * np.sin(200 * np.pi * self.t) * along)


class Wasteful(Tiny):
    """Carries rolling resistance along where nobody asked for it."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.resists = True  # a torque of zero is a torque all the same


class Thrifty(Tiny):
    """Leaves out what the scene requires."""

    def built(self) -> Built:
        """Nothing but rolling."""
        return dataclasses.replace(super().built(), terms=frozenset())


class Turning(Tiny):
    """Follows the orientation without being asked, and without saying why."""

    def built(self) -> Built:
        """Among its terms."""
        right = super().built()
        return dataclasses.replace(right, terms=(right.terms or frozenset()) | {BallCapability.ORIENTATION})

    def sample(self) -> Sample:
        """With an orientation."""
        return dataclasses.replace(super().sample(), q_WB=np.array([1.0, 0, 0, 0]))


class Row(Tiny):
    """Gives its position as a row of a matrix."""

    def sample(self) -> Sample:
        """The wrong shape."""
        right = super().sample()
        return Sample(right.p_WB[None], right.v_WB, right.w_WB)


class Hushed(Tiny):
    """Gives a force at time 0, and none later."""

    def sample(self) -> Sample:
        """Falls silent."""
        right = super().sample()
        return right if self.t == 0 else dataclasses.replace(right, force=None)


class Views(Tiny):
    """Gives the array that it goes on working with."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.p = np.zeros(3)

    def sample(self) -> Sample:
        """Overwrites what it gave before."""
        right = super().sample()
        self.p[:] = right.p_WB
        return Sample(self.p, right.v_WB, right.w_WB, force=right.force)

    def advance(self, t: float) -> None:
        """Moves what it gave before."""
        super().advance(t)
        self.sample()


class Moody(Tiny):
    """Moves a little differently each time it is built."""

    count = 0

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        Moody.count += 1
        self.x = self.x * (1 + 1e-15 * Moody.count)


class Forgetful(Tiny):
    """Leaves out a step whenever it is stopped."""

    def advance(self, t: float) -> None:
        """Starts late."""
        if t > self.t:
            self.t += self.dt
        super().advance(t)


class Restless(Tiny):
    """Moves when it is looked at."""

    def sample(self) -> Sample:
        """Not innocent."""
        right = super().sample()
        if self.t > 0:
            self.x = self.x * (1 + 1e-15)
        return right


class Shared(Tiny):
    """Keeps its state where every other one keeps it too."""

    state: ClassVar[dict[str, Any]] = {}

    @property
    def x(self) -> Any:
        """The state of whoever moved last."""
        return Shared.state["x"]

    @x.setter
    def x(self, value: Any) -> None:
        Shared.state["x"] = value


class Millimetres(Tiny):
    """Gives its velocity in mm/s, but only after the start."""

    def sample(self) -> Sample:
        """The wrong unit."""
        right = super().sample()
        return dataclasses.replace(right, v_WB=right.v_WB * (1000 if self.t else 1))


class BodyFrame(Tiny):
    """Gives an orientation that does not turn as its angular velocity says."""

    def sample(self) -> Sample:
        """Stands still."""
        return dataclasses.replace(super().sample(), q_WB=np.array([1.0, 0, 0, 0]))


class FirstOrder(Tiny):
    """Declares the second order and has the first."""

    def advance(self, t: float) -> None:
        """Euler."""
        for _ in range(round((t - self.t) / self.dt)):
            self.x = self.x + self.dt * self.rates(self.x)
        self.t = t


@dataclass(frozen=True)
class AdaptiveSettings:
    """A tolerance that nobody looks at."""

    formulation: str = "midpoint"
    preset: str = "matched"
    rtol: float = 1e-10
    resolution: ClassVar[str] = "rtol"
    order: ClassVar[None] = None
    dt: ClassVar[float] = 1e-3


class Deaf(Tiny):
    """Its tolerance does nothing."""

    settings = AdaptiveSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"matched": AdaptiveSettings()}}


FAILS: Mapping[type[Tiny], str] = {
    Unannounced: "name_is_the_entry_point",
    Versionless: "version_is_told",
    ProvidesText: "provides_capabilities",
    Mutable: "settings_are_a_frozen_dataclass",
    MixedUp: "presets_are_complete",
    Orderless: "resolution_and_order_are_told",
    Lax: "bad_settings_give_one_line",
    Boastful: "provides_what_it_says",
    Floating: "provides_for_some_scene",
    Silent: "builds_or_refuses",
    Heavy: "certificate_holds",
    Doubled: "certificate_holds",
    Pulled: "certificate_holds",
    Damped: "first_steps_fit_the_scene",
    Clamped: "first_steps_fit_the_scene",
    Unresisting: "first_steps_fit_the_scene",
    Drifting: "moves_as_the_truth",
    Beating: "moves_as_the_truth",
    Wasteful: "builds_only_what_is_required",
    Thrifty: "builds_only_what_is_required",
    Turning: "builds_only_what_is_required",
    Row: "samples_are_well_formed",
    Hushed: "samples_are_well_formed",
    Views: "reading_back_changes_nothing",
    Moody: "advance_is_repeatable",
    Forgetful: "advance_in_two_parts",
    Restless: "sampling_changes_nothing",
    Shared: "engines_do_not_disturb_each_other",
    Millimetres: "velocities_are_the_rates",
    BodyFrame: "velocities_are_the_rates",
    FirstOrder: "order_is_as_declared",
    Deaf: "tolerance_has_an_effect",
}
