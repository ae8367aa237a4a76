"""Families of random scenes of mechanisms, and what of the vocabulary none of them draws."""

from __future__ import annotations

from collections.abc import Mapping

from proofroll.core.drawing import SceneFamily
from proofroll.elements.mechanism.drawn.contacts import CONTACT_FEATURES, contact
from proofroll.elements.mechanism.drawn.trees import BAR_FEATURES, LOOP_FEATURES, TREE_FEATURES, bar, loop, tree
from proofroll.elements.mechanism.run.capabilities import ALL_JOINTS, ALL_LOOPS
from proofroll.elements.mechanism.run.capabilities import MechanismCapability as Capability

_DRAWN = {
    "tree": (TREE_FEATURES, tree, ALL_JOINTS),
    "loop": (LOOP_FEATURES, loop, ALL_LOOPS),
    "bar": (BAR_FEATURES, bar, ALL_LOOPS & BAR_FEATURES.keys()),
    "contact": (CONTACT_FEATURES, contact, {Capability.CONTACT}),
}
FAMILIES: Mapping[str, SceneFamily] = {
    name: SceneFamily(features, draw, frozenset(Capability), frozenset(needs))
    for name, (features, draw, needs) in _DRAWN.items()
}
# Capability that no family has as a feature -> how it is drawn, or why not.
WITHOUT_FEATURE: Mapping[str, str] = {
    Capability.CONTACT: "every scene of contact has it",
    Capability.MASSLESS: "not drawn: every drawn body has mass and moments",
    Capability.REDUNDANT: "planar loops have it; an analysis of the scene finds it, not its keys",
    Capability.ORIENTATION: "asked for; no part of a scene",
    Capability.COUPLINGS_OF_MANY: "not drawn: its rows are those of a coupling of two",
}
# Keys of the vocabulary that are not drawn, as table.key -> reason.
NOT_DRAWN: Mapping[str, str] = {
    "bushings.position_b": "position_a places a bushing",
    "bushings.orientation_b": "orientation_a turns a bushing",
    "couplings.joints": "see couplings of three or more joints",
    "couplings.coefficients": "see couplings of three or more joints",
    "couplings.offset": "coupled joints start at zero",
    "forces.reaction": "an opposite force of equal size adds no term",
    "geometries.orientation": "bodies are turned, not their shapes in them",
    "geometries.slope": "cones are not drawn",
    "geometries.ring_radius": "tori are not drawn",
    "loops.at_most": "cables are not drawn",
    "loops.restitution": "cables are not drawn",
    "pairs.static_friction": "friction as a table says it",
    "points.name": "points are only reported",
    "points.body": "points are only reported",
    "points.position": "points are only reported",
}
