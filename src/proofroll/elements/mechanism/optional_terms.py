"""Parts of the model of a mechanism that a scene can have or not, for the ladder of models."""

from __future__ import annotations

from collections.abc import Mapping

from proofroll.core.element import OptionalTerm
from proofroll.elements.mechanism.model import Mechanism

# Laws of joints and of contacts that the ladder of models can leave out, by their key.
_OF_JOINTS = {"armature": "armature of joints", "friction": "dry friction of joints", "damping": "damping of joints"}
_OF_PAIRS = {"friction": "friction of contacts", "restitution": "restitution of contacts"}
_FAR = 1000.0  # limits of efforts times this bound nothing
_ROLLS = 10.0  # friction times this leaves little slip; with much more some solvers do not end


def optional_terms(mechanism: Mechanism, parameters: Mapping[str, float]) -> list[OptionalTerm]:
    """Laws of joints and contacts and limits of efforts whose parameter has the name of their key."""
    because = "the scene has it"
    terms = [
        OptionalTerm(name, because, {}, {key: 0.0})
        for key, name in _OF_JOINTS.items()
        if parameters.get(key) and any(getattr(joint, key) for joint in mechanism.joints)
    ]
    if "limit" in parameters and any(item.limit is not None for item in mechanism.actuators):
        said = f"the scene has them; here without, as {_FAR:g} times what they are"
        terms.append(OptionalTerm("limits of efforts", said, {}, {"limit": _FAR * parameters["limit"]}))
    rubbing: dict[str, float] = {}
    for key, name in _OF_PAIRS.items():
        own = {parameter: value for parameter, value in parameters.items() if parameter.endswith(key) and value}
        if own and any(getattr(pair, key) for pair in mechanism.pairs):
            terms.append(OptionalTerm(name, because, {}, dict.fromkeys(own, 0.0)))
            rubbing = rubbing or {parameter: _ROLLS * value for parameter, value in own.items() if key == "friction"}
    if rubbing:
        said = f"friction is bounded; here by {_ROLLS:g} times as much, with which what touches sticks or rolls"
        terms.append(OptionalTerm("slip of contacts", said, {}, rubbing))
    return terms
