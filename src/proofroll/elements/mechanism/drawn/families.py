"""Families of random scenes of mechanisms."""

from __future__ import annotations

from collections.abc import Mapping

from proofroll.core.drawing import SceneFamily
from proofroll.elements.mechanism.drawn.closing import close
from proofroll.elements.mechanism.drawn.contacts import CONTACT_FEATURES, contact
from proofroll.elements.mechanism.drawn.nearest import nearest
from proofroll.elements.mechanism.drawn.relations import RELATIONS
from proofroll.elements.mechanism.drawn.smaller import smaller
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
