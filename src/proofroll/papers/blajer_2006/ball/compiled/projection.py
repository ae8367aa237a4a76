"""Blajer's projection method for a ball in a cylinder, in symbols and compiled.

The matrices are those of the engine ``projection``, but share no code with it: the velocities s move the ball by
v = D s, with v = [v1 v2 v3 ω1 ω2 ω3] along the local axes; a dot is a rate seen from the world. The system of the
tangential projection and the non-holonomic constraints C v = 0,

    [M̄ C_nhᵀ; C_nh 0] [ṡ; λ] = [Dᵀ (f - M Ḋ s); ξ],

is solved in symbols by the Schur complement S = C_nh M̄⁻¹ C_nhᵀ. D M̄⁻¹ Dᵀ is M⁻¹ without the direction e1, which the
wall holds (the rotational block of D is square), so that S = (1/m + a²/J) 1. Source: W. Blajer, Math. Comput. Model.
Dyn. Syst. 12(6), 2006, 543-553, sections 2.1-2.4.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from proofroll.papers.blajer_2006.ball.compiled.rolling import CompiledEquations, Function
from proofroll.papers.blajer_2006.ball.model import RollingBall

Formulation = Literal["euler", "rotating_frame"]
_Symbols = npt.NDArray[np.object_]

# Order of the run-time parameters.
PARAMETERS = ("J/m", "m/J", "1/(m S)", "radius", "f", "g_x", "g_y", "g_z", "c", "1/c^2")
# Distance of an entry of a rotation matrix from 0 or 1 below which it is set to that.
_ZERO = 4 * np.finfo(float).eps
# F0, Fc and Fs, see :class:`Structure`, where the first coordinate is an angle about the vertical.
_UPRIGHT = (*(0.0,) * 8, 1.0, 1.0, *(0.0,) * 3, 1.0, *(0.0,) * 4, *(0.0, -1.0, 0.0, 1.0), *(0.0,) * 5)


@dataclass(frozen=True)
class Structure:
    """Properties of a scene that decide the form of the equations; all other numbers are parameters.

    Attributes:
        formulation: as in the engine ``projection``.
        resistance: True with rolling resistance.
        frame: F = F0 + cos γ Fc + sin γ Fs, columns e1, e2, e3 in the world: entries of F0, Fc, Fs.
        gravity: True for each nonzero component of gravity in the world.
    """

    formulation: Formulation
    resistance: bool
    frame: tuple[float, ...]
    gravity: tuple[bool, ...]

    @property
    def upright(self) -> bool:
        """True if F is a rotation about the vertical by γ."""
        return self.frame == _UPRIGHT


def structure(body: RollingBall, formulation: Formulation) -> Structure:
    """Form of the equations of a scene."""
    frame_at_zero, quarter, half = (body.surface.frame(np.array([angle, 0.0])) for angle in (0.0, np.pi / 2, np.pi))
    constant = (frame_at_zero + half) / 2
    parts = np.stack([constant, frame_at_zero - constant, quarter - constant])
    whole = np.round(parts)
    parts = np.where(np.abs(parts - whole) < _ZERO, whole, parts) + 0.0  # -0 is 0
    return Structure(
        formulation=formulation,
        resistance=body.contact.rolling_resistance > 0,
        frame=tuple(parts.ravel().tolist()),
        gravity=tuple(bool(component) for component in body.gravity),
    )


def parameters(body: RollingBall) -> list[float]:
    """Values of :data:`PARAMETERS`."""
    ball, c = body.ball, body.surface.radius
    j = ball.inertia_ratio * ball.radius**2
    per_S = 1 / (1 + ball.radius**2 / j)
    return [j, 1 / j, per_S, ball.radius, body.contact.rolling_resistance, *body.gravity.tolist(), c, 1 / c**2]


@dataclass(frozen=True)
class ProjectionEquations:
    """Equations of the projection solver as symbols.

    Attributes:
        system: state variable and its rate, for q = [u, angles] and s.
        N: normal force over mass [m/s²].
        multipliers: λ_nh = -F2, -F3, over mass [m/s²].
    """

    system: list[tuple[Any, Any]]
    N: Any
    multipliers: tuple[Any, Any]

    @property
    def state(self) -> list[Any]:
        """The state variables."""
        return [variable for variable, _ in self.system]


def equations(form: Structure) -> ProjectionEquations:
    """The equations of motion, derived in symbols from the projection method's matrices."""
    import heyoka as hy

    j, per_j, per_S, a, f, *gravity, c, per_c2 = (hy.par[i] for i in range(len(PARAMETERS)))
    u = hy.make_vars("u1", "u2")
    angles = hy.make_vars("phi", "theta", "psi") if form.formulation == "euler" else []
    s = np.array(hy.make_vars("s1", "s2", "s3", "s4", "s5"), dtype=object)
    constant, cosine, sine = np.array(form.frame).reshape(3, 3, 3).astype(object)
    frame = constant + hy.cos(u[0]) * cosine + hy.sin(u[0]) * sine
    turning = np.array([[0.0, -s[0], 0.0], [s[0], 0.0, 0.0], [0.0, 0.0, 0.0]], dtype=object)  # FᵀḞ
    if form.formulation == "rotating_frame":
        A, drift_of_spin, inverse = np.eye(3).astype(object), turning @ s[2:], np.eye(3).astype(object)
    elif form.upright:  # F turns the axes of the angles about the vertical, as ψ does
        A, drift_of_spin, inverse = _euler_angles(angles[1], angles[2] - u[0], s[2:])
    else:
        axes, drift_of_axes, inverse = _euler_angles(angles[1], angles[2], s[2:])
        A, drift_of_spin = frame.T @ axes, frame.T @ drift_of_axes

    D = np.full((6, 5), 0.0, dtype=object)
    D[1, 0], D[2, 1], D[3:, 2:] = c, 1.0, A
    drift = np.full(6, 0.0, dtype=object)  # Ḋ s
    drift[0] = -c * s[0] ** 2
    drift[3:] = drift_of_spin
    v = D @ s
    M = np.array([1.0] * 3 + [j] * 3, dtype=object)  # over m, and so are all forces
    force = np.full(6, 0.0, dtype=object)
    force[:3] = frame.T @ np.where(form.gravity, np.array(gravity, dtype=object), 0.0)
    N = force[0] - drift[0]
    if form.resistance:
        lever = N * f / hy.sqrt(v[1] ** 2 + v[2] ** 2)
        force[4], force[5] = -lever * v[2], lever * v[1]
    mobility = np.full((5, 5), 0.0, dtype=object)  # M̄⁻¹
    mobility[0, 0], mobility[1, 1], mobility[2:, 2:] = per_c2, 1.0, inverse * per_j
    projector = np.array([0.0, 1.0, 1.0, per_j, per_j, per_j], dtype=object)  # diagonal of D M̄⁻¹ Dᵀ
    rows = np.array([[0.0, 1.0, 0.0, 0.0, 0.0, a], [0.0, 0.0, 1.0, 0.0, -a, 0.0]], dtype=object)
    seen_from_frame = np.concatenate([turning @ v[:3], turning @ v[3:]])
    unheld = rows @ (projector * force - seen_from_frame)  # C_nh M̄⁻¹ Dᵀ (f - M Ḋ s) - ξ: the drift drops out
    multipliers = per_S * unheld
    acceleration = mobility @ (D.T @ (force - M * drift - rows.T @ multipliers))
    rates = [s[0], s[1], *(s[2:] if angles else []), *acceleration]
    system = [(variable, hy.expression(0.0) + rate) for variable, rate in zip([*u, *angles, *s], rates, strict=True)]
    return ProjectionEquations(system, N, (multipliers[0], multipliers[1]))


def _euler_angles(theta: Any, psi: Any, r: _Symbols) -> tuple[_Symbols, _Symbols, _Symbols]:
    """A, Ȧ r and (AᵀA)⁻¹ along axes that stand still, where ω = A r; see the engine's ``orientation`` module."""
    import heyoka as hy

    phi_rate, theta_rate, psi_rate = r
    sin, cos, sin_psi, cos_psi = hy.sin(theta), hy.cos(theta), hy.sin(psi), hy.cos(psi)
    axes = np.array([[sin * sin_psi, cos_psi, 0.0], [-sin * cos_psi, sin_psi, 0.0], [cos, 0.0, 1.0]], dtype=object)
    tilted, turned, node = phi_rate * theta_rate, phi_rate * psi_rate * sin, theta_rate * psi_rate
    drift = np.array(
        [
            tilted * cos * sin_psi + turned * cos_psi - node * sin_psi,
            -tilted * cos * cos_psi + turned * sin_psi + node * cos_psi,
            -tilted * sin,
        ],
        dtype=object,
    )
    # AᵀA = [1 0 cos θ; 0 1 0; cos θ 0 1] and det A = sin θ
    whole = 1.0 / sin**2
    inverse = np.array([[whole, 0.0, -cos * whole], [0.0, 1.0, 0.0], [-cos * whole, 0.0, whole]], dtype=object)
    return axes, drift, inverse


@lru_cache(maxsize=16)
def projected(form: Structure, tolerance: float) -> CompiledEquations:
    """Compiled integrator like :func:`rolling.reduced`, with the forces N, λ1 and λ2."""
    import heyoka as hy

    symbols = equations(form)
    outputs = [*(rate for _, rate in symbols.system), symbols.N, *symbols.multipliers]
    return CompiledEquations(
        integrator=hy.taylor_adaptive(symbols.system, [1.0] * len(symbols.system), tol=tolerance),
        evaluate=Function(outputs, symbols.state),
    )
