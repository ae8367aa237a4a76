"""Laws of published values that follow from others: energy, points, pulls of springs, and two names of one value."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from proofroll.truth.check.laws.contacts import gap_of, slide_of
from proofroll.truth.check.laws.integrals import along, cross, dot, norm, of_angles, of_quaternion, turned
from proofroll.truth.check.laws.joints import coordinate_of
from proofroll.truth.check.laws.loads import bushing_load, rotation_vector, spring_ends, spring_pull
from proofroll.truth.check.laws.record import Array, BodyPoses, PublishedValues
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.samples import kinetic_energy
from proofroll.truth.check.laws.scene import LawScene

_PART = 1e-3  # part of a natural size that counts in the size of a value
# Published residuals of laws, each with the natural sizes of the scene whose product is its size.
_RESIDUALS: Mapping[str, tuple[str, ...]] = {
    "penetration": ("length",), "drift": ("length",), "hop_speed": ("speed",), "friction_direction": (),
    "contact_pull": ("force",), "cone_excess": ("force",), "natural_map": ("force",),
    "energy_gain": ("force", "length"), "momentum_error": ("force", "time"),
    "angular_momentum_error": ("force", "length", "time"),
}  # fmt: skip


def values_follow(scene: LawScene, published: PublishedValues, residuals: LawResiduals, begun: BodyPoses) -> None:
    """Checks values at samples; ``begun``: motion from the start, or as soon as it is known."""
    _coordinates(scene, published, residuals)
    _energies(scene, published, residuals, begun)
    _points(scene, published, residuals)
    _links(scene, published, residuals)
    _contacts(scene, published, residuals)
    _names(scene, published, residuals)
    _gathered(scene, published, residuals)
    _on_wall(scene, published, residuals)
    _nothing_left(scene, published, residuals)


def _vector(published: PublishedValues, name: str) -> Array:
    return np.stack([published.values[f"{name}.{axis}"] for axis in "xyz"], -1)


def _coordinates(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Coordinates and rates of joints with one are those of the poses."""
    pieces = published.pieces
    for number, joint in enumerate(scene.mechanism.joints):
        if joint.nq != 1:
            continue
        connection = scene.connections[number]
        placed = scene.placed(connection, pieces)
        place, (_, rate, turns) = (coordinate_of(scene, number, 0, pieces, placed), placed.free(connection.kind)[0])
        unit = 1.0 if turns else scene.length
        for name, value, size in (("q", place, unit), ("v", rate, unit * scene.rate)):
            off = published.values[f"{name}.{joint.name}"][:, None] - value
            residuals.note("value", f"{name}.{joint.name}", off, size + np.abs(value), pieces.time)


def energy_of(scene: LawScene, pieces: BodyPoses) -> tuple[Array, Array]:
    """Energy, and the sizes of its parts [J]; ``pieces`` tell whole turns."""
    m, (total, size) = scene.mechanism, kinetic_energy(scene, pieces)
    size = size + _PART * scene.mass.sum() * scene.speed**2
    for spring in m.springs:
        ends = spring_ends(scene, pieces, spring)
        part = 0.5 * spring.stiffness * (norm(ends[1] - ends[0]) - spring.length) ** 2
        total, size = total + part, size + part + _PART * spring.stiffness * scene.length**2
    for bushing in m.bushings:
        a, b = scene.index[bushing.body_a], scene.index[bushing.body_b]
        A = pieces.R[..., a, :, :] @ of_angles(np.array(bushing.orientation_a))
        B = pieces.R[..., b, :, :] @ of_angles(np.array(bushing.orientation_b))
        ends = spring_ends(scene, pieces, bushing)
        bent, stiffness = rotation_vector(A.swapaxes(-1, -2) @ B), np.array(bushing.stiffness)
        stretched = turned(A.swapaxes(-1, -2), ends[1] - ends[0])
        part = 0.5 * (stretched**2 @ stiffness[:3] + bent**2 @ stiffness[3:])
        total = total + part
        size = size + part + _PART * (stiffness[:3].max() * scene.length**2 + stiffness[3:].max())
    assert pieces.turns is not None
    for number, joint in enumerate(m.joints):
        if not joint.stiffness:
            continue
        connection = scene.connections[number]
        placed = scene.placed(connection, pieces)
        for k, (direction, _, turns) in enumerate(placed.free(connection.kind)):
            place = pieces.turns[..., number, k] if turns else dot(placed.origin_b - placed.origin_a, direction)
            part = 0.5 * joint.stiffness * (place - joint.rest) ** 2
            unit = 1.0 if turns else scene.length
            total, size = total + part, size + part + _PART * joint.stiffness * unit**2
    return total, size


def _energies(scene: LawScene, published: PublishedValues, residuals: LawResiduals, begun: BodyPoses) -> None:
    """Energy is kinetic, of gravity, and of springs."""
    pieces = published.pieces
    total, size = energy_of(scene, pieces)
    energy = published.values["energy"][:, None]
    residuals.note("value", "energy", energy - total, size, pieces.time)
    for name in ("energy_error", "energy_change"):
        if name in published.values and begun.time[0, 0] <= 0:
            first, size_then = energy_of(scene, begun)
            off = published.values[name][:, None] - (energy - first[:1])
            residuals.note("value", name, off, size + size_then[:1], pieces.time)


def _points(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Tracked points are fixed to their bodies."""
    pieces = published.pieces
    for k, point in enumerate(scene.mechanism.points):
        body = scene.index[point.body]
        place = pieces.p[..., body, :] + turned(pieces.R[..., body, :, :], np.array(point.position))
        size = scene.length + norm(place)
        for values in (_vector(published, point.name), published.values["positions"][:, k]):
            residuals.note("value", point.name, norm(values[:, None] - place), size, pieces.time)
    if not scene.mechanism.points:
        both = published.values["positions"], scene.centres(pieces)[0][:, 0, :-1]
        _same("positions", both, published, residuals, scene.length)


def _links(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Pulls of springs and loads of bushings follow from their laws."""
    pieces = published.pieces
    for spring in scene.mechanism.springs:
        pull = spring_pull(scene, pieces, spring)[0]
        size = np.abs(pull) + spring.stiffness * scene.length + spring.damping * scene.speed + _PART * scene.force
        off = published.values[f"force.{spring.name}"][:, None] - pull
        residuals.note("value", f"force.{spring.name}", off, size, pieces.time)
    for bushing in scene.mechanism.bushings:
        force, moment, _, _ = bushing_load(scene, pieces, bushing)
        stiffness, damping = np.array(bushing.stiffness), np.array(bushing.damping)
        unit = stiffness[:3].max() * scene.length + damping[:3].max() * scene.speed + _PART * scene.force
        turning = stiffness[3:].max() + damping[3:].max() * scene.rate + _PART * scene.force * scene.length
        for kind, value, size in (("force", force, unit), ("torque", moment, turning)):
            off = norm(_vector(published, f"{kind}.{bushing.name}")[:, None] - value)
            residuals.note("value", f"{kind}.{bushing.name}", off, size + norm(value), pieces.time)


def _contacts(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Gaps and slips follow from poses and velocities."""
    pieces = published.pieces
    for k, contact in enumerate(scene.contacts):
        far = scene.length + np.abs(pieces.p[..., [contact.a, contact.b], :]).max((-1, -2))
        if contact.alone:
            off = published.values[f"gap.{contact.name}"][:, None] - gap_of(contact, pieces)
            residuals.note("value", f"gap.{contact.name}", off, far, pieces.time)
        slide, normal = slide_of(contact, pieces, pieces.place[..., k, :]), pieces.normal[..., k, :]
        slip = norm(slide - dot(slide, normal)[..., None] * normal)
        fast = scene.speed + sum(norm(pieces.v[..., body, :]) for body in (contact.a, contact.b))
        fast = fast + sum(norm(pieces.w[..., body, :]) for body in (contact.a, contact.b)) * far
        off = published.values[f"slip.{contact.name}"][:, None] - slip
        residuals.note("value", f"slip.{contact.name}", off, fast, pieces.time)


def _names(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Two variables of one quantity are equal."""
    values, pieces = published.values, published.pieces
    forces = pieces.force[:, 0]
    rotations = of_quaternion(values["attitudes"])
    pairs: list[tuple[str, Array, Array]] = [("attitudes", rotations, pieces.R[:, 0, :-1])]
    names = [contact.name for contact in scene.contacts]
    if names:
        pairs += [
            ("contact_forces", values["contact_forces"], forces),
            ("gaps", values["gaps"], np.stack([values[f"gap.{name}"] for name in names], -1)),
            ("slips", values["slips"], np.stack([values[f"slip.{name}"] for name in names], -1)),
            ("normal_forces", values["normal_forces"], along(forces, pieces.normal[:, 0])),
        ]
    shared = dict[str, list[int]]()
    for k, contact in enumerate(scene.contacts):
        shared.setdefault(contact.pair.name, []).append(k)
    pairs += [
        (f"force.{name}", _vector(published, f"force.{name}"), forces[:, numbers].sum(1))
        for name, numbers in shared.items()
        if len(numbers) > 1 and f"force.{name}.x" in values
    ]
    for body in scene.mechanism.bodies:
        if f"net_force.{body.name}.x" in values:
            number = scene.index[body.name]
            signs = np.array([(contact.a == number) - (contact.b == number) for contact in scene.contacts], float)
            total = np.einsum("k,tki->ti", signs, forces)
            pairs.append((f"net_force.{body.name}", _vector(published, f"net_force.{body.name}"), total))
        if f"net_torque.{body.name}.x" in values:
            number, centres = scene.index[body.name], scene.centres(pieces)[0][:, 0]
            signs = np.array([(contact.a == number) - (contact.b == number) for contact in scene.contacts], float)
            arms = pieces.place[:, 0] - centres[:, number, None]
            total = np.einsum("k,tki->ti", signs, cross(arms, forces))
            both, least = (_vector(published, f"net_torque.{body.name}"), total), norm(arms).max() * np.abs(forces)
            _same(f"net_torque.{body.name}", both, published, residuals, float(np.nanmax(least, initial=0.0)))
    for name, first, second in pairs:
        _same(name, (first, second), published, residuals)


def _gathered(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Tables of forces and moments have those that are named, in order."""
    values, bushings = published.values, [item.name for item in scene.mechanism.bushings]
    for kind in ("force", "torque"):
        columns = [values[f"{kind}.{item.name}.{axis}"] for item in scene.connections for axis in "xyz"]
        determinate = [column for column in columns if not np.isnan(column).all()]
        if len(determinate) == values.get(f"{kind}s", np.zeros((0, 0))).shape[1] > 0:
            _same(f"{kind}s", (values[f"{kind}s"], np.stack(determinate, -1)), published, residuals)
        net = [name[:-2] for name in values if name.startswith(f"net_{kind}.") and name.endswith(".x")]
        for group, names in ((f"net_{kind}s", net), (f"bushing_{kind}s", [f"{kind}.{name}" for name in bushings])):
            if group in values:
                vectors = np.stack([_vector(published, name) for name in names], 1)
                _same(group, (values[group].reshape(vectors.shape), vectors), published, residuals)


def _nothing_left(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Published residuals of laws are round-off."""
    largest = max(scene.force, float(np.nanmax(np.abs(published.pieces.force), initial=0.0)))
    sizes = {"length": scene.length, "speed": scene.speed, "force": largest, "time": 1 / scene.rate}
    for name in sorted(_RESIDUALS.keys() & published.values.keys()):
        rest = published.values[name].reshape(len(published.values[name]), -1)
        size = math.prod(sizes[factor] for factor in _RESIDUALS[name])
        residuals.note("nothing left", name, rest, size, published.pieces.time)


def _on_wall(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Forces, slips, spins and coordinates of a ball in the local frame of its wall are those of its contact."""
    values, pieces = published.values, published.pieces
    if len(scene.contacts) != 1 or "slip2" not in values:
        return
    contact, normal = scene.contacts[0], pieces.normal[:, 0, 0]
    ball, wall, shape = contact.a, contact.b, contact.shape_b
    if contact.shape_a.kind != "sphere":
        ball, wall, shape = contact.b, contact.a, contact.shape_a
    p, v, w = (item[:, 0, ball] for item in (pieces.p, pieces.v, pieces.w))
    spin, *turning = (values[f"omega{k}"] for k in (1, 2, 3))
    about, slip, fast = dot(w, normal), values[f"slip.{contact.name}"], scene.speed + float(norm(v).max())
    rows: list[tuple[str, Array, Array, float]] = [
        ("slip2, slip3", np.hypot(values["slip2"], values["slip3"]), slip, fast),
        ("slip", values["slip"], slip, fast),
        ("gap", values["gap"], values[f"gap.{contact.name}"], scene.length),
        ("attitude", of_quaternion(values["attitude"]), pieces.R[:, 0, ball], 1.0),
        ("omega1", np.abs(spin), np.abs(about), scene.rate),
        ("omega2, omega3", np.hypot(*turning), norm(w - about[:, None] * normal), scene.rate),
    ]
    if wall == scene.index["world"] and np.array_equal(shape.axis, (0, 0, 1)) and not shape.centre.any():
        (x, y, z), (vx, vy, vz) = p.T, v.T
        across, told = np.hypot(x, y), dict[str, Array]()
        if shape.kind == "plane":
            told = {"down": x, "across": -y, "down_rate": vx, "across_rate": -vy}
        elif shape.kind in {"bore", "shaft"}:
            told = {"z": z, "z_rate": vz, "gamma_rate": (x * vy - y * vx) / across**2}
            rows.append(("gamma", np.exp(1j * values["gamma"]), (x + 1j * y) / across, 1.0))
        rows += [(name, values[name], value, scene.length * (scene.rate + 1)) for name, value in told.items()]
    if "N" in values:
        force = pieces.force[:, 0, 0]
        pressed, least = dot(force, normal), float(np.nanmax(np.abs(force), initial=0.0))
        rub = norm(force - pressed[:, None] * normal)
        rows += [("N", values["N"], pressed, least), ("F2, F3", np.hypot(values["F2"], values["F3"]), rub, least)]
        rows += [("needed_friction", values["needed_friction"] * values["N"], rub, least)]
    for name, value, expected, size in rows:
        _same(name, (value, expected), published, residuals, size)


def _same(
    name: str, both: Sequence[Array], published: PublishedValues, residuals: LawResiduals, least: float = 0.0
) -> None:
    size = max([least, *(float(np.nanmax(np.abs(item), initial=0.0)) for item in both)])
    off = np.abs(both[0] - both[1]).reshape(len(both[0]), -1)
    rest = np.where(np.isnan(off), 0.0, off).max(1, initial=0.0)
    residuals.note("spelling", name, rest[:, None], size, published.pieces.time)
