"""Programs that show what an engine does without proofroll move the ball as its adapter does."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.core.engine_abilities import Reproduces
from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.program_text import imported_packages
from proofroll.elements.ball_on_surface.element import rolling_ball, scene_with
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.files.scene_file import load_scene

CYLINDER, PLANE = "sphere_in_cylinder", "inclined_plane"
RESISTED, SLIPPING = {"rolling_resistance": 1e-3}, {"mu_static": 0.05}
# Engine, settings and parameters of the scene.
PROGRAMS: list[tuple[str, str, dict[str, Any], dict[str, float]]] = [
    ("mujoco", "free", {"preset": "default"}, {}),
    *(
        ("mujoco", formulation, {"preset": preset}, parameters)
        for formulation, preset in (("free", "matched"), ("free", "tuned"), ("chart", "tuned"))
        for parameters in ({}, RESISTED, SLIPPING)
    ),
    ("mujoco", "free", {"preset": "tuned"}, RESISTED | SLIPPING),
    ("mujoco", "facets", {"preset": "default"}, RESISTED),
    *(
        ("exudyn", formulation, {"preset": preset}, parameters)
        for formulation, preset in (
            ("generic", "matched"),
            ("carrier", "default"),
            ("rolling_disc", "matched"),
            ("contact", "matched"),
        )
        for parameters in ({}, RESISTED)
    ),
    ("exudyn", "contact", {"preset": "matched"}, SLIPPING),
    *(
        ("pinocchio", formulation, settings, parameters)
        for formulation in ("composite", "free_flyer")
        for settings in (
            {"preset": "default"},
            {"preset": "default", "integrator": "rk4_dexpinv", "orientation": False, "projection": True},
            {"preset": "default", "integrator": "semi_implicit_euler"},
            {"preset": "tuned", "rtol": 1e-5},
            {"preset": "tuned", "rtol": 1e-5, "orientation": True, "projection": False},
        )
        for parameters in ({}, RESISTED)
    ),
    *(
        ("pinocchio", "contact", {"preset": preset}, parameters)
        for preset in ("default", "matched")
        for parameters in ({}, RESISTED, SLIPPING, SLIPPING | {"mu_kinetic": 0.04})
    ),
]
# The plane changes the wall of a program alone: the last of each formulation, with most parameters, is asked there.
FLAT = {one[:2]: one for one in PROGRAMS}


def kind_of(engine: str) -> Any:
    """The engine's class, if it is installed."""
    pytest.importorskip(engine)
    return load_engine(engine)


def program(engine: str, settings: Any, scene: Any) -> dict[str, Any]:
    """What the program defines."""
    found: dict[str, Any] = {}
    exec(compile(kind_of(engine).reproducer(scene, settings), "program", "exec"), found)
    return found


def name_of(value: Any) -> str:
    """A short name of a test's parameter."""
    return ",".join(f"{key}={item}" for key, item in value.items()) if isinstance(value, dict) else str(value)


@pytest.mark.parametrize(
    ("scene", "engine", "formulation", "options", "parameters"),
    [(CYLINDER, *one) for one in PROGRAMS]
    + [pytest.param(PLANE, *one, marks=pytest.mark.drill) for one in FLAT.values() if one[1] != "facets"],
    ids=name_of,
)
def test_the_same_motion(
    scene: str, engine: str, formulation: str, options: dict[str, Any], parameters: dict[str, float]
) -> None:
    """Centre, velocity and angular velocity are those of the adapter, and the wall is the scene's."""
    kind = kind_of(engine)
    assert isinstance(kind, Reproduces)
    settings = resolve_settings(kind, {"formulation": formulation, **options})
    loaded = load_scene(scene, **parameters)
    made = program(engine, settings, loaded)
    times = [10 * step * (settings.dt or 1e-3) for step in range(6)]
    states = list(made["run"](times))
    adapter, surface = kind.build(loaded, settings), rolling_ball(loaded).surface
    for t, state in zip(times, states, strict=True):
        adapter.advance(t)
        sample = adapter.sample()
        for name, value in zip(("p_WB", "v_WB", "w_WB"), state, strict=True):
            expected = getattr(sample, name)
            np.testing.assert_allclose(value, expected, rtol=1e-8, atol=1e-8 * float(np.linalg.norm(expected)) + 1e-12)
        np.testing.assert_allclose(made["frame"](sample.p_WB), surface.frame(surface.locate(sample.p_WB)).T, atol=1e-12)
        assert made["gap"](sample.p_WB) == pytest.approx(float(surface.gap(sample.p_WB)), abs=1e-14)


@pytest.mark.parametrize(
    ("engine", "formulation", "preset"),
    [("exudyn", formulation, "matched") for formulation in ("generic", "carrier", "rolling_disc", "contact")]
    + [("mujoco", "free", "matched"), ("mujoco", "free", "tuned"), ("mujoco", "chart", "matched")],
)
def test_a_ball_that_stops(engine: str, formulation: str, preset: str) -> None:
    """Where rolling resistance ends the motion the program goes on as the adapter does, and its ball stays at rest."""
    scene = load_scene(PLANE, tilt=0.0, speed=0.02, cross_speed=0.01, normal_spin=0.0, rolling_resistance=1e-3)
    kind = kind_of(engine)
    settings = resolve_settings(kind, {"formulation": formulation, "preset": preset, "dt": 1e-3})
    times = [0.01 * step for step in range(21)]
    centres = np.array([state[0] for state in program(engine, settings, scene)["run"](times)])
    adapter, expected = kind.build(scene, settings), []
    for t in times:
        adapter.advance(t)
        expected.append(adapter.sample().p_WB)
    np.testing.assert_allclose(centres, expected, rtol=1e-8, atol=1e-10)
    np.testing.assert_allclose(centres[-1], centres[-5], rtol=0, atol=1e-10)


@pytest.mark.parametrize("formulation", ["composite", "free_flyer"])
@pytest.mark.parametrize("preset", ["default", "tuned"])
def test_the_program_ends_where_the_wall_would_pull(formulation: str, preset: str) -> None:
    """With fixed and with adaptive steps the program looks after each step whether the wall presses."""
    scene = load_scene(CYLINDER, speed=2)
    scene = scene_with(scene, surface=dataclasses.replace(scene.elements[0].surface, tilt=1.2))
    settings = resolve_settings(kind_of("pinocchio"), {"formulation": formulation, "preset": preset})
    with pytest.raises(RuntimeError, match="leaves the wall"):
        list(program("pinocchio", settings, scene)["run"]([0.1, 0.4]))


@pytest.mark.parametrize("options", [{"preset": "matched", "dt": 5e-3}, {"preset": "tuned", "rtol": 1e-6}], ids=name_of)
@pytest.mark.parametrize("formulation", ["null_space", "constraint_dynamics"])
def test_a_mechanism_moves_as_in_the_adapter(formulation: str, options: dict[str, Any]) -> None:
    """Its points are where the adapter has them, and after each step its loop is closed."""
    kind, scene = kind_of("pinocchio"), load_scene("four_bar")
    settings = resolve_settings(kind, {"formulation": formulation, **options})
    ((places, _, opened),) = program("pinocchio", settings, scene)["run"]([1.0])
    adapter, mechanism = kind.build(scene, settings), mechanism_of(scene)
    adapter.advance(1.0)
    sample = adapter.sample()
    turned = Rotation.from_quat(sample.q_WB, scalar_first=True)
    for point, found in zip(mechanism.points, places, strict=True):
        body = mechanism.body_index[point.body]
        np.testing.assert_allclose(found, sample.p_WB[body] + turned[body].apply(point.position), rtol=0, atol=1e-9)
    assert opened < 1e-14  # 2e-12 without


@pytest.mark.parametrize(
    ("engine", "name"),
    [
        ("exudyn", "stop"),
        ("exudyn", "spring_friction"),
        ("exudyn", "arm_pd"),
        ("exudyn", "gear_pair"),
        ("pinocchio", "saturated_servo"),
        ("pinocchio", "arm_pd"),
        ("pinocchio", "gear_pair"),
    ],
)
def test_a_program_has_the_laws_of_joints(engine: str, name: str) -> None:
    """Laws along a coordinate, actuators, couplings and rotors are part of the program."""
    kind, scene = kind_of(engine), load_scene(name)
    preset = "tuned" if name in {"stop", "spring_friction"} else "matched"
    formulation = {"exudyn": "redundant", "pinocchio": "null_space"}[engine]
    settings = resolve_settings(kind, {"formulation": formulation, "preset": preset})
    ((places, _, _),) = program(engine, settings, scene)["run"]([0.6])
    adapter = kind.build(scene, settings)
    adapter.advance(0.6)
    sample, mechanism = adapter.sample(), scene.elements[0].mechanism
    turned = Rotation.from_quat(sample.q_WB, scalar_first=True)
    followed = [(mechanism.body_index[point.body], point.position) for point in mechanism.points] or [(0, np.zeros(3))]
    expected = [sample.p_WB[body] + turned[body].apply(position) for body, position in followed]
    np.testing.assert_allclose(places, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("engine", "formulation"), [("exudyn", "redundant"), ("pinocchio", "constraint_dynamics")])
def test_a_program_has_constant_forces(engine: str, formulation: str) -> None:
    """Applied forces that do not change in time are part of the program."""
    kind, given = kind_of(engine), load_scene("slung_load")
    (element,) = given.elements
    held = [dataclasses.replace(f, value=tuple(f.at(0.1)), reaction="world") for f in element.mechanism.forces]  # type: ignore[attr-defined]
    mechanism = dataclasses.replace(element.mechanism, forces=tuple(held))  # type: ignore[attr-defined]
    scene = dataclasses.replace(given, elements=(type(element)(mechanism),))  # type: ignore[call-arg]
    settings = resolve_settings(kind, {"formulation": formulation, "preset": "matched"})
    (((place,), _, _),) = program(engine, settings, scene)["run"]([0.1])
    adapter = kind.build(scene, settings)
    adapter.advance(0.1)
    sample = adapter.sample()
    turned = Rotation.from_quat(sample.q_WB[1], scalar_first=True)
    np.testing.assert_allclose(place, sample.p_WB[1] + turned.apply((0, 0, -0.4)), rtol=0, atol=1e-9)


def test_a_function_is_in_no_program() -> None:
    """An effort with a limit is a function of Python's in Exudyn, and the program that would lack it is refused."""
    kind = kind_of("exudyn")
    with pytest.raises(Refused, match="are functions"):
        kind.reproducer(load_scene("saturated_servo"), resolve_settings(kind, {"formulation": "redundant"}))


@pytest.mark.parametrize(
    ("engine", "options", "parameters", "words"),
    [
        ("mujoco", {"formulation": "chart"}, {"mu_static": 0.3, "mu_kinetic": 0.2}, "one coefficient"),
        ("exudyn", {"formulation": "generic"}, {"mu_static": 0.3}, "proofroll's"),
        ("pinocchio", {"formulation": "composite"}, {"mu_static": 0.3}, "proofroll's"),
    ],
)
def test_what_has_no_program(engine: str, options: dict[str, str], parameters: dict[str, float], words: str) -> None:
    """Where there is no program, a sentence says why."""
    kind = kind_of(engine)
    with pytest.raises(Refused, match=words):
        kind.reproducer(load_scene(CYLINDER, **parameters), resolve_settings(kind, options))


@pytest.mark.parametrize(
    ("engine", "options", "where"),
    [
        ("mujoco", {"formulation": "free", "preset": "tuned"}, "ball.free:Free._add_curvature"),
        ("mujoco", {"formulation": "chart", "preset": "tuned"}, "ball.chart:Chart._resister"),
        ("mujoco", {"formulation": "joints", "preset": "tuned"}, "reproducer:stepped"),
        ("exudyn", {"formulation": "contact", "preset": "matched"}, "integration:Integration.advance"),
        ("pinocchio", {"formulation": "contact", "preset": "matched"}, "ball.contact:ContactSteps.kick"),
        ("pinocchio", {"formulation": "composite", "preset": "default"}, "integrators:TangentRungeKutta4._step"),
        ("pinocchio", {"formulation": "null_space", "preset": "matched"}, "smooth.null_space:LoopRows._of_loops"),
        ("exudyn", {"formulation": "redundant", "preset": "matched"}, "integration:Integration.advance"),
    ],
)
def test_the_loop_of_an_adapter_stands_once(engine: str, options: dict[str, str], where: str) -> None:
    """The program holds the lines of the adapter's own step, and needs the engine alone."""
    kind = kind_of(engine)
    mechanism = options["formulation"] in {"joints", "null_space", "redundant"}
    scene = load_scene("four_bar") if mechanism else load_scene(CYLINDER, **RESISTED)
    text = kind.reproducer(scene, resolve_settings(kind, options))
    module, _, step = where.partition(":")
    found: Any = importlib.import_module(f"proofroll.engines.{engine}.{module}")
    for name in step.split("."):
        found = getattr(found, name)
    assert "".join(inspect.getsource(found).splitlines(keepends=True)[-5:]) in text
    assert "proofroll" not in text
    assert {engine, "numpy"} <= set(imported_packages(text.partition("\n\n")[0])) <= {engine, "numpy", "scipy"}
