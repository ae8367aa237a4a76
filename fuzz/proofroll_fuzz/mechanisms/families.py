"""Families of random scenes of mechanisms."""

from __future__ import annotations

from collections.abc import Mapping

from proofroll.adapter import MechanismCapability as Capability
from proofroll.elements.mechanism.run.capabilities import ALL_JOINTS, ALL_LOOPS
from proofroll_fuzz.drawing import SceneFamily
from proofroll_fuzz.mechanisms.closing import close
from proofroll_fuzz.mechanisms.contacts import CONTACT_FEATURES, contact
from proofroll_fuzz.mechanisms.nearest import nearest
from proofroll_fuzz.mechanisms.relations import RELATIONS
from proofroll_fuzz.mechanisms.smaller import smaller
from proofroll_fuzz.mechanisms.trees import BAR_FEATURES, LOOP_FEATURES, TREE_FEATURES, bar, loop, tree

_DRAWN = {
    "tree": (TREE_FEATURES, tree, ALL_JOINTS),
    "loop": (LOOP_FEATURES, loop, ALL_LOOPS),
    "bar": (BAR_FEATURES, bar, ALL_LOOPS & BAR_FEATURES.keys()),
    "contact": (CONTACT_FEATURES, contact, {Capability.CONTACT}),
}
FAMILIES: Mapping[str, SceneFamily] = {
    name: SceneFamily(
        features=features,
        draw=draw,
        capabilities=frozenset(Capability),
        needs=frozenset(needs),
        smaller=smaller,
        close=close,
        nearest=nearest,
        relations=RELATIONS,
    )
    for name, (features, draw, needs) in _DRAWN.items()
}
