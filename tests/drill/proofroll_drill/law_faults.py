"""One-token faults in code that both routes of the truth share, planted at run time; the checks must see each."""

from __future__ import annotations
import __future__

import importlib
import inspect
import textwrap
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from proofroll.core.dataset import ENDED
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.elements.mechanism import Body, Force, Joint, Mechanism, Spring
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.truth.plug_in import MechanismTruth
from proofroll_drill.random_faults import compared, values_and_bars


class LawFault(NamedTuple):
    """A fault: what is wrong, the function that has it, a token and what replaces it, and a scene that shows it."""

    words: str
    function: str
    token: str
    wrong: str
    scene: str


Inertia = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def _inertia(xx: float, yy: float, zz: float) -> Inertia:
    """Inertia about axes of the body [kg m²]."""
    return (xx, 0.0, 0.0), (0.0, yy, 0.0), (0.0, 0.0, zz)


def motors() -> Mechanism:
    """Coupled arms with stops, a spring, an armature, and a motor that reaches its limit."""
    arm = Body("arm", 1.0, com=(0.2, 0.0, 0.0), inertia=_inertia(0.01, 0.02, 0.02))
    wheel = Body("wheel", 0.5, com=(0.0, 0.02, 0.05), inertia=_inertia(0.01, 0.01, 0.02))
    shoulder = Joint("shoulder", JointKind.REVOLUTE, "world", "arm", axis=Y, q0=(0.3,), v0=(3.0,))
    shoulder = replace(shoulder, limits=(-0.5, 0.5), restitution=0.6, damping=0.02, stiffness=1.5, armature=0.01)
    axle = Joint("axle", JointKind.REVOLUTE, "world", "wheel", axis=Y, position=(0.0, 0.5, 0.0), q0=(0.15,), v0=(1.5,))
    motor = Actuator("motor", "axle", "position", Formula("0.8*sin(20*t)"), kp=6.0, kd=0.05, gear=1.5, limit=2.0)
    gears = Coupling("gears", "shoulder", "axle", ratio=0.5)
    return Mechanism((arm, wheel), (shoulder, axle), actuators=(motor,), couplings=(gears,))


def links() -> Mechanism:
    """A driven slide with a load on a universal joint, a block that rubs, a spring, a bushing and a force."""
    cart = Body("cart", 2.0, inertia=_inertia(0.02, 0.02, 0.02))
    load = Body("load", 0.7, com=(0.0, 0.0, -0.1), inertia=_inertia(0.004, 0.005, 0.006))
    block = Body("block", 1.5, inertia=_inertia(0.01, 0.01, 0.01))
    joints = (
        Joint("shake", JointKind.PRISMATIC, "world", "cart", axis=X, motion=Formula("0.05*sin(9*t)"), position=Y),
        Joint("hinge", JointKind.UNIVERSAL, "cart", "load", axis=Y, q0=(0.4, 0.2), damping=0.01),
        Joint(
            "guide", JointKind.PRISMATIC, "world", "block", axis=Y, position=(0.0, 2.0, 0.0), v0=(0.8,), friction=6.0
        ),
    )
    link = Spring("link", "load", "block", (0.0, 0.0, -0.2), (0.05, 0.0, 0.0), stiffness=30.0, damping=0.5, length=0.7)
    mount = Bushing("mount", "world", "load", (0.0, 1.0, -0.3), (0.0, 0.0, -0.1), stiffness=(40, 60, 50, 2, 3, 1))
    push = Force("push", "load", "force", (Formula("2*cos(5*t)"), 0.3, 1.0), position=(0.0, 0.03, 0.0), frame="body")
    bushings = (replace(mount, damping=(0.4,) * 6),)
    return Mechanism((cart, load, block), joints, springs=(link,), bushings=bushings, forces=(push,))


def _ball(height: float, speed: tuple[float, ...], **pair: float) -> Mechanism:
    """A ball, its centre of mass off its centre, at a height above a floor."""
    body = Body("ball", 1.3, com=(0.0, 0.0, 0.01), inertia=_inertia(0.006, 0.007, 0.008))
    joint = Joint("flight", JointKind.FREE, "world", "ball", q0=(0.0, 0.0, 0.1 + height, 1.0, 0.0, 0.0, 0.0), v0=speed)
    geometries = Geometry("skin", "ball", "sphere", radius=0.1), Geometry("floor", "world", "plane")
    law: dict[str, Any] = {"friction": 0.2} | pair
    return Mechanism((body,), (joint,), geometries=geometries, pairs=(Pair("contact", ("skin", "floor"), **law),))


def plate() -> Mechanism:
    """A ball that falls on a plate, which a motion drives, and rebounds."""
    bodies = Body("plate", 1.0, inertia=_inertia(0.1, 0.1, 0.1)), Body("ball", 1.0, inertia=_inertia(4e-3, 4e-3, 4e-3))
    up = (0.0, 0.0, 1.0)
    joints = (
        Joint("shake", JointKind.PRISMATIC, "world", "plate", axis=up, motion=Formula("0.2*t")),
        Joint("fall", JointKind.PRISMATIC, "world", "ball", axis=up, q0=(0.2,)),
    )
    geometries = Geometry("floor", "plate", "plane"), Geometry("skin", "ball", "sphere", radius=0.1)
    pairs = (Pair("touch", ("skin", "floor"), friction=0.0, restitution=0.5),)
    return Mechanism(bodies, joints, geometries=geometries, pairs=pairs)


_TURNING = {"rolling_resistance": 0.004, "spinning_friction": 0.006}
_THROWN = (0.4, 0.1, 0.0, 3.0, 1.0, 2.0)
SCENES: dict[str, tuple[Callable[[], Mechanism], float]] = {
    "motors": (motors, 0.12),
    "links": (links, 0.12),
    "slide": (lambda: _ball(0.0, (1.0, 0.4, 0.0, 2.0, -1.0, 6.0), **_TURNING), 0.35),
    "roll": (lambda: _ball(0.0, (0.5, 0.0, 0.0, 0.0, 5.0, 3.0), friction=0.6, **_TURNING), 0.3),
    "bounce": (lambda: _ball(0.1, _THROWN, restitution=0.7, tangential_restitution=0.4, friction=0.8), 0.4),
    "grip": (lambda: _ball(0.1, _THROWN, restitution=0.7, friction=0.05), 0.4),
    "plate": (plate, 0.4),
    "rod": (lambda: _model("falling_rod"), 0.6),
    "sled": (lambda: _model("sled"), 0.05),
    "stops": (lambda: _model("sled"), 0.6),
    "loops": (lambda: _model("four_bar"), 0.2),
    "stop": (lambda: _model("stop"), 0.6),
}


def _model(name: str) -> Mechanism:
    return load_scene(name).elements[0].mechanism  # type: ignore[attr-defined, no-any-return]


def _faults() -> tuple[LawFault, ...]:
    table = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return tuple(LawFault(**fault) for fault in table["faults"])


FAULTS = _faults()


def _function(address: str) -> Any:
    """Function at an address, without what wraps it."""
    module, _, path = address.partition(":")
    found: Any = importlib.import_module(module)
    for name in path.split("."):
        found = inspect.getattr_static(found, name)
    for inner in ("fget", "func", "__func__", "__wrapped__"):
        found = getattr(found, inner, found)
    return found


@contextmanager
def planted(fault: LawFault) -> Iterator[None]:
    """Context in which a function has the fault."""
    function = _function(fault.function)
    source = textwrap.dedent(inspect.getsource(function))
    assert fault.token in source, f"{fault.words}: {fault.token!r} is not in {fault.function}"
    lines = source.replace(fault.token, fault.wrong).splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("def "))
    names = dict(function.__globals__)
    flags = __future__.annotations.compiler_flag
    exec(compile("\n".join(lines[start:]), "<fault>", "exec", flags=flags), names)  # the source of the suite alone
    plain, function.__code__ = function.__code__, names[function.__name__].__code__
    try:
        yield
    finally:
        function.__code__ = plain


@cache
def honest(scene: str) -> xr.Dataset:
    """Truth of a scene without a fault."""
    return _published(scene)


def _published(scene: str) -> xr.Dataset:
    make, until = SCENES[scene]
    return MechanismTruth.truth(MechanismElement(make()), np.linspace(0.0, until, 6), ())


def outcome(fault: LawFault) -> str:
    """Result with a fault: that of :func:`.compared` over all that is published, or "refused" with its words."""
    right = honest(fault.scene)
    assert ENDED not in right.attrs, right.attrs[ENDED]
    with planted(fault):
        try:
            found = _published(fault.scene)
        except (Refused, Diverged, InputError, ArithmeticError) as error:
            return f"refused: {error}"
    if ENDED in found.attrs:
        return f"refused: {found.attrs[ENDED]}"
    ending = compared(values_and_bars(right), values_and_bars(found))
    return f"{ending.kind}: {ending.detail}"
