"""The truth of a mechanism, as the harness asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element import Element
from proofroll.core.events import with_events
from proofroll.elements.mechanism.dataset import columns
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.elements.mechanism.named_forces import FIELDS

if TYPE_CHECKING:
    import xarray as xr

# Which error bar of the routes belongs to a variable; that of energy and of rates is by what they are made from.
_BARS = {
    "p_WB": "p_WB", "v_WB": "v_WB", "w_WB": "w_WB", "q_WB": "q_WB", "attitudes": "q_WB", "positions": "points",
    "forces": "wrench", "torques": "wrench", "energy": "energy", "energy_error": "energy",
    "energy_change": "energy", "drift": "drift", "gaps": "p_WB", "slips": "v_WB", "normal_forces": "pressed",
    "contact_forces": "pressed",
}  # fmt: skip
_PREFIXES = {"q.": "q", "v.": "v", "force.": "wrench", "torque.": "wrench"}
_PREFIXES |= dict.fromkeys((f"{field}." for field in FIELDS), "named")


class MechanismTruth:
    """See :class:`proofroll.core.truth.ElementTruth`."""

    @staticmethod
    def covers(element: Element) -> bool:
        """Every mechanism; what two routes do not cover is refused with the reason."""
        return isinstance(element, MechanismElement)

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:  # noqa: ARG004 -- nothing can be asked for
        """See :func:`proofroll.truth.mechanism.switched_truth.truth_of`."""
        # a third of a second, which no ball needs
        from proofroll.truth.mechanism.singular_poses import branching
        from proofroll.truth.mechanism.switched_truth import truth_of

        assert isinstance(element, MechanismElement)  # it covers it
        found = truth_of(element.mechanism, times)
        record = found.record
        wrench = np.stack([record.wrench[..., :3], record.wrench[..., 3:]], axis=1)
        pressed = np.zeros((len(times), 0, 3)) if found.pressed is None else found.pressed
        dataset = columns(element, record.placed(element.mechanism), wrench, pressed, record.named).dataset()
        points = [point.name for point in element.mechanism.points]
        of_contacts = {
            f"{kind}.{contact.name}{axis}": field
            for contact in element.mechanism.contacts
            for kind, axes, field in (
                ("force", (".x", ".y", ".z"), "pressed"),
                ("gap", ("",), "p_WB"),
                ("slip", ("",), "v_WB"),
            )
            for axis in axes
        }
        for name, variable in dataset.data_vars.items():
            field = (
                of_contacts.get(str(name))
                or _BARS.get(str(name))
                or next((v for k, v in _PREFIXES.items() if str(name).startswith(k)), None)
            )
            if field is None and str(name).rpartition(".")[0] in points:
                field = "points"
            size = float(np.nanmax(np.abs(variable.to_numpy()), initial=0.0))
            variable.attrs["error_bar"] = float(found.bars[field][-1]) if field else 4 * np.finfo(float).eps * size
        dataset.attrs["route"], *others = found.routes
        dataset.attrs["second_route"] = ", ".join(others)
        if found.checked_by is not None:
            dataset.attrs["second_route"] += f", {found.checked_by[0]}"
        said = [branching(found.branches)]
        if np.isfinite(found.horizon):
            dataset.attrs["horizon"] = found.horizon
            said.append(f"from {found.horizon:.4g} s on {found.reason}")
        if any(said):
            dataset.attrs["ill_posed"] = "; ".join(filter(None, said))
        return with_events(dataset, found.events) if found.events or element.mechanism.contacts else dataset
