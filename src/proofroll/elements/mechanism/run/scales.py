"""Sizes of the observables of a mechanism in its true motion, the same wherever frames of bodies sit and axes point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray, Vectors, largest_distance, largest_magnitude
from proofroll.core.observable import Role
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.observables import LAWS, RESIDUALS

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.mechanism.run.element import MechanismElement


def scales(element: MechanismElement, truth: xr.Dataset, least: float) -> dict[str, float]:
    """Size of each observable: ways of places and angles, sizes of rates, largest reactions, and natural sizes.

    Ways and speeds are the largest of all origins and centres of mass. A mechanism without a length of its own has its
    natural sizes from these.

    Args:
        element: the mechanism.
        truth: its true motion.
        least: least size in parts of a natural one, of a mechanism without a length of its own.
    """
    variables, mechanism = truth.variables, element.mechanism
    placed = Placed(mechanism, *(variables[name].values for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB")))
    # where no motion is unique there is none
    bodies = mechanism.bodies if np.isfinite(placed.q_WB).all() else ()
    centres = [(placed.point(body.name, body.com), placed.velocity(body.name, body.com)) for body in bodies]
    ways = max([_way(placed.p_WB), *(_way(place) for place, _ in centres)])
    speed = max([_rate(placed.v_WB), *(_rate(rate) for _, rate in centres)])
    sizes = {"p_WB": ways, "v_WB": speed, "w_WB": _rate(placed.w_WB)}
    reach, alone = _way(variables["positions"].values), not element.own_length
    natural_sizes = mechanism.natural_sizes(reach, speed) if alone and reach and speed else element.sizes
    natural = {"attitudes": 1.0, "energy_error": natural_sizes["J"], "drift": natural_sizes["m"]}
    natural |= {name: natural_sizes[unit] for name, unit, _ in (*RESIDUALS, *LAWS)} | {"unpressed": 1.0}
    for item in element.observables:
        if item.role == Role.EVENT:
            continue
        name, variable = item.name, variables.get(item.name)
        values = np.zeros(1) if variable is None else variable.values
        vectors = item.vectors or (_triples(values) if variable is not None and variable.dims[-1] == "xyz" else None)
        finite = np.nan_to_num(values)
        size = 0.0 if item.role == Role.REACTION else largest_distance(finite, vectors)
        if item.role == Role.REACTION or item.unit.endswith("/s"):
            size = max(size, largest_magnitude(finite, vectors))
        sizes[name] = sizes.get(name) or natural.get(name) or size
        if alone:
            sizes[name] = max(sizes[name], least * natural_sizes.get(item.unit, 0.0))
    return sizes


def _triples(values: FloatArray) -> Vectors:
    count = values[:1].size
    return tuple((np.arange(count) // 3).tolist())


def _way(places: FloatArray) -> float:
    return largest_distance(places, _triples(places))


def _rate(rates: FloatArray) -> float:
    """Largest value or change of a rate: a steady one has its size, and one that swings has twice its amplitude."""
    finite = np.nan_to_num(rates)
    return max(largest_magnitude(finite, _triples(rates)), largest_distance(finite, _triples(rates)))
