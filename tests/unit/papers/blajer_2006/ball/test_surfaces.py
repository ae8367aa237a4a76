from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder

STEP = 1e-5  # [m or rad]; a central difference is then off by STEP² and by round-off/STEP, both below 1e-9
CLOSE = 1e-8

SURFACES = [
    UprightCylinder("wall", 0.2),
    UprightCylinder("wall", 0.225, tilt=0.4).offset(0.025),
]


@pytest.fixture(params=SURFACES, ids=["upright", "tilted"])
def surface(request: pytest.FixtureRequest) -> Any:
    """Cylinders, upright and tilted."""
    return request.param


@pytest.fixture
def u() -> np.ndarray:
    """Points of a surface, less than half a turn around."""
    return np.random.default_rng(1).uniform([-3, 0.3], [3, 3], (20, 2))


def differentiated(function: Any, x: np.ndarray) -> np.ndarray:
    """Central differences of ``function`` in the last axis of ``x``, as a new last axis."""
    directions = np.eye(x.shape[-1]) * STEP
    return np.stack([(function(x + d) - function(x - d)) / (2 * STEP) for d in directions], axis=-1)


def test_tangents(surface: Any, u: np.ndarray) -> None:
    """The tangents are the derivatives of the position."""
    assert surface.tangents(u) == pytest.approx(differentiated(surface.position, u), abs=CLOSE)


def test_second_derivatives(surface: Any, u: np.ndarray) -> None:
    """The second derivatives are the derivatives of the tangents."""
    assert surface.second(u) == pytest.approx(differentiated(surface.tangents, u), abs=CLOSE)


def test_frame(surface: Any, u: np.ndarray) -> None:
    """The frame is right-handed and orthonormal, with e1 normal to both tangents and e2 along the first."""
    frame, tangents = surface.frame(u), surface.tangents(u)
    assert np.swapaxes(frame, -1, -2) @ frame == pytest.approx(np.broadcast_to(np.eye(3), frame.shape), abs=1e-14)
    assert np.linalg.det(frame) == pytest.approx(1.0, abs=1e-14)
    assert np.einsum("ti,tij->tj", frame[..., 0], tangents) == pytest.approx(0.0, abs=1e-14)
    along = tangents[..., 0] / np.linalg.norm(tangents[..., 0], axis=-1, keepdims=True)
    assert frame[..., 1] == pytest.approx(along, abs=1e-14)


def test_length_scales(surface: Any, u: np.ndarray) -> None:
    """A coordinate's length scale is the length of its tangent, on a surface that is the same everywhere."""
    lengths = np.linalg.norm(surface.tangents(u), axis=-2)
    assert lengths == pytest.approx(np.broadcast_to(surface.length_scales, lengths.shape), rel=1e-14)


def test_locate_inverts_position(surface: Any, u: np.ndarray) -> None:
    """The coordinates of a point on the surface are those it was made from."""
    assert surface.locate(surface.position(u)) == pytest.approx(u, abs=1e-13)


def test_locate_of_a_point_off_the_surface(surface: Any, u: np.ndarray) -> None:
    """A point moved along the normal keeps its coordinates."""
    moved = surface.position(u) - 0.01 * surface.frame(u)[..., 0]
    assert surface.locate(moved) == pytest.approx(u, abs=1e-13)


def test_gap_is_the_distance_along_the_normal(surface: Any, u: np.ndarray) -> None:
    """The gap is zero on the surface, positive away from the wall and negative inside it."""
    for distance in (0.0, 0.013, -0.002):
        moved = surface.position(u) - distance * surface.frame(u)[..., 0]
        assert surface.gap(moved) == pytest.approx(distance, abs=1e-14)


def test_normal_is_minus_the_gradient_of_the_gap(surface: Any, u: np.ndarray) -> None:
    """The normal is the direction in which the gap closes, on the surface and beside it."""
    p = surface.position(u) - 0.01 * surface.frame(u)[..., 0]
    assert surface.normal(p) == pytest.approx(-differentiated(surface.gap, p), abs=CLOSE)


def test_normal_gradient(surface: Any, u: np.ndarray) -> None:
    """The gradient of the normal is its derivative by position, on the surface and beside it."""
    p = surface.position(u) - 0.01 * surface.frame(u)[..., 0]
    assert surface.normal_gradient(p) == pytest.approx(differentiated(surface.normal, p), abs=10 * CLOSE)


def test_both_descriptions_have_one_normal(surface: Any, u: np.ndarray) -> None:
    """The normal of the signed distance is e1 of the parametrisation."""
    assert surface.normal(surface.position(u)) == pytest.approx(surface.frame(u)[..., 0], abs=1e-14)


def test_both_descriptions_have_one_curvature(surface: Any, u: np.ndarray) -> None:
    """The second fundamental form is the same from second derivatives and from the signed distance."""
    tangents = surface.tangents(u)
    from_parametrisation = np.einsum("ti,tijk->tjk", surface.frame(u)[..., 0], surface.second(u))
    from_distance = -np.einsum("tij,tik,tkl->tjl", tangents, surface.normal_gradient(surface.position(u)), tangents)
    assert from_parametrisation == pytest.approx(from_distance, abs=1e-14)


def test_offset(u: np.ndarray) -> None:
    """The surface of the centre lies one ball's radius from the wall, towards the inside."""
    wall = UprightCylinder("wall", 0.225, tilt=0.1)
    assert wall.gap(wall.offset(0.025).position(u)) == pytest.approx(0.025, abs=1e-14)


def test_leading_dimensions(surface: Any) -> None:
    """Every method takes points with any leading dimensions and gives what it gives for each point alone."""
    u = np.random.default_rng(2).uniform(-3, 3, (2, 3, 2))
    p = surface.position(u)
    for method, points in [
        ("position", u), ("tangents", u), ("second", u), ("frame", u),
        ("locate", p), ("gap", p), ("normal", p), ("normal_gradient", p),
    ]:  # fmt: skip
        together = getattr(surface, method)(points)
        alone = getattr(surface, method)(points[1, 2])
        assert np.shape(together) == (2, 3, *np.shape(alone)), method
        assert together[1, 2] == pytest.approx(alone, abs=1e-14), method


def test_cylinder_coordinates() -> None:
    """γ grows from x to y and z is the height."""
    assert UprightCylinder("wall", 0.2).position([np.pi / 2, 0.3]) == pytest.approx([0.0, 0.2, 0.3], abs=1e-15)


def test_one_point_is_as_many(surface: Any) -> None:
    """Geometry at a single point, which takes another way for speed, is that of arrays of points."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        p, u = rng.normal(size=3), rng.normal(size=2)
        for name in ("normal", "gap", "normal_gradient", "locate"):
            one, many = getattr(surface, name)(p), getattr(surface, name)(p[None])[0]
            assert np.shape(one) == np.shape(many)
            np.testing.assert_allclose(one, many, rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(surface.frame(u), surface.frame(u[None])[0], rtol=1e-13, atol=1e-15)
        gap, *e1 = surface.nearby(*p.tolist())
        np.testing.assert_allclose([gap, *e1], [surface.gap(p[None])[0], *surface.normal(p[None])[0]], rtol=1e-12)
        triad = np.reshape(surface.triad(*p.tolist()), (3, 3)).T
        np.testing.assert_allclose(triad, surface.frame(surface.locate(p[None]))[0], rtol=1e-12, atol=1e-14)


def test_a_start_without_a_normal_is_refused(tmp_path: Path) -> None:
    """Where a surface has no normal, as at the apex of a cone, a scene says so in a line; nothing there is a number."""
    text = (data_folder("models") / "cone" / "scene.toml").read_text(encoding="utf-8")
    (tmp_path / "scene.toml").write_text(text.replace('coordinates = [0, "$start"]', "coordinates = [0, 0]"))
    with pytest.raises(InputError, match="no normal there, as at an apex; start elsewhere"):
        load_scene(str(tmp_path))
