"""Table of lies: changes of an honest engine's reports, with texts that verdict and causes must contain."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from liars import ALL, AT_ONCE, BALLS, EVERY, MECHANISMS, Lie, Moment, of_mechanism
from scipy.spatial.transform import Rotation

from proofroll.core.events import Event
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball


def gravity(magnitude: float) -> Callable[[Scene], Scene]:
    """Change of a scene: gravity times a factor."""

    def model(scene: Scene) -> Scene:
        return of_mechanism(scene, gravity=magnitude * np.asarray(the_mechanism(scene).mechanism.gravity))

    return model


def heavier(part: str, factor: float) -> Callable[[Scene], Scene]:
    """Change of a scene: a number (``mass``, ``inertia``) of the first body times a factor."""

    def model(scene: Scene) -> Scene:
        first, *others = the_mechanism(scene).mechanism.bodies
        more = dataclasses.replace(first, **{part: factor * np.asarray(getattr(first, part))})
        return of_mechanism(scene, bodies=(more, *others))

    return model


def _of(by: float, **part: str) -> Callable[[Scene], Scene]:
    """Change of a scene: a number of the first joint, coupling … of its mechanism times a factor."""
    ((kind, number),) = part.items()

    def model(scene: Scene) -> Scene:
        first, *others = getattr(scene.elements[0].mechanism, kind)  # type: ignore[attr-defined]  # it has one
        changed = dataclasses.replace(first, **{number: by * getattr(first, number)})
        return of_mechanism(scene, **{kind: (changed, *others)})

    return model


def echo(_: Any, true: Any) -> Any:
    """Certificate data of the honest model instead of those of the changed one; see ``Lie.built``."""
    return true


# Texts of verdicts, of which one must appear; further below, those of causes.
_PLACES, _FIRST, _MODEL = (
    ("positions are", "z is", "gamma is"),
    ("first steps",),
    ("differs from the scene", "does not say"),
)
_V, _W, _Q = ("v_WB",), ("w_WB",), ("q_WB", "attitude is", "attitudes are")
_FORCES = ("N is", "F3 is", "forces are")
_EVENTS = ("event_times are", "event_times has", "first_slip is", "first_slip has", "event_order is", "creep is")
ORDER = ("event_order is",)  # no error in a quantity
_TURNED = ("rolls", *MECHANISMS, "sled")
_STATE, _WRENCH = ("p_WB", "v_WB", "w_WB", "q_WB"), ("joint_force", "joint_torque")
_LATE, _FACTOR, _AXES, _SIGN, _OMITTED = ("0.003 s late",), ("times",), ("other axes",), ("wrong sign",), ("left out",)


def _times() -> Iterator[Lie]:
    yield Lie("3 ms late from the start", ALL, _FIRST, lambda m: m.at(max(m.t - 0.003, 0)), begins=AT_ONCE)
    yield Lie("3 ms late", ALL, _PLACES, lambda m: m.at(m.t - 0.003), ("late",))
    yield Lie("3 ms early", ALL, _PLACES, lambda m: m.at(m.t + 0.003), ("early",))
    slow, known = lambda m: m.at(0.99 * m.t), ("0.99 times as fast",)
    yield Lie("a clock 1 % slow from the start", (*BALLS, *MECHANISMS), _FIRST, slow, begins=AT_ONCE)
    yield Lie("a clock 1 % slow from the start of a slide", ("sled",), _PLACES, slow, known, begins=AT_ONCE)
    yield Lie("a clock 1 % slow", ALL, _PLACES, slow, known)
    # as all would be that began at rest where nothing pulls
    yield Lie("frozen at the start", ALL, _PLACES, lambda m: m.at(0.0), (*_OMITTED, "the start was not taken"))
    yield Lie("frozen from the middle on", ALL, _PLACES, lambda m: m.at(min(m.t, m.until / 2)))
    yield Lie("every other sample repeated", ALL, _PLACES, lambda m: m.at(int(m.t / EVERY / 2 + 1e-9) * 2 * EVERY))
    yield Lie("back again from the middle on", ALL, _PLACES, lambda m: m.at(min(m.t, m.until - m.t)))
    yield Lie("right on the grid alone", ALL, _PLACES, _off_grid(lambda m: m.at(m.t - 0.002)))
    yield Lie("two steps late and places 1 % too large", ALL, _PLACES, _late_and_larger, ("late",))


def _places() -> Iterator[Lie]:
    yield Lie("1 % of its size further", ALL, _PLACES, lambda m: {"p_WB": m.right.p_WB + 0.01 * m.length})
    yield Lie("places in mm", ALL, _PLACES, lambda m: {"p_WB": 1e3 * m.right.p_WB}, ("prefix",))
    yield Lie("places with x and y swapped", ALL, _PLACES, lambda m: {"p_WB": m.right.p_WB[..., [1, 0, 2]]}, _AXES)
    yield Lie(
        "places with y mirrored", ALL, (*_PLACES, "drift is"), lambda m: {"p_WB": m.right.p_WB * [1, -1, 1]}, _AXES
    )
    yield Lie("places right on the grid alone", ALL, _PLACES, _off_grid(lambda m: {"p_WB": m.right.p_WB + m.length}))
    yield Lie("a beat with the period of the grid", ALL, _PLACES, _beat)
    yield Lie("places not finite", ALL, ("p_WB is not finite",), lambda m: {"p_WB": np.nan * m.right.p_WB})
    yield Lie("bodies swapped", MECHANISMS, _PLACES, lambda m: {n: getattr(m.right, n)[::-1] for n in _STATE})
    yield Lie("the last body frozen", MECHANISMS, _PLACES, _last_frozen, _OMITTED)  # all was at rest, the first one is


def _frames() -> Iterator[Lie]:
    yield Lie("the world turned by 0.3 rad", ALL, _PLACES, _in_axes(_SLANTED))
    yield Lie("the world turned by 0.3 rad from the start", ALL, (*_PLACES, *_MODEL), _in_axes(_SLANTED), begins=0.0)
    yield Lie("the world's axes in another order", ALL, _PLACES, _in_axes(_CYCLED), _AXES)
    yield Lie("bodies' frames turned by 0.3 rad", _TURNED, _Q, lambda m: {"q_WB": _quaternions(m.turns * _SLANTED)})


def _velocities() -> Iterator[Lie]:
    yield Lie("v + 7 m/s", ALL, _V, lambda m: {"v_WB": m.right.v_WB + 7})
    yield Lie("v + 7 m/s between samples", ALL, _V, _off_grid(lambda m: {"v_WB": m.right.v_WB + 7}))
    yield Lie("v of nothing", ALL, _V, lambda m: {"v_WB": 0 * m.right.v_WB}, (*_OMITTED, "contact point"))
    yield Lie("v backwards", ALL, _V, lambda m: {"v_WB": -m.right.v_WB}, _SIGN)
    yield Lie("v with x and y swapped", ALL, _V, lambda m: {"v_WB": m.right.v_WB[..., [1, 0, 2]]}, _AXES)
    yield Lie("v of the start", ALL, _V, lambda m: {"v_WB": m.at(0.0).v_WB}, _OMITTED)
    yield Lie("v not finite", ALL, ("v_WB is not finite",), lambda m: {"v_WB": np.nan * m.right.v_WB})
    yield Lie("v of another body", MECHANISMS, _V, lambda m: {"v_WB": m.right.v_WB[::-1]})


def _spins() -> Iterator[Lie]:
    yield Lie("spins x 3", ALL, _W, lambda m: {"w_WB": 3 * m.right.w_WB}, _FACTOR)
    yield Lie("spins x 3 between samples", ALL, _W, _off_grid(lambda m: {"w_WB": 3 * m.right.w_WB}))
    yield Lie("spins in deg/s", ALL, _W, lambda m: {"w_WB": np.degrees(m.right.w_WB)}, ("degrees",))
    yield Lie("spins of nothing", ALL, _W, lambda m: {"w_WB": 0 * m.right.w_WB}, _OMITTED)
    yield Lie("spins of 1e30 rad/s", ALL, _W, lambda m: {"w_WB": 1e30 + m.right.w_WB})
    yield Lie("spins backwards", ALL, _W, lambda m: {"w_WB": -m.right.w_WB}, _SIGN)
    yield Lie("spins of the start", ALL, _W, lambda m: {"w_WB": m.at(0.0).w_WB}, _OMITTED)
    yield Lie(
        "spins in body axes", ("rolls",), _W, lambda m: {"w_WB": m.turns.inv().apply(m.right.w_WB)}, ("body axes",)
    )
    yield Lie("spins of another body", MECHANISMS, _W, lambda m: {"w_WB": m.right.w_WB[::-1]})


def _orientations() -> Iterator[Lie]:
    yield Lie("quaternions x 1.01", _TURNED, ("has length 1.01",), lambda m: {"q_WB": 1.01 * m.right.q_WB})
    yield Lie("quaternions x 7", _TURNED, ("has length 7",), lambda m: {"q_WB": 7 * m.right.q_WB})
    yield Lie("quaternions of zeros", _TURNED, ("has length 0",), lambda m: {"q_WB": 0 * m.right.q_WB})
    yield Lie("quaternions not finite", _TURNED, ("q_WB is not finite",), lambda m: {"q_WB": np.nan * m.right.q_WB})
    yield Lie("quaternions of the start", _TURNED, _Q, lambda m: {"q_WB": m.at(0.0).q_WB})
    yield Lie("quaternions frozen between samples", _TURNED, _Q, _off_grid(lambda m: {"q_WB": m.at(0.0).q_WB}))
    yield Lie(
        "quaternions of the inverse", _TURNED, _Q, lambda m: {"q_WB": m.right.q_WB * [1, -1, -1, -1]}, ("inverse",)
    )
    yield Lie(
        "quaternions with the scalar last", _TURNED, _Q, lambda m: {"q_WB": np.roll(m.right.q_WB, -1, -1)}, ("last",)
    )
    yield Lie("quaternions 3 ms late", _TURNED, _Q, lambda m: {"q_WB": m.at(m.t - 0.003).q_WB}, _LATE)
    yield Lie("quaternions of another body", MECHANISMS, _Q, lambda m: {"q_WB": m.right.q_WB[::-1]})
    yield Lie("quaternions left out later", _TURNED, ("not at 0.01 s",), lambda _: {"q_WB": None})
    yield Lie("no quaternions", _TURNED, ("does not give",), lambda _: {"q_WB": None}, begins=0.0)


def _forces_of_balls() -> Iterator[Lie]:
    yield Lie("forces x 100", BALLS, _FORCES, lambda m: {"contact_force": 100 * m.right.contact_force}, _FACTOR)
    yield Lie("forces x 1.02", BALLS, _FORCES, lambda m: {"contact_force": 1.02 * m.right.contact_force}, _FACTOR)
    yield Lie(
        "forces x 100 between samples",
        BALLS,
        _FORCES,
        _off_grid(lambda m: {"contact_force": 100 * m.right.contact_force}),
    )
    yield Lie("forces of nothing", BALLS, _FORCES, lambda m: {"contact_force": 0 * m.right.contact_force}, _OMITTED)
    yield Lie("forces on the wall", BALLS, _FORCES, lambda m: {"contact_force": -m.right.contact_force}, _SIGN)
    yield Lie("forces of the start", BALLS, _FORCES, lambda m: {"contact_force": m.at(0.0).contact_force})
    yield Lie(
        "forces 3 ms late", BALLS, _FORCES, lambda m: {"contact_force": m.at(m.t - 0.003).contact_force}, ("late",)
    )
    yield Lie("forces without friction", BALLS, _FORCES, lambda m: {"contact_force": _normal(m)}, ("friction",))
    yield Lie(
        "forces in body axes",
        ("rolls",),
        _FORCES,
        lambda m: {"contact_force": m.turns.inv().apply(m.right.contact_force)},
        ("body axes",),
    )
    yield Lie("forces left out later", BALLS, ("this trajectory has",), lambda _: {"contact_force": None})
    yield Lie("no forces", BALLS, ("this trajectory has",), lambda _: {"contact_force": None}, begins=0.0)


def _reactions_of_joints() -> Iterator[Lie]:
    def each(change: Callable[[Moment, str], Any]) -> Callable[[Moment], Any]:
        return lambda m: {name: change(m, name) for name in _WRENCH}

    times_100 = each(lambda m, name: 100 * getattr(m.right, name))
    yield Lie("reactions x 100", MECHANISMS, _FORCES, times_100, _FACTOR)
    yield Lie("reactions x 100 between samples", MECHANISMS, _FORCES, _off_grid(times_100))
    yield Lie("reactions x 1.02", MECHANISMS, _FORCES, each(lambda m, name: 1.02 * getattr(m.right, name)), _FACTOR)
    yield Lie("reactions of nothing", MECHANISMS, _FORCES, each(lambda m, name: 0 * getattr(m.right, name)), _OMITTED)
    yield Lie("reactions on the parent", MECHANISMS, _FORCES, each(lambda m, name: -getattr(m.right, name)), _SIGN)
    yield Lie(
        "reactions of another joint",
        MECHANISMS,
        _FORCES,
        each(lambda m, name: getattr(m.right, name)[::-1]),
        ("another joint",),
    )
    yield Lie(
        "reactions in body axes", MECHANISMS, _FORCES, lambda m: {"joint_force": _in_body_axes(m)}, ("body axes",)
    )
    yield Lie("reactions of the start", MECHANISMS, _FORCES, each(lambda m, name: getattr(m.at(0.0), name)))
    late = each(lambda m, name: getattr(m.at(m.t - 0.003), name))
    yield Lie("reactions 3 ms late", tuple(name for name in MECHANISMS if name != "servo"), _FORCES, late, _LATE)
    yield Lie("reactions of a servo 3 ms late", ("servo",), _FORCES, late, ("0.00287 s late",))
    yield Lie("reactions not finite", MECHANISMS, _FORCES, each(lambda m, name: np.nan * getattr(m.right, name)))
    yield Lie("no reactions", MECHANISMS, _FORCES, each(lambda *_: None), begins=0.0)
    yield Lie("moments + 5 N m", MECHANISMS, ("torques are",), lambda m: {"joint_torque": m.right.joint_torque + 5})


def _efforts() -> Iterator[Lie]:
    def lie(name: str, change: Callable[[Moment], Any], *causes: str) -> Lie:
        return Lie(name, ("servo",), ("effort.servo is",), lambda m: {"effort": change(m)}, causes)

    yield lie("efforts x 1.02", lambda m: 1.02 * m.right.effort)
    yield lie("efforts of nothing", lambda m: 0 * m.right.effort)
    yield lie("efforts backwards", lambda m: -m.right.effort)
    yield lie("efforts of the start", lambda m: m.at(0.0).effort)
    yield lie("efforts 3 ms late", lambda m: m.at(m.t - 0.003).effort)
    yield lie("efforts not finite", lambda m: np.nan * m.right.effort)


def _forces_of_contacts() -> Iterator[Lie]:
    def lie(name: str, change: Callable[[Moment], Any], *causes: str) -> Lie:
        return Lie(
            name,
            ("sled",),
            ("contact_forces are", "this trajectory has"),
            lambda m: {"contact_force": change(m)},
            causes,
        )

    yield lie("contacts x 1.02", lambda m: 1.02 * m.right.contact_force, *_FACTOR)
    yield lie("contacts of nothing", lambda m: 0 * m.right.contact_force, *_OMITTED)
    yield lie("contacts on the other body", lambda m: -m.right.contact_force, *_SIGN)
    yield lie("contacts of another foot", lambda m: m.right.contact_force[[1, 2, 0]])
    yield lie("contacts without friction", lambda m: m.right.contact_force * [0, 0, 1])
    yield lie("contacts of the start", lambda m: m.at(0.0).contact_force)
    yield lie("contacts 3 ms late", lambda m: m.at(m.t - 0.003).contact_force, *_LATE)
    yield lie("contacts not finite", lambda m: np.nan * m.right.contact_force)


def _each(**change: Callable[[Event, float], Any]) -> Callable[[list[Event], float], list[Event]]:
    return lambda right, until: [
        dataclasses.replace(event, **{name: how(event, until) for name, how in change.items()}) for event in right
    ]


def _later(by: float) -> Any:
    names = "time", "time_low", "time_high"
    return _each(**{name: lambda event, _, name=name: getattr(event, name) + by for name in names})


def _more(times: Callable[[float], list[tuple[float, float, float]]]) -> Callable[[list[Event], float], list[Event]]:
    """Further impacts on the part of the last one, at these times and brackets of a run until its end."""
    return lambda right, until: (
        right
        + [
            dataclasses.replace(last, time=time, time_low=low, time_high=high)
            for last in right[-1:]
            for time, low, high in times(until)
        ]
    )


def _slips() -> Iterator[Lie]:
    def lie(name: str, events: Any, said: tuple[str, ...] = _EVENTS) -> Lie:
        return Lie(name, ("slips",), said, events=events)

    yield lie("no events", lambda *_: [])
    once_more: dict[str, Any] = {"kind": "stick", "time": 0.22, "time_low": 0.22, "time_high": 0.22}
    yield lie(
        "an event too many", lambda right, _: [*right, *(dataclasses.replace(e, **once_more) for e in right[-1:])]
    )
    yield lie("events of the wrong kind", _each(kind=lambda *_: "stick"))
    yield lie("events 30 ms late", _later(0.03))
    yield lie("events 5 ms late", _later(0.005))
    yield lie("events before they are", _later(-0.03))
    yield lie("event times not finite", _each(time=lambda *_: np.nan), said=("has the bracket",))
    wide: dict[str, Any] = {"time_low": lambda *_: 0.0, "time_high": lambda _, until: until}
    yield lie("brackets as wide as the run", _each(**wide), said=("by luck",))
    yield lie(
        "events 30 ms late in brackets as wide as the run", _each(time=lambda event, _: event.time + 0.03, **wide)
    )


def _impacts() -> Iterator[Lie]:
    both = ("bounces", "stops")

    def deeper(m: Moment) -> dict[str, Any]:
        return {"p_WB": m.right.p_WB - [0, 0, 1e-3]}

    def returning(scene: Scene) -> Scene:
        """The scene with more restitution, of its pair or its joint."""
        mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # both have one
        part = "pairs" if mechanism.pairs else "joints"
        (one,) = getattr(mechanism, part)
        return of_mechanism(scene, **{part: (dataclasses.replace(one, restitution=one.restitution + 0.02),)})

    rougher = _of(pairs="friction", by=1.05)
    yield Lie("no impacts", both, _EVENTS, events=lambda *_: [])
    yield Lie("an impact too many", both, _EVENTS, events=lambda right, _: [right[0], *right])
    yield Lie("impacts 5 ms late", both, _EVENTS, events=_later(0.005))
    yield Lie("impacts elsewhere", both, _EVENTS, events=_each(name=lambda *_: "ceiling"))
    yield Lie("impacts that are ends of slip", both, ORDER, events=_each(kind=lambda *_: "stick"))
    yield Lie("a step late from the first impact on", both, _PLACES, lambda m: m.at(m.t - 1e-3), ("late",), begins=0.05)
    yield Lie("1 mm deep from the first impact on", both, _PLACES, deeper, begins=0.05)
    yield Lie(
        "restitution + 0.02, the scene repeated",
        both,
        (*_PLACES, *_EVENTS),
        None,
        ("restitution",),
        model=returning,
        built=echo,
    )
    yield Lie(
        "friction of impacts x 1.05, the scene repeated",
        ("bounces",),
        _W,
        None,
        ("friction of impacts",),
        model=rougher,
        built=echo,
    )
    yield Lie("friction of impacts x 1.05, told", ("bounces",), ("friction",), model=rougher)


def _friction_of_joints() -> Iterator[Lie]:
    def lie(name: str, change: Callable[[Moment], Any], *causes: str) -> Lie:
        return Lie(name, ("rubs",), ("friction.slide is",), lambda m: {"friction": change(m)}, causes)

    yield lie("friction x 1.02", lambda m: 1.02 * m.right.friction)
    yield lie("friction of nothing", lambda m: 0 * m.right.friction)
    yield lie("friction along the motion", lambda m: -m.right.friction)
    yield lie("friction not finite", lambda m: np.nan * m.right.friction)
    yield Lie(
        "friction of a joint x 1.02, the scene repeated",
        ("rubs",),
        ("friction.slide is",),
        None,
        ("dry friction",),
        model=_of(joints="friction", by=1.02),
        built=echo,
    )
    yield Lie(
        "no friction of a joint, the scene repeated",
        ("rubs",),
        ("friction.slide is",),
        None,
        ("dry friction",),
        model=_of(joints="friction", by=0.0),
        built=echo,
    )


def _models() -> Iterator[Lie]:
    standard = gravity(9.80665 / 9.81)
    yield Lie("g = 9.80665, told", ALL, ("gravity is",), model=standard)
    yield Lie("g = 9.80665, the scene repeated", ALL, _MODEL, model=standard, built=echo)
    yield Lie("half of gravity, told", ALL, ("gravity is",), model=gravity(0.5))
    yield Lie("half of gravity, the scene repeated", ALL, _MODEL, model=gravity(0.5), built=echo)
    yield Lie("half of gravity, nothing told", ALL, _MODEL, model=gravity(0.5), built=lambda right, _: type(right)())
    yield Lie("gravity halved in place", ALL, _MODEL, model=halve_in_place, built=echo)
    yield Lie("mass x 1.02, the scene repeated", ALL, _MODEL, model=heavier("mass", 1.02), built=echo)
    yield Lie("inertia x 1.1, the scene repeated", ALL, _MODEL, model=heavier("inertia", 1.1), built=echo)
    yield Lie("half of gravity from the first sample on", ALL, (*_PLACES, *_FORCES), _from_first_sample(gravity(0.5)))
    yield Lie(
        "mass x 1.02 from the first sample on",
        ALL,
        _FORCES,
        _from_first_sample(heavier("mass", 1.02)),
        ("mass", "times"),
    )
    yield Lie(
        "inertia x 1.1 from the first sample on",
        ALL,
        (*_PLACES, *_FORCES),
        _from_first_sample(heavier("inertia", 1.1)),
        ("inertia",),
    )


def _small() -> Iterator[Lie]:
    yield Lie("single precision", ALL, (), _single)
    yield Lie("single precision from the start", ALL, _MODEL, _single, begins=0.0)
    yield Lie("1e-9 of its size further", ALL, (), lambda m: {"p_WB": m.right.p_WB + 1e-9 * m.length})
    yield Lie("forces x (1 + 1e-9)", BALLS, (), lambda m: {"contact_force": (1 + 1e-9) * m.right.contact_force})
    yield Lie("1 ns late", ALL, (), lambda m: m.at(m.t - 1e-9))


def _further_impacts() -> Iterator[Lie]:
    both = ("bounces", "stops")
    unbounded: dict[str, Any] = {"time_low": lambda *_: np.nan, "time_high": lambda *_: np.inf}
    yield Lie(
        "v by differences of places over an interval",
        (*MECHANISMS, "sled"),
        _V,
        lambda m: {"v_WB": (m.right.p_WB - m.at(m.t - EVERY).p_WB) / EVERY},
        ("late",),
    )
    yield Lie(
        "contacts + 0.02 of the largest upwards",
        ("sled",),
        ("contact_forces are", "normal_forces are"),
        lambda m: {"contact_force": m.right.contact_force + 0.02 * np.abs(m.right.contact_force).max() * np.eye(3)[2]},
    )
    yield Lie("brackets not finite", both, ("has the bracket nan to inf s",), events=_each(**unbounded))
    yield Lie("an impact after the end", both, _EVENTS, events=_more(lambda _: [(1e9, 1e9, 1e9)]))
    crowd = _more(lambda until: [(until - EVERY / 2, until - EVERY, until)] * 100)
    yield Lie("a hundred impacts somewhere in the last interval", both, (*_EVENTS, "by luck"), events=crowd)
    yield Lie(
        "right on the grid alone, an impact in each interval",
        both,
        (*_PLACES, *_EVENTS),
        _off_grid(lambda m: m.at(m.t - 0.002)),
        events=_more(lambda until: [(t, t, t) for t in np.arange(EVERY / 2, until, EVERY)]),
    )


def _forces_of_couplings_and_stops() -> Iterator[Lie]:
    def lie(name: str, change: Callable[[Moment], Any]) -> Lie:
        return Lie(name, ("gears",), ("coupling.gear is",), lambda m: {"coupling": change(m)})

    yield lie("couplings x 1.02", lambda m: 1.02 * m.right.coupling)
    yield lie("couplings of nothing", lambda m: 0 * m.right.coupling)
    yield lie("couplings backwards", lambda m: -m.right.coupling)
    yield Lie(
        "couplings x 100 between samples",
        ("gears",),
        ("coupling.gear is",),
        _off_grid(lambda m: {"coupling": 100 * m.right.coupling}),
    )
    yield Lie("ratio x 1.01, the scene repeated", ("gears",), _MODEL, model=_of(couplings="ratio", by=1.01), built=echo)
    yield Lie("a stop that presses in flight", ("stops",), ("stop.guide is",), lambda m: {"stop": m.right.stop + 1})


def _parts_of_motion() -> Iterator[Lie]:
    def of_last(m: Moment, name: str, factor: float) -> Any:
        values = np.array(getattr(m.right, name))
        values[-1] *= factor
        return values

    def at_middle(change: Callable[[Moment], Any]) -> Callable[[Moment], Any]:
        return lambda m: change(m) if abs(m.t - m.until / 2) < EVERY / 2 + 1e-9 else {}

    rest = (*ALL, "bounces", "stops", "rubs", "gears")
    drift, turned = (lambda m: {"p_WB": m.right.p_WB + 0.01 * m.length * m.t / m.until}), Rotation.from_rotvec(_TWIST)
    yield Lie("places that tremble", ("bounces",), _PLACES, lambda m: {"p_WB": m.right.p_WB + _trembling(m)})
    yield Lie("places that drift, rubbing", ("rubs",), _PLACES, drift)
    yield Lie("places that drift, at a stop", ("stops",), _PLACES, drift)
    yield Lie("places elsewhere, rubbing", ("rubs",), _PLACES, lambda m: {"p_WB": m.right.p_WB + m.length})
    smooth = ("rolls", "tree", "loop", "driven", "sled", "rubs", "gears")
    yield Lie("half a step late", smooth, _PLACES,
              lambda m: m.at(m.t - 5e-4), ("0.0005 s late",))  # fmt: skip
    yield Lie("the last sample frozen", rest, (*_PLACES, *_W), lambda m: m.at(min(m.t, m.until - EVERY)))
    yield Lie("samples in the middle 3 ms late", rest, (*_PLACES, *_W), at_middle(lambda m: m.at(m.t - 0.003)))
    yield Lie("v turned by half a degree", ("rolls", "loop", "sled"), (*_V, "slip is"),
              lambda m: {"v_WB": turned.apply(m.right.v_WB)})  # fmt: skip
    yield Lie("v of the last body x 1.01", ("tree", "loop", "driven", "servo"), _V,
              lambda m: {"v_WB": of_last(m, "v_WB", 1.01)}, _FACTOR)  # fmt: skip
    yield Lie("one joint's reactions x 1.02", ("tree", "loop", "driven", "servo"), (*_FORCES, "torques are"),
              lambda m: {name: of_last(m, name, 1.02) for name in _WRENCH}, _FACTOR)  # fmt: skip
    yield Lie("places as texts", rest, ("real numbers",), lambda m: {"p_WB": np.asarray(m.right.p_WB).astype(str)})


def _parts_of_events() -> Iterator[Lie]:
    beside: dict[str, Any] = {name: lambda event, _, by=by: event.time + by
                              for name, by in (("time_low", 1e-3), ("time_high", 2e-3))}  # fmt: skip
    elsewhere = _each(name=lambda *_: "elsewhere")
    yield Lie("impacts of another stop", ("stops",), ORDER, events=elsewhere)
    yield Lie("limits of another actuator", ("servo",), ORDER, events=elsewhere)
    for about in ("slips", "bounces", "stops", "servo"):
        yield Lie(f"brackets beside their times, {about}", (about,), ("has the bracket",), events=_each(**beside))


def _of_one_body_or_sum() -> Iterator[Lie]:
    def first_elsewhere(m: Moment) -> dict[str, Any]:
        places = np.array(m.right.p_WB)
        places[0] += 0.005 * m.length
        return {"p_WB": places}

    def first_for_all(m: Moment) -> dict[str, Any]:
        return {"q_WB": np.repeat(m.right.q_WB[:1], len(m.right.q_WB), axis=0)}

    def evenly(m: Moment) -> dict[str, Any]:
        return {"contact_force": np.broadcast_to(m.right.contact_force.mean(axis=0), m.right.contact_force.shape)}

    yield Lie("the first body half a hundredth further", ("tree", "driven", "loop", "servo"), ("p_WB is",),
              first_elsewhere)  # fmt: skip
    yield Lie("quaternions of the first body for all", ("loop",), _Q, first_for_all)
    yield Lie("contacts that share their sum evenly", ("sled",), ("contact_forces are", "normal_forces are"), evenly)


def table() -> list[Lie]:
    """All lies of the table."""
    states = _times, _places, _frames, _velocities, _spins, _orientations
    forces = _forces_of_balls, _reactions_of_joints, _efforts, _forces_of_contacts, _friction_of_joints
    # New ones come last: the place of a lie decides of which scenes it is told.
    last = _models, _small, _further_impacts, _forces_of_couplings_and_stops, _parts_of_motion, _parts_of_events
    last = *last, _of_one_body_or_sum
    return [lie for part in (*states, *forces, _slips, _impacts, *last) for lie in part()]


def _off_grid(change: Callable[[Moment], Any]) -> Callable[[Moment], Any]:
    """Lie: the change applies between the regular samples only."""
    return lambda m: {} if abs(m.t / EVERY - round(m.t / EVERY)) < 1e-6 else change(m)


# Rotations to wrong world frames: slanted, and with cyclically permuted axes.
_SLANTED, _CYCLED = Rotation.from_rotvec([0.1, 0.2, 0.2]), Rotation.from_matrix(np.roll(np.eye(3), 1, axis=0))


_TWIST = (0.0087, 0.0, 0.0087)  # half a degree


def _trembling(m: Moment) -> float:
    return float(0.003 * m.length * (-1) ** round(m.t / EVERY))


def _quaternions(turns: Rotation) -> Any:
    return turns.as_quat(scalar_first=True)


def _in_axes(turn: Rotation) -> Callable[[Moment], Any]:
    """Lie: all vectors and orientations in a rotated world frame."""

    def sample(m: Moment) -> dict[str, Any]:
        given = {item.name: getattr(m.right, item.name) for item in dataclasses.fields(m.right)}
        vectors = {k: v @ turn.as_matrix().T for k, v in given.items() if np.shape(v)[-1:] == (3,) and k != "effort"}
        return vectors | ({"q_WB": _quaternions(turn * m.turns)} if m.right.q_WB is not None else {})

    return sample


def _late_and_larger(m: Moment) -> Any:
    late = m.at(m.t - 0.002)
    return dataclasses.replace(late, p_WB=1.01 * late.p_WB)


def _last_frozen(m: Moment) -> dict[str, Any]:
    return {name: np.concatenate([getattr(m.right, name)[:-1], getattr(m.at(0.0), name)[-1:]]) for name in _STATE}


def _beat(m: Moment) -> dict[str, Any]:
    return {"p_WB": m.right.p_WB + 0.02 * m.length * np.sin(2 * np.pi * m.t / EVERY)}


def _from_first_sample(model: Callable[[Scene], Scene]) -> Callable[[Moment], Any]:
    """Lie: samples of a changed model, while the certificate saw the right one."""
    return lambda m: m.of(model)


def _single(m: Moment) -> dict[str, Any]:
    names = [each.name for each in dataclasses.fields(m.right)]
    arrays = {name: getattr(m.right, name) for name in names if isinstance(getattr(m.right, name), np.ndarray)}
    return {name: values.astype(np.float32).astype(np.float64) for name, values in arrays.items()}


def _normal(m: Moment) -> Any:
    e1 = rolling_ball(m.scene).surface.normal(np.reshape(m.right.p_WB, 3))
    return (m.right.contact_force @ e1)[:, None] * e1


def _in_body_axes(m: Moment) -> Any:
    mechanism = m.scene.elements[0].mechanism  # type: ignore[attr-defined]  # it has one
    turns = np.concatenate([m.turns.as_matrix(), np.eye(3)[None]])
    children = turns[[mechanism.body_index[each.b] for each in mechanism.connections]]
    return np.einsum("jba,jb->ja", children, m.right.joint_force)


def halve_in_place(scene: Scene) -> Scene:
    """Halves gravity in the given scene object itself, though it is frozen."""
    mechanism = the_mechanism(scene).mechanism
    object.__setattr__(mechanism, "gravity", 0.5 * np.asarray(mechanism.gravity))
    return of_mechanism(scene)
