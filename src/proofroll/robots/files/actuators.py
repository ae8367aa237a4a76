"""Actuators of an MJCF as tables of a scene, with constant controls."""

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element

from proofroll.core.errors import InputError
from proofroll.core.number_format import counted
from proofroll.robots.files.mjcf.defaults import class_of, with_classes
from proofroll.robots.files.robot_file import floats
from proofroll.robots.model import Robot

_PLAIN = {"motor", "position", "velocity", "general"}
# Attributes with the only values for which a scene's actuator has the same law.
_OTHER = {"dyntype": "none", "gaintype": "fixed", "timeconst": "0", "dampratio": "0", "actlimited": "false"}


def scene_actuators(
    root: Element, robot: Robot, controls: Sequence[float] = ()
) -> tuple[list[dict[str, Any]], list[str]]:
    """Tables of the actuators that a scene can represent, and a clause for each other one.

    Args:
        root: of the MJCF.
        robot: the robot of the file.
        controls: of its actuators, in their order; empty: all are zero.

    Raises:
        InputError: there are more or fewer controls than actuators.
    """
    if any(flag.get("actuation") == "disable" for flag in root.iter("flag")):
        return [], []
    elements = [item for part in root.findall("actuator") for item in part]
    if controls and len(controls) != len(elements):
        advice = f"this keyframe has {counted(len(controls), 'controls')}, and the file {len(elements)} actuators"
        raise InputError("<key ctrl>", list(controls), advice)
    single = {joint.name for joint in robot.moving if joint.dofs == 1}
    actuators: list[dict[str, Any]] = []
    clauses = []
    for number, element in enumerate(elements):
        name = element.get("name") or f"actuator{number}"
        attributes = _given(root, element)
        control = controls[number] if controls else 0.0
        table = _table(element.tag, attributes, control) if attributes.get("joint") in single else None
        rival = next((row for row in actuators if row["joint"] == attributes.get("joint")), None)
        if table is None or (rival is not None and (merged := _merged(rival, table)) is None):
            clauses.append(f"the actuator {element.tag} {name}")
        elif rival is None:
            actuators.append({**table, "name": name, "joint": attributes["joint"]})
        else:
            rival.update(merged or {})
    for item, of_joint in with_classes(root, "joint"):
        ends = floats(of_joint.get("actuatorfrcrange", ""))
        for table in [table for table in actuators if ends and table["joint"] == item.get("name")]:
            table["limit"] = min(ends[1], table.get("limit", ends[1]))
            if ends[0] != -ends[1]:
                clauses.append(f"the actuator force range of joint {item.get('name')}")
    return actuators, clauses


def _given(root: Element, element: Element) -> dict[str, str]:
    """Attributes of an actuator, own and inherited: MJCF's kinds share one default, but name its gains differently."""
    attributes: dict[str, str] = {}
    named = {"class": element.get("class", "")} if element.get("class") else {}
    for tag in sorted(_PLAIN, key=lambda tag: tag == element.tag):  # its own kind last
        of_class = class_of(root, Element(tag, named))
        if tag != element.tag:
            kp, kv = of_class.pop("kp", None), of_class.pop("kv", None)
            if element.tag == "general" and (kp or kv):
                bias = f"0 {-float(kp or 0)} {-float(kv or 0)}"
                of_class |= {"gainprm": str(kp or kv), "biastype": "affine", "biasprm": bias}
            if element.tag == "position" and "gainprm" in of_class:
                of_class["kp"] = of_class["gainprm"].split()[0]
        attributes |= of_class
    return attributes | element.attrib


def _table(tag: str, attributes: Mapping[str, str], control: float) -> dict[str, Any] | None:
    """Kind, gains, gear, target and limit of an actuator with this control; None: a scene cannot represent it."""
    if tag not in _PLAIN or any(attributes.get(key, plain) != plain for key, plain in _OTHER.items()):
        return None
    kp, kd = _gains(tag, attributes)
    gear = (floats(attributes.get("gear", "")) or [1.0])[0]
    low, high = _range(attributes, "ctrl") or (0.0, 0.0)
    force = _range(attributes, "force")
    if not gear or kp < 0 or kd < 0 or (force and force[0] != -force[1]) or (force and force[1] <= 0):
        return None
    actuator: dict[str, Any] = {"kind": "position" if kp else "velocity" if kd else "torque", "gear": gear}
    actuator |= {name: value for name, value in (("kp", kp), ("kd", kd)) if value}
    target = min(max(control, low), high) if (low, high) != (0.0, 0.0) else control
    if target and tag == "general":
        gain = (floats(attributes.get("gainprm", "")) or [1.0])[0]
        target *= gain / (kp or kd or 1.0)
    return actuator | {"target": target} | ({"limit": force[1] * abs(gear)} if force else {})


def _gains(tag: str, attributes: Mapping[str, str]) -> tuple[float, float]:
    """Gains of position and velocity; negative ones for a law that a scene lacks."""
    if tag == "position":
        return float(attributes.get("kp", 1.0)), float(attributes.get("kv", 0.0))
    if tag == "velocity":
        return 0.0, float(attributes.get("kv", 1.0))
    bias = [*floats(attributes.get("biasprm", "")), 0.0, 0.0, 0.0]
    if tag == "motor" or attributes.get("biastype", "none") == "none":
        return 0.0, 0.0
    plain = attributes["biastype"] == "affine" and not bias[0]
    return (-bias[1], -bias[2]) if plain else (-1.0, -1.0)


def _merged(actuator: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any] | None:
    """Merges a position actuator and a damper (target velocity 0) of one joint; None: it is another pair."""
    by_kind = {item["kind"]: item for item in (actuator, second)}
    if (
        set(by_kind) != {"position", "velocity"}
        or actuator["gear"] != second["gear"]
        or {"limit"} & (actuator.keys() | second.keys())
    ):
        return None
    if by_kind["velocity"]["target"]:
        return None
    kd = by_kind["position"].get("kd", 0.0) + by_kind["velocity"]["kd"]
    return {**by_kind["position"], "kd": kd, "name": actuator["name"], "joint": actuator["joint"]}


def _range(attributes: Mapping[str, str], what: str) -> tuple[float, float] | None:
    """Range of a control (``ctrl``) or force; None: the file does not limit it."""
    ends = floats(attributes.get(f"{what}range", ""))
    if attributes.get(f"{what}limited") == "false" or len(ends) != 2:
        return None
    return ends[0], ends[1]
