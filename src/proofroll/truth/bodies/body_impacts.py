"""Impacts in route 2: in turn, of a contact by roots of a polynomial, of contacts at one time by projections."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.coulomb import largest_friction, returning
from proofroll.elements.mechanism.contact.sequences import refuse_spread, sequences
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.switching.contact_guards import Touchable

_HELD = 1e-9  # margin, relative to friction's bound, above which a contact slides
_ROUNDS, _SETTLED = 100_000, 1e-15  # projections at most, and change of a slide, relative to the largest, at the end
_REAL = 1e-7  # imaginary part of a root, relative to its size, up to which it is real


class ImpactLaw(NamedTuple):
    """Laws of a contact in an impact.

    Attributes:
        contact: its name and coefficients of friction.
        restitution: of the normal speed.
        sideways: of the slip.
    """

    contact: Touchable
    restitution: float
    sideways: float


def impulse_of_a_contact(
    G: Array, slide: Array, friction: float, restitution: float, static: float | None = None, sideways: float = 0.0
) -> Array | None:
    """Impulse of an impact of one contact by Newton's and Coulomb's laws, (3,); None: no slip is against its friction.

    With slip in the direction t after the impact, the impulse is N (1, −μ t) with N from the normal speed. That the
    slip is along t has degree two in the components of t, and degree four in the tangent of half its angle.

    Args:
        G: changes of its slide by unit impulses, (3, 3).
        slide: before the impact, the first component along the normal, (3,).
        friction: coefficient of the slip.
        restitution: of the normal speed.
        static: coefficient of a contact that sticks; None: as of the slip.
        sideways: restitution of the slip.
    """
    static = friction if static is None else static
    slide = np.array([slide[0], *((1 + sideways) * slide[1:])])
    aim = -(1 + restitution) * slide[0]
    if not friction:
        return np.array([aim / G[0, 0], 0.0, 0.0])
    change = np.array([aim, *-slide[1:]])
    sticking_impulse = np.asarray(np.linalg.lstsq(G, change, rcond=RANK)[0], dtype=np.float64)
    rests = np.abs(G @ sticking_impulse - change).max() <= _HELD * np.abs(change).max()
    if np.isinf(friction):
        return sticking_impulse if rests and sticking_impulse[0] >= 0 else None
    if rests and np.linalg.norm(sticking_impulse[1:]) <= static * sticking_impulse[0] * (1 + _HELD):
        return sticking_impulse
    # slip · (G_nn − μ G_nt·t) = u + V t, as a function of t = (c, s)
    u = slide[1:] * G[0, 0] + aim * G[1:, 0]
    V = -friction * (np.outer(slide[1:], G[0, 1:]) + aim * G[1:, 1:])
    # its cross product with t is A c² + B c s + C s² + D c + E s; with c = (1 − h²)/(1 + h²) and s = 2h/(1 + h²):
    A, B, C, D, E = V[1, 0], V[1, 1] - V[0, 0], -V[0, 1], u[1], -u[0]
    roots = np.roots([A - D, 2 * (E - B), 4 * C - 2 * A, 2 * (B + E), A + D])
    heights = [root.real for root in roots if abs(root.imag) <= _REAL * max(1.0, abs(root))]
    angles = [2 * float(np.arctan(height)) for height in heights] + [np.pi]
    for angle in (_refined(angle, (A, B, C, D, E)) for angle in angles):
        t = np.array([np.cos(angle), np.sin(angle)])
        response = float(G[0, 0] - friction * G[0, 1:] @ t)
        if response <= 0:
            continue
        impulse: Array = aim / response * np.array([1.0, *(-friction * t)])
        slip = slide[1:] + G[1:] @ impulse
        across = abs(float(slip[0] * t[1] - slip[1] * t[0]))
        if slip @ t > 0 and across <= _HELD * float(np.abs(change).max()):
            return impulse
    return None


def _refined(angle: float, form: tuple[float, ...]) -> float:
    """Root of A c² + B c s + C s² + D c + E s near an angle, by Newton's method."""
    A, B, C, D, E = form
    for _ in range(4):
        c, s = np.cos(angle), np.sin(angle)
        value = A * c * c + B * c * s + C * s * s + D * c + E * s
        slope = 2 * (C - A) * c * s + B * (c * c - s * s) - D * s + E * c
        if not slope or abs(value) > abs(slope):
            break
        angle -= value / slope
    return float(angle)


def impulses_of_a_group(G: Array, slides: Array, laws: Sequence[ImpactLaw]) -> Array | None:
    """Impulses of contacts struck at one time, (3 contacts,), by Moreau's law; None: they are not found.

    They are the fixed point of a projection onto the cones of friction, with De Saxcé's correction of the slides:
    λ = P(λ − r (u + e u⁻ + μ|u_t| n)).

    Args:
        G: changes of the slides by unit impulses, (3 contacts, 3 contacts); first components are along the normals.
        slides: before the impact, (3 contacts,).
        laws: of each contact.
    """
    friction, static = (np.array([getattr(law.contact, name) for law in laws]) for name in ("friction", "static"))
    aims = returning(slides, np.array([law.restitution for law in laws]), np.array([law.sideways for law in laws]))
    r, size = 1 / float(np.linalg.eigvalsh(G)[-1]), float(np.abs(aims).max())
    impulses = np.linalg.lstsq(G, -aims, rcond=RANK)[0]
    N, T = impulses[::3], np.linalg.norm(impulses.reshape(-1, 3)[:, 1:], axis=1)
    within = (N >= 0).all() and (largest_friction(static, N) * (1 + _HELD) >= T).all()
    if within and np.abs(G @ impulses + aims).max() <= _HELD * size:
        return np.asarray(impulses)
    slipping = np.where(np.isinf(friction), 0.0, friction)  # of what never slips the cone is a half space
    for _ in range(_ROUNDS):
        u = aims + G @ impulses
        u[::3] += slipping * np.linalg.norm(u.reshape(-1, 3)[:, 1:], axis=1)
        projected = _onto_cones((impulses - r * u).reshape(-1, 3), friction).ravel()
        if np.abs(G @ (projected - impulses)).max() <= _SETTLED * size:
            return projected
        impulses = projected
    return None


def _onto_cones(forces: Array, friction: Array) -> Array:
    """Nearest vectors within the cones of friction, (contacts, 3)."""
    N, T = forces[:, 0], np.linalg.norm(forces[:, 1:], axis=1)
    unbounded = np.isinf(friction)
    friction = np.where(unbounded, 0.0, friction)
    pressed = np.maximum((N + friction * T) / (1 + friction**2), 0.0)
    inside = np.where(unbounded, N > 0, friction * N >= T)
    normal, across = np.where(inside, N, pressed), np.where(inside, T, friction * pressed)
    return np.column_stack([normal, forces[:, 1:] * (across / np.where(T > 0, T, 1.0))[:, None]])


def impulses_in_turn(
    G: Array, slides: Array, groups: Sequence[list[int]], laws: Sequence[ImpactLaw], time: float
) -> Array:
    """Impulses of groups struck in turn, (3 contacts,): of all orders, those farthest from their mean.

    Args:
        G: changes of all slides by unit impulses, (3 contacts, 3 contacts); first components are along the normals.
        slides: before the impact, (3 contacts,).
        groups: indices of contacts that are struck together.
        laws: of each contact.
        time: for messages [s].

    Raises:
        NotUnique: the outcome depends on the order, or a contact would tear.
    """

    def strike(response: Array, changes: Array, group: list[int]) -> Array:
        if len(group) == 1:
            law = laws[group[0]]
            contact, e = law.contact, law.restitution
            impulses = impulse_of_a_contact(response, changes, contact.friction, e, contact.static, law.sideways)
        else:
            impulses = impulses_of_a_group(response, changes, [laws[k] for k in group])
        if impulses is None:
            named = " and ".join(laws[k].contact.name for k in group)
            raise Refused(f"no impulses of {named} at t = {time:.6g} s keep all inequalities of an impact")
        return impulses

    outcomes = sequences(G, slides, groups, strike)
    jumps = G @ outcomes.impulses.T
    refuse_spread(jumps, outcomes, [law.contact.name for law in laws], time)
    apart = np.abs(jumps - jumps.mean(axis=1, keepdims=True)).max(axis=0)
    return np.asarray(outcomes.impulses[int(np.argmax(apart))])
