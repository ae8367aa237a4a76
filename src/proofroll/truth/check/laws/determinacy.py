"""Law of what is not determinate: exactly the components of reactions that change while no body accelerates."""

from __future__ import annotations

import numpy as np

from proofroll.truth.check.laws.impacts import held
from proofroll.truth.check.laws.integrals import cross
from proofroll.truth.check.laws.record import Array, BodyPoses, PublishedValues
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import LawScene

_ARRAYS = ("time", "pace", "p", "R", "v", "w")
_RANK = 1e-11  # singular value, relative to the largest, below which reactions are not independent
_FIXED, _FREE = 1e-9, 1e-4  # change of a component, relative to the largest, that is none, and that is one


def determinate_reactions(scene: LawScene, published: PublishedValues, residuals: LawResiduals) -> None:
    """Checks, without contacts, that unknown components change at one of three samples, and known ones at none."""
    wrenches, m = published.reactions[:, 0], scene.mechanism
    unknown, last, most = np.isnan(wrenches).all(0), len(wrenches) - 1, np.zeros(wrenches.shape[1:])
    if scene.contacts or not (unknown.any() or m.loops):
        return
    for row in {0, last // 2, last}:
        poses = BodyPoses(**{name: getattr(published.pieces, name)[[row]] for name in _ARRAYS})
        most = np.maximum(most, _changes(scene, poses))
    # drives and couplings have reactions of their own, by which further components may change
    passive = not m.couplings and all(joint.motion is None for joint in m.joints)
    wrong = np.where(unknown, (most < _FIXED) & passive, (most > _FREE) & np.isfinite(wrenches).all(0))
    for connection, parts in zip(scene.connections, wrong, strict=True):
        residuals.note("unknown", connection.name, parts[None, None].astype(float), 1.0, published.pieces.time[:1])


def _changes(scene: LawScene, poses: BodyPoses) -> Array:
    """Change of each component, (connections, 6), by reactions that together move nothing, relative to the largest."""
    centres, reactions, columns = scene.centres(poses)[0][0, 0], list[Array](), list[Array]()
    for number, connection in enumerate(scene.connections):
        place = scene.placed(connection, poses).origin_b[0, 0]
        for force, moment in held(scene, poses, connection):
            reactions.append(np.zeros((len(scene.connections), 6)))
            reactions[-1][number] = *force, *moment
            effect = np.zeros((len(scene.mass), 6))
            for body, sign in ((connection.b, 1.0), (connection.a, -1.0)):
                effect[body] += sign * np.array([*force, *(cross(place - centres[body], force) + moment)])
            columns.append(effect[:-1].ravel())
    if not columns:
        return np.zeros((len(scene.connections), 6))
    _, sizes, vectors = np.linalg.svd(np.array(columns).T)
    null = vectors[int((sizes > _RANK * sizes.max(initial=0.0)).sum()) :]
    changes = np.linalg.norm(null @ np.array(reactions).reshape(len(reactions), -1), axis=0).reshape(-1, 6)
    return np.asarray(changes / max(float(changes.max(initial=0.0)), np.finfo(float).tiny))
