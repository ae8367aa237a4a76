"""Hook of the check of the answer: the dataset that a truth is about to return, read back and held against the laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import ENDS
from proofroll.core.events import IMPACTS, JUMPS, EventKind, events_of
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.switches import with_stops_at_start
from proofroll.elements.mechanism.run.contacts.observables import follow_contacts
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.truth.check.laws.answer import AnswerCheck
from proofroll.truth.check.laws.integrals import of_quaternion
from proofroll.truth.check.laws.record import Array, Modes, PublishedEvent, PublishedValues, stated
from proofroll.truth.check.laws.tiles import Tiles

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.columns import Columns


def held_answer(
    element: MechanismElement, dataset: xr.Dataset, tiles: Tiles, asked: FloatArray, between: Columns | None = None
) -> AnswerCheck:
    """Check of a dataset along the motion that was followed.

    Args:
        element: whose truth it is.
        dataset: published values.
        tiles: poses and velocities of the motion.
        asked: times of samples that were asked for [s].
        between: the same variables in the middle of each stretch of the motion.
    """
    mechanism = with_stops_at_start(element.mechanism)
    check = AnswerCheck(mechanism, element.length, element.speed / element.length)
    end, horizon = (float(dataset.attrs.get(name, np.inf)) for name in (ENDS, "horizon"))
    published = _published(element, {str(name): np.asarray(item.values) for name, item in dataset.variables.items()})
    bars = {str(name): float(item.attrs.get("error_bar", 0.0)) for name, item in dataset.data_vars.items()}
    published = replace(published, bars=bars, changes=_changes(dataset))
    rows = None
    if between is not None:
        rows = _published(element, {name: item.values for name, item in between.variables.items()})
        rows = replace(rows, bars=bars, changes=published.changes)
    with np.errstate(all="ignore"):
        check.take(published, tiles, asked, end, horizon, rows)
    return check


def _published(element: MechanismElement, values: Mapping[str, Array]) -> PublishedValues:
    """Values and forces of variables, without bars and events."""
    m = element.mechanism
    count = len(values["time"])

    def along(field: str, names: list[str]) -> Array:
        columns = [values.get(f"{field}.{name}", np.zeros(count)) for name in names]
        return np.stack(columns, -1)[:, None] if columns else np.zeros((count, 1, 0))

    def vectors(field: str, names: list[str], missing: float = np.nan) -> Array:
        unknown = np.full(count, missing)
        rows = [np.stack([values.get(f"{field}.{name}.{axis}", unknown) for axis in "xyz"], -1) for name in names]
        return np.stack(rows, 1)[:, None] if rows else np.zeros((count, 1, 0, 3))

    def world(of_bodies: Array, value: Array) -> Array:
        beyond = np.broadcast_to(value, (count, 1, *value.shape))
        return np.concatenate([of_bodies, beyond], 1)[:, None]

    connections, names = [item.name for item in m.connections], [joint.name for joint in m.joints]
    contacts, zero = [contact.name for contact in m.contacts], np.zeros(3)
    stop = along("stop", names)
    place, normal = _where_contacts_act(element, values)
    moments = vectors("torque", contacts, missing=0.0)
    about = np.sum(moments * normal[:, None], -1, keepdims=True) * normal[:, None]
    pieces = stated(
        m,
        Modes(contacts=(), rolling=(), spinning=(), friction=(), stops=()),
        values["time"][:, None],
        pace=np.ones((count, 1)),
        p=world(values["p_WB"], zero),
        R=world(of_quaternion(values["q_WB"]), np.eye(3)),
        v=world(values["v_WB"], zero),
        w=world(values["w_WB"], zero),
        effort=along("effort", [item.name for item in m.actuators]),
        coupling=along("coupling", [item.name for item in m.couplings]),
        drive=along("drive", names),
        friction=along("friction", names),
        # a force along the coordinate is that of the lower stop, one against it of the upper
        stops=np.stack([np.maximum(stop, 0.0), np.minimum(stop, 0.0)], -1),
        force=vectors("force", contacts),
        place=place[:, None],
        normal=normal[:, None],
        rolling=moments - about,
        spinning=about,
    )
    reactions = np.concatenate([vectors(kind, connections) for kind in ("force", "torque")], -1)
    return PublishedValues(pieces=pieces, reactions=reactions, values=values, bars={}, changes=())


def _changes(dataset: xr.Dataset) -> list[PublishedEvent]:
    """Events of a dataset."""
    return [
        PublishedEvent(
            name=event.name,
            time=event.time,
            low=event.time_low,
            high=event.time_high,
            jumps=event.kind in JUMPS,
            strikes=event.kind in IMPACTS,
            settles=event.kind == EventKind.SETTLE,
            of_effort=event.kind in {EventKind.SATURATE, EventKind.RELEASE},
        )
        for event in events_of(dataset)
    ]


def _where_contacts_act(element: MechanismElement, values: Mapping[str, Array]) -> tuple[Array, Array]:
    """Places [m] and normals of contacts, (samples, contacts, 3), which the laws hold against the surfaces."""
    m, count = element.mechanism, len(values["time"])
    if not m.contacts:
        return np.zeros((count, 0, 3)), np.zeros((count, 0, 3))
    motion = (np.array(values[name], dtype=float) for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB"))
    followed = follow_contacts(Placed(m, *motion))
    return followed.place, followed.normal
