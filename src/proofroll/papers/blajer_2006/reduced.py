"""Minimal model of a ball that rolls on a surface: a closed form, or five equations without constraints."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from annotated_types import Gt
from typing_extensions import override

import proofroll
from proofroll.core.arrays import FloatArray, cross
from proofroll.core.engine_abilities import Level, Term, require_provided
from proofroll.core.errors import Diverged, Refused, refuse_first
from proofroll.core.heyoka_library import TIGHTEST, require_heyoka, with_heyoka
from proofroll.core.integrators import DormandPrince853
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.contacts.family import Family, of_contact
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.compiled.rolling import parameters, reduced
from proofroll.papers.blajer_2006.ball.compiled.rolling import start as start_along_arc
from proofroll.papers.blajer_2006.ball.compiled.series import Series, still_moving
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion, natural_speed, world_motion
from proofroll.papers.blajer_2006.ball.model import NO_OTHER_BODIES, ROLLS, RollingBall
from proofroll.papers.blajer_2006.ball.rolling_equations import closed_form, placed, reduced_rates, start
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held

# Least step as a part of the interval to the next sample; a shorter one means divergence.
_STUCK = 1e-12


class ReducedModel(ABC):
    """Run of a minimal model; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall) -> None:
        self._body = body

    @abstractmethod
    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""

    @abstractmethod
    def motion(self) -> BallMotion:
        """Present state and contact force, each shape (1, 3)."""

    def spin_rate(self) -> float | None:
        """Present rate of the spin about the normal, ω̇1 [rad/s²]; None: the model has no equation for it."""
        return None

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`. The model has no orientation."""
        motion = self.motion()
        return BallSample(
            p_WB=motion.p_WB[0].copy(),
            v_WB=motion.v_WB[0].copy(),
            w_WB=motion.w_WB[0].copy(),
            force=motion.force[0].copy(),
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        body, motion = self._body, self.motion()
        ball, f = body.ball, body.contact.rolling_resistance
        acceleration = motion.force[0] / ball.mass + body.gravity
        return BallBuilt(
            mass=ball.mass,
            inertia=np.full(3, ball.inertia),
            gravity=body.gravity.copy(),
            ball_radius=ball.radius,
            rolling_resistance=f,
            acceleration=acceleration,
            angular_acceleration=self._turning(motion.p_WB[0], motion.v_WB[0], motion.w_WB[0], acceleration),
            terms=terms_held(resists=f),
        )

    def _turning(self, p: FloatArray, v: FloatArray, w: FloatArray, acceleration: FloatArray) -> FloatArray | None:
        """Angular acceleration [rad/s²], shape (3,): rate of ω = ω1 e1 - e1 × v / a; None without a rate of ω1."""
        spin_rate, surface = self.spin_rate(), self._body.surface
        if spin_rate is None:
            return None
        e1 = surface.normal(p)
        e1_rate = surface.normal_gradient(p) @ v
        swung = cross(e1_rate, v) + cross(e1, acceleration)
        return np.asarray(spin_rate * e1 + (w @ e1) * e1_rate - swung / self._body.ball.radius)


class ClosedFormModel(ReducedModel):
    """Run by the closed form of the motion. Raises Refused where none is known."""

    def __init__(self, body: RollingBall) -> None:
        if body.contact.rolling_resistance > 0:
            raise Refused("there is no closed form with rolling resistance; take formulation=equations")
        super().__init__(body)
        self.advance(0.0)

    @override
    def advance(self, t: float) -> None:
        motion = closed_form(self._body, np.array([t]))
        assert motion is not None  # without resistance
        self._motion = motion

    @override
    def motion(self) -> BallMotion:
        return self._motion


class Integrated(ReducedModel):
    """The reduced equations by Dormand and Prince's method of order 8; a step ends at each sample."""

    def __init__(self, body: RollingBall, rtol: float) -> None:
        super().__init__(body)
        self._span = 0.0
        speed = natural_speed(body)
        self._scales = np.array(body.surface.length_scales)
        a, per_metre = body.ball.radius, 1 / self._scales
        scales = np.concatenate([a * per_metre, speed * per_metre, [speed / a]])
        x = start(body)
        self._motion = DormandPrince853(rtol)
        self._motion.begin(0.0, x, lambda x: reduced_rates(body, x)[0], self._accepted, scales)
        self._last, self._until = (0.0, x), 0.0

    @override
    def advance(self, t: float) -> None:
        self._span, self._until = t - self._motion.t, t
        self._motion.advance(t)

    def _accepted(self, t: float, x: FloatArray) -> FloatArray:
        (t_old, y), self._last = self._last, (t, x)
        if t < self._until and t - t_old < _STUCK * self._span:
            raise Diverged(f"the step size fell to nothing at t = {t:.6g} s")
        if not np.all(np.isfinite(x)):
            raise Diverged(f"the state is not finite (NaN or overflow) at t = {t:.6g} s")
        if self._body.contact.rolling_resistance > 0:
            still_moving(self._along(y), t, self._along(x))
        return x

    def _along(self, x: FloatArray) -> FloatArray:
        """Velocity of the centre along the coordinates [m/s], shape (2,)."""
        return np.asarray(x[2:4] * self._scales)

    @override
    def motion(self) -> BallMotion:
        x = self._motion.x
        _, v, force = reduced_rates(self._body, x)
        return BallMotion(*placed(self._body, x[None, :], v[None, :]), force[None, :], "reduced equations")

    @override
    def spin_rate(self) -> float:
        return float(reduced_rates(self._body, self._motion.x)[0][4])


class Compiled(ReducedModel):
    """Reduced equations by compiled Taylor series."""

    def __init__(self, body: RollingBall, rtol: float) -> None:
        require_heyoka("integrator=taylor")
        super().__init__(body)
        self._pars = parameters(body)
        self._resistance = body.contact.rolling_resistance > 0
        model = reduced(self._resistance, rtol)
        pars = np.array(self._pars[: len(model.integrator.pars)])
        self._evaluate = model.evaluate
        self._series = Series(model.integrator, pars, start_along_arc(body), self._check)

    def _check(self, old_state: FloatArray, t: float, x: FloatArray) -> None:
        if self._resistance:
            still_moving(old_state[2:4], t, x[2:4])

    @override
    def advance(self, t: float) -> None:
        self._series.advance(t)

    @override
    def motion(self) -> BallMotion:
        x, ball = self._series.x, self._body.ball
        held2, held3, N = self._evaluate(x, self._pars)[5:]
        return world_motion(
            self._body,
            x[None, :2] / np.array(self._body.surface.length_scales),
            velocity=x[None, 2:4],
            spin=x[4:],
            friction=-ball.mass * np.array([[held2, held3]]),
            press=ball.mass * np.array([N]),
            route="reduced equations, Taylor series",
        )

    @override
    def spin_rate(self) -> float:
        return float(self._evaluate(self._series.x, self._pars)[4])


# Least rtol of each method in double precision; scipy accepts nothing below 100 machine epsilons.
_TIGHTEST: Mapping[str, float] = {"dop853": 100 * float(np.finfo(float).eps), "taylor": TIGHTEST}


@dataclass(frozen=True)
class ReducedSettings:
    """Settings of the minimal model.

    Attributes:
        formulation: ``equations`` (integrated) or ``closed_form`` (where one is known).
        preset: source of the other values.
        integrator: ``dop853`` (scipy, on any surface) or ``taylor`` (heyoka, compiled, on a cylinder or plane); None
            in ``closed_form``.
        rtol: relative tolerance of a step [1]; None in ``closed_form``.
    """

    formulation: Literal["equations", "closed_form"] = "equations"
    preset: Literal["matched", "tuned"] = "matched"
    integrator: Literal["dop853", "taylor"] | None = "dop853"
    rtol: Annotated[float, Gt(0)] | None = _TIGHTEST["dop853"]

    def __post_init__(self) -> None:
        """Raises InputError if a setting does not belong to the formulation, is missing, or is too small."""
        refuse_first("reduced", self, self._rules())

    def _rules(self) -> Iterator[tuple[bool, str, str]]:
        if self.formulation == "closed_form":
            advice = "a closed form is not integrated; leave it out, or take formulation=equations"
            yield self.integrator is not None, "integrator", advice
            yield self.rtol is not None, "rtol", advice
        else:
            yield self.integrator is None, "integrator", f"choose one of {', '.join(_TIGHTEST)}"
            yield self.rtol is None, "rtol", f"{self.integrator} needs one, e.g. 1e-10"
            assert self.integrator is not None  # the first rule broken ends this
            assert self.rtol is not None
            tightest = _TIGHTEST[self.integrator]
            advice = f"{self.integrator} allows no less than {tightest:.3g} in double precision"
            yield self.rtol < tightest, "rtol", advice

    @property
    def resolution(self) -> Literal["rtol"] | None:
        """The setting that trades speed for accuracy; a closed form has none."""
        return "rtol" if self.formulation == "equations" else None

    @property
    def order(self) -> int | None:
        """None: every step is adaptive."""
        return None


# There is no default: no user's first model is these equations. ``tuned`` is the same model, compiled.
PRESETS: Mapping[str, Mapping[str, ReducedSettings]] = {
    "equations": {
        "matched": ReducedSettings(),
        "tuned": ReducedSettings("equations", "tuned", "taylor", _TIGHTEST["taylor"]),
    },
    "closed_form": {"matched": ReducedSettings("closed_form", "matched", None, None)},
}


class Reduced:
    """Minimal model of a rolling ball: a closed form, or five equations of motion without constraints.

    The truth's first route uses the same closed form and equations (:mod:`rolling_equations`). So agreement with the
    truth is evidence only as far as the truth's second route, which shares neither, agrees too.
    """

    name: ClassVar[str] = "reduced"
    title: ClassVar[str] = "reduced equations"
    witness: ClassVar[bool] = True
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "equations": ROLLS,
        "closed_form": ROLLS - {MechanismCapability.TURNING_FRICTION},
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "equations": NO_OTHER_BODIES,
        "closed_form": {
            **NO_OTHER_BODIES,
            MechanismCapability.TURNING_FRICTION: "there is no closed form with rolling resistance; "
            "take formulation=equations",
        },
    }
    settings: ClassVar[type[ReducedSettings]] = ReducedSettings
    presets: ClassVar[Mapping[str, Mapping[str, ReducedSettings]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {"equations": Level.REDUCED, "closed_form": Level.CLOSED_FORM}
    shares: ClassVar[Mapping[str, Sequence[str]]] = {
        "equations": ("reduced equations",),
        "closed_form": ("closed form",),
    }
    terms: ClassVar[Sequence[Term]] = ()  # a minimal model has no optional terms

    @staticmethod
    def family(_: ReducedSettings) -> Mapping[str, str]:
        """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
        return of_contact(Family.HARD)

    @staticmethod
    def version() -> str:
        """Version of proofroll, whose part the equations are; with that of heyoka where it is installed."""
        return with_heyoka(proofroll.__version__)

    @classmethod
    def build(cls, scene: Scene, settings: ReducedSettings) -> RunOnBody:
        """See :class:`proofroll.core.engine.Engine`; builds a run of one of the three models."""
        require_provided(cls, settings.formulation, scene)
        body = rolling_ball(scene)
        if settings.rtol is None:
            return on_body(ClosedFormModel(body), scene)
        return on_body((Compiled if settings.integrator == "taylor" else Integrated)(body, settings.rtol), scene)
