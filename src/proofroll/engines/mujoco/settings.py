"""Settings of MuJoCo and the presets of each formulation."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import mujoco
from annotated_types import Ge, Gt, Le

from proofroll.core.engine import Scheme
from proofroll.core.errors import InputError, Refused, refuse_first
from proofroll.core.plugins import release
from proofroll.elements.mechanism.run.capabilities import ALL_LOOPS, MechanismCapability

# MuJoCo's defaults: step [s], solref [s], solimp (dmin, dmax).
DEFAULT_STEP = 2e-3
DEFAULT_TIME_CONSTANT = 0.02
DEFAULT_IMPEDANCE = (0.9, 0.95)
# Order of RK4 for joints with a quaternion; for other joints it is 4 in every version.
ORDER_OF_TURNING = 4 if release(mujoco.__version__) >= (4,) else 2
# Least dimensions of a contact (condim) that resist sliding, and turning about the normal.
SLIDES, TURNS = 3, 4
# MuJoCo silently clips to these: mjMINIMP, mjMAXIMP, and two steps (refsafe).
SMALLEST_IMPEDANCE = 1e-4
LARGEST_IMPEDANCE = 0.9999
SHORTEST_TIME_CONSTANT = 2.0
FORCES_TIME_CONSTANT = 10.0
POSITIONS_TIME_CONSTANT = 2.25
# MuJoCo has no unbounded friction. With the elliptic cone any coefficient above the needed one gives the same motion
# to all digits (1 to 10000 tried), so this one is never reached and costs nothing. A pyramidal cone softens the
# contact by the square of the coefficient: at 100 the ball flies through the wall without a warning.
UNBOUNDED_FRICTION = 1e3
LARGEST_PYRAMIDAL_FRICTION = 1.0
# Options of the solver of loops, couplings, stops, dry friction and contacts.
OF_ROWS = ("solver", "iterations", "noslip_iterations")
# Settings that not every formulation has, by formulation.
_OWN: Mapping[str, tuple[str, ...]] = {
    "joints": ("damping_armature", *OF_ROWS),
    "geoms": ("damping_armature", "cone_correction", "cone", "curvature", "impratio", *OF_ROWS),
}
_SOME = tuple(dict.fromkeys(name for names in _OWN.values() for name in names))


@dataclass(frozen=True)
class MujocoSettings:
    """Formulation, time step and the options of contact.

    Attributes:
        formulation: ``joints``: a mechanism of MuJoCo's joints, tendons and equality constraints, which has no contact
            and none of its options; ``geoms``: the same with contacts between bodies.
        preset: source of the other values.
        dt: step [s].
        integrator: MuJoCo's name of it.
        cone: friction cone, exact (``elliptic``) or MuJoCo's default approximation (``pyramidal``).
        time_constant: of the return to zero depth of the contact, and to zero violation of the loops of ``joints``
            (first number of ``solref``), in steps; None: MuJoCo's default of 0.02 s at every step.
        impedance: constant constraint impedance (``solimp``); 1 would be a rigid contact; None: MuJoCo's default,
            0.9 to 0.95 growing with depth.
        impratio: option of that name in MuJoCo, its default by default (``geoms``).
        solver, iterations, noslip_iterations: the same (``joints``, ``geoms``).
        curvature: True if the adapter adds to the contact's reference acceleration the term J̇v, which MuJoCo leaves
            out (``geoms`` on curved walls).
        cone_correction: True if the adapter takes from the contacts' reference accelerations the lift that MuJoCo's
            convex cone gives to what slips, and the lift by the missing J̇v (``geoms``).
        damping_armature: True if each joint has the armature h (c + kd) of its damper and servos in place of MuJoCo's
            implicit damping: the same step without contact, and contacts see it (``joints``, ``geoms``).
        eulerdamp: False switches MuJoCo's implicit damping of Euler off.
    """

    formulation: str = "joints"
    preset: Literal["default", "matched", "tuned"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    integrator: Literal["Euler", "RK4", "implicitfast"] = "RK4"
    cone: Literal["pyramidal", "elliptic"] = "elliptic"
    time_constant: Annotated[float, Ge(SHORTEST_TIME_CONSTANT)] | None = SHORTEST_TIME_CONSTANT
    impedance: Annotated[float, Ge(SMALLEST_IMPEDANCE), Le(LARGEST_IMPEDANCE)] | None = LARGEST_IMPEDANCE
    impratio: Annotated[float, Gt(0)] = 1.0
    solver: Literal["PGS", "CG", "Newton"] = "Newton"
    iterations: Annotated[int, Ge(1)] = 100
    noslip_iterations: Annotated[int, Ge(0)] = 0
    curvature: bool = False
    cone_correction: bool = False
    damping_armature: bool = False
    eulerdamp: bool = True

    @property
    def resolution(self) -> str:
        """See :class:`proofroll.core.engine.Settings`."""
        return "dt"

    @property
    def unused(self) -> tuple[str, ...]:
        """See :class:`proofroll.core.engine.Settings`."""
        return tuple(name for name in _SOME if name not in _OWN[self.formulation])

    @property
    def order(self) -> int | None:
        """Measured order of convergence; :attr:`lowered` has the capabilities of a scene that lower it."""
        return 4 if self.integrator == "RK4" else 1

    @property
    def lowered(self) -> Mapping[str, int]:
        """See :class:`proofroll.core.engine_abilities.LowersOrder`; measured.

        Soft constraints (every loop, dry friction) leave velocities of first order.
        """
        turning: dict[str, int] = dict.fromkeys(_QUATERNIONS, ORDER_OF_TURNING)
        return turning | dict.fromkeys((*ALL_LOOPS, *_FIRST_ORDER), 1)

    def rules(self) -> Iterator[tuple[bool, str, str]]:
        """Combinations that MuJoCo would ignore or misread: True if there, name of the setting, advice."""
        # The other integrators have the implicit damping of their own, or none.
        explicit = self.damping_armature and self.integrator != "Euler"
        yield explicit, "integrator", "damping_armature=true needs integrator=Euler"
        implicit = not self.eulerdamp and self.integrator != "Euler"
        yield implicit, "eulerdamp", f"{self.integrator} does not use it; leave it out"
        if self.cone_correction:
            # mj_step1 and mj_step2, between which the contacts are edited, always make an Euler step.
            yield self.integrator != "Euler", "integrator", "cone_correction=true needs integrator=Euler"
            yield self.cone == "pyramidal", "cone", "cone_correction=true of a mechanism needs cone=elliptic"
        if self.curvature:
            yield self.integrator != "Euler", "integrator", "curvature=true needs integrator=Euler"
            # A pyramid's rows are sums of normal and friction; the term belongs to each of them alone.
            yield self.cone == "pyramidal", "cone", "curvature=true needs cone=elliptic"

    @property
    def scheme(self) -> Scheme | str:
        """See :class:`proofroll.core.engine.Settings`; Euler and implicitfast move positions with the new velocity."""
        return {"RK4": Scheme.RK4, "Euler": Scheme.SEMI_IMPLICIT_EULER}.get(self.integrator, self.integrator)

    @property
    def velocity_lag(self) -> float:
        """Time by which the velocities lag behind the positions [s].

        An Euler step of MuJoCo moves the position with the new velocity. It is a leapfrog of second order if velocities
        count as those of half a step before. Only a contact with J̇v is exact enough to gain from that.
        """
        return self.dt / 2 if self.curvature else 0.0

    @property
    def contact_time(self) -> float:
        """First number of the contact's ``solref`` [s]."""
        return DEFAULT_TIME_CONSTANT if self.time_constant is None else self.time_constant * self.dt

    @property
    def impedances(self) -> tuple[float, float]:
        """Impedance of the contact at depth zero and at large depth (dmin, dmax of ``solimp``)."""
        return DEFAULT_IMPEDANCE if self.impedance is None else (self.impedance, self.impedance)

    @property
    def solimp(self) -> tuple[float, float, float, float, float]:
        """MuJoCo's ``solimp``; its width, midpoint and power are the defaults."""
        return (*self.impedances, 1e-3, 0.5, 2.0)

    def set_solver(self, option: Any, *, contacts: bool = True) -> None:
        """Sets the solver in the options of an MjSpec or a model; ``contacts``: the cone of contacts, too."""
        option.solver = getattr(mujoco.mjtSolver, f"mjSOL_{self.solver.upper()}")
        option.iterations, option.noslip_iterations = self.iterations, self.noslip_iterations
        if contacts:
            option.cone = getattr(mujoco.mjtCone, f"mjCONE_{self.cone.upper()}")
            option.impratio = self.impratio

    def soften(self, item: Any) -> None:
        """Sets ``solref`` and ``solimp`` of an MjSpec's item, each unless it is MuJoCo's default."""
        if self.time_constant is not None:
            item.solref = (self.contact_time, 1.0)
        if self.impedance is not None:
            item.solimp = self.solimp

    @property
    def own_share(self) -> float:
        """Share of J̇v that the contact's damping b J v supplies when v lags by half a step: b dt / 2 [1].

        MuJoCo has b = 2 / (dmax tc).
        """
        return self.velocity_lag * 2 / (self.impedances[1] * self.contact_time)

    @property
    def normal_lead(self) -> float:
        """Time after that of the positions, at which the speed V in the added J̇v is evaluated [s].

        To stay on a wall of radius of curvature c, a leapfrog step has to take e1·v from +h/2 V²/c at -h/2 to -h/2 V²/c
        at +h/2. The damping supplies ``own_share`` of that, with V at -h/2; so the rest needs V at this later time.
        Without the lead, a ball that changes its speed along the wall loses contact again and again.
        """
        return self.velocity_lag * self.own_share / (1 - self.own_share)


_QUATERNIONS = MechanismCapability.SPHERICAL, MechanismCapability.FREE
_FIRST_ORDER = tuple(
    MechanismCapability[name] for name in ("JOINT_FRICTION", "STOPS", "COUPLINGS", "SATURATION", "CONTACT")
)


def check(settings: MujocoSettings) -> None:
    """Rejects combinations that MuJoCo would silently ignore or misread.

    Raises:
        InputError: the first such combination.
    """
    refuse_first("mujoco", settings, settings.rules())
    if settings.own_share >= 1:
        # MuJoCo's damping would supply all of J̇v or more of it: nothing is left to add.
        advice = f"curvature=true needs impedance times time_constant above 1, not {1 / settings.own_share:.4g}"
        raise InputError("mujoco: impedance", settings.impedances[1], advice)


def check_restitution(settings: MujocoSettings) -> None:
    """Raises Refused for settings with which an impact would not follow the law of restitution."""
    if settings.integrator != "Euler" or settings.curvature or settings.cone_correction:
        raise Refused(
            "an impact is one step of damping in MuJoCo, which needs integrator=Euler and a contact as MuJoCo has it "
            "(curvature=false, cone_correction=false)"
        )


PRESETS: Mapping[str, Mapping[str, MujocoSettings]] = {
    "joints": {
        # Loops are springs of 0.02 s, whatever the step.
        "default": MujocoSettings(
            "joints", "default", dt=DEFAULT_STEP, integrator="Euler", time_constant=None, impedance=None
        ),
        # Ten steps: the loops' forces are as accurate as they get (of the slider-crank 3e-5 of 60 N at 1e-4 s, where
        # two steps leave 2e-2 N at every step), at the price of ten times the error of positions.
        "matched": MujocoSettings("joints", "matched", time_constant=FORCES_TIME_CONSTANT),
        # Best in positions. With the shortest that MuJoCo allows the slider-crank, whose error is the largest, is off
        # by a fifth more and its forces by two thirds; Bricard, four-bar and squeezer gain 5 to 26 % of 3e-8 m or less.
        "tuned": MujocoSettings("joints", "tuned", time_constant=POSITIONS_TIME_CONSTANT),
    },
    "geoms": {
        "default": MujocoSettings(
            "geoms",
            "default",
            dt=DEFAULT_STEP,
            integrator="Euler",
            cone="pyramidal",
            time_constant=None,
            impedance=None,
        ),
        # The exact cone, and the hardest contact that MuJoCo allows. What slips still hops, at every step.
        "matched": MujocoSettings("geoms", "matched", integrator="Euler"),
        # The lift of what slips and what turns is taken away: an edit of mjData.efc_aref that its manual does not have.
        # Dampers and servos are implicit by an armature, for MuJoCo's contacts do not see its implicit damping.
        "tuned": MujocoSettings(
            "geoms", "tuned", integrator="Euler", curvature=True, cone_correction=True, damping_armature=True
        ),
    },
}
