"""Parts of a mechanism's model that the ladder of models can leave out."""

from collections.abc import Mapping, Sequence

from proofroll.core.element import OptionalTerm
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Pair

# Laws of joints and of contacts that the ladder of models can leave out, by their key.
_OF_JOINTS = {"armature": "armature of joints", "friction": "dry friction of joints", "damping": "damping of joints"}
RESISTANCE = "rolling resistance of contacts"
_OF_PAIRS = {
    "friction": "friction of contacts",
    "restitution": "restitution of contacts",
    "rolling_resistance": RESISTANCE,
    "spinning_friction": "friction of contacts against spin",
}
_FAR = 1000.0  # factor on limits of efforts with which they bound nothing
_ROLLS = 10.0  # factor on friction with which little slip is left; with much more some solvers do not end


def optional_terms(mechanism: Mechanism, parameters: Mapping[str, float]) -> list[OptionalTerm]:
    """Terms that a parameter of the scene switches off: laws of joints and contacts, limits of efforts, slip.

    The name of the parameter is, or ends with, the key of the law.
    """
    because = "the scene has it"
    pairs = [pair for pair in mechanism.pairs if pair.cone == "separate"]  # of a shared cone no part is left alone
    terms = [
        OptionalTerm(name, because, {}, {key: 0.0})
        for key, name in _OF_JOINTS.items()
        if key in _owned(parameters, key, mechanism.joints, mechanism.pairs)
    ]
    if "limit" in parameters and any(item.limit is not None for item in mechanism.actuators):
        meaning = f"the scene has them; here they are switched off, and {_FAR:g} times what they are"
        terms.append(OptionalTerm("limits of efforts", meaning, {}, {"limit": _FAR * parameters["limit"]}))
    rubbing: dict[str, float] = {}
    for key, name in _OF_PAIRS.items():
        if owners := _owned(parameters, key, pairs, mechanism.joints):
            terms.append(OptionalTerm(name, because, {}, dict.fromkeys(owners, 0.0)))
            rubbing = rubbing or {parameter: _ROLLS * value for parameter, value in owners.items() if key == "friction"}
    if rubbing:
        meaning = f"friction is bounded; here by {_ROLLS:g} times as much, so that contacts stick or roll"
        terms.append(OptionalTerm("slip of contacts", meaning, {}, rubbing))
    return terms


def _owned(
    parameters: Mapping[str, float], key: str, parts: Sequence[Joint | Pair], others: Sequence[Joint | Pair]
) -> dict[str, float]:
    """Nonzero parameters that set ``key`` of some ``parts``, by their name.

    A parameter's name must end with the key. If ``others`` have that key too, the value decides: it must be one of the
    parts and not of the others.
    """
    values, theirs = ({getattr(part, key, 0.0) for part in group} - {0.0} for group in (parts, others))
    return {
        name: value
        for name, value in parameters.items()
        if values and value and _ends_with(name, key) and (not theirs or value in values - theirs)
    }


def _ends_with(name: str, key: str) -> bool:
    """True if a parameter's name ends with a key, and with no longer one of another law."""
    longer = (law for law in _OF_PAIRS if law != key and law.endswith(key))
    return name.endswith(key) and not any(name.endswith(law) for law in longer)
