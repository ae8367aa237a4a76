"""Mechanisms in the report of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from proofroll.core.observable import Observable, Role
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.dynamics.matrices import Matrices, matrices_of, velocity_names
from proofroll.elements.mechanism.run.capabilities import ALL_LOOPS, FORCES, MechanismCapability
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.report.kinds import EquationMatrices, ReportKind

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.report.pen import Picture
    from proofroll.report.replay.records import ReplayKind

_CONTACTS = {item for item in MechanismCapability if item.name.startswith("CONTACT")}
_LAWS = {
    MechanismCapability.JOINT_FRICTION, MechanismCapability.STOPS, MechanismCapability.REBOUNDS,
    MechanismCapability.SATURATION, MechanismCapability.COUPLINGS,
}  # fmt: skip
_DRIVES = {MechanismCapability.ACTUATORS, MechanismCapability.SIGNALS}
# Largest number of curves of forces, and of torques, of one case.
_MOST = 8
# Range of a curve, relative to the widest one, below which it is left out as constant.
_STILL = 1e-6


class MechanismReport(ReportKind):
    """See :class:`proofroll.report.kinds.ReportKind`."""

    replay_script: ClassVar[str] = "replay_mechanism.js"
    groups: ClassVar[Mapping[str, tuple[str, str]]] = {
        "ball rolling": ("Rolling balls", "a ball rolls without slip on a surface"),
        "ball slipping": ("Slipping balls", "a ball sticks and slips on a surface, and may fall: bounded friction"),
        "contact": ("Contact", "bodies that touch, slide and hit each other"),
        "joint laws": ("Joint laws", "joints with friction, stops, couplings or limits of a drive"),
        "loops": ("Closed loops", "joints that close rings, with redundant constraints"),
        "springs and drives": ("Springs and drives", "bodies on joints with springs, dampers or motors"),
        "trees": ("Trees", "bodies on joints, no loop"),
    }
    caption: ClassVar[str] = (
        "At the start, to scale. Filled dots are centres of mass, with a line to all that is fastened to the body; "
        "circles are joints, dashed circles the loops that close the tree, zigzags springs, coloured circles the "
        "tracked points."
    )

    @staticmethod
    def covers(scene: Scene) -> bool:
        """True if a mechanism is the scene's only element."""
        return len(scene.elements) == 1 and isinstance(scene.elements[0], MechanismElement)

    @staticmethod
    def group(scene: Scene) -> str:
        """Group of its hardest part: ball on a surface, contact, joint laws, loops, springs and drives; else trees."""
        element = the_mechanism(scene)
        needs, ball = element.requires, element.on_wall
        if ball is not None and not ball.flies:
            return "ball slipping" if np.isfinite(ball.contact.mu_static) else "ball rolling"
        if needs & _CONTACTS:
            return "contact"
        if needs & _LAWS:
            return "joint laws"
        if needs & ALL_LOOPS:
            return "loops"
        return "springs and drives" if needs & (FORCES | _DRIVES) else "trees"

    @staticmethod
    def drawings(scenes: Sequence[Scene]) -> tuple[list[Picture], str]:
        """Picture of the first case at its start."""
        from proofroll.elements.mechanism.report.drawing import mechanism_drawing

        return [mechanism_drawing(the_mechanism(scenes[0])).picture("at the start")], ""

    @staticmethod
    def curves(scene: Scene, truth: xr.Dataset) -> Sequence[Observable]:
        """Forces and torques of joints and loops that change most; tables judge their arrays as a whole."""
        return _reactions(the_mechanism(scene), truth)

    @staticmethod
    def matrices(scene: Scene, built: Any) -> EquationMatrices | None:
        """Matrices at the start, of the tree or of an engine's model."""
        mechanism = the_mechanism(scene).mechanism
        true = matrices_of(mechanism)
        built_matrices = true if built is None else Matrices(*(getattr(built, name) for name in Matrices._fields))
        off: dict[str, float] = {}
        for name, true_values, part in zip("Mhg", true, built_matrices, strict=True):
            if built is not None and part is not None:
                off[name] = float(
                    np.max(np.abs(part - true_values), initial=0.0) / (np.max(np.abs(true_values), initial=0.0) or 1.0)
                )
        M, h, g = (None if part is None else np.asarray(part).tolist() for part in built_matrices)
        return EquationMatrices(velocities=velocity_names(mechanism), M=M, h=h, g=g, differences=off)

    @staticmethod
    def replay() -> ReplayKind:
        """Replay of bodies and joints in motion."""
        from proofroll.elements.mechanism.report.replay import draw_mechanism, readings, seen
        from proofroll.report.replay.records import ReplayKind

        return ReplayKind(name="mechanism", seen=seen, draw=draw_mechanism, readings=readings)


def _reactions(element: MechanismElement, truth: xr.Dataset) -> list[Observable]:
    """Determinate components of the wrenches on children that change most, in the order of joints and loops."""
    names = [connection.name for connection in element.mechanism.connections]
    reactions = []
    for kind, unit in (("force", "N"), ("torque", "N m")):
        components = [truth[f"{kind}.{name}.{axis}"] for name in names for axis in "xyz"]
        # At time 0 a reaction belongs to the certificate.
        ranges = {
            str(item.name): float(np.ptp(item.to_numpy()[1:])) for item in components if not item.attrs.get("absent")
        }
        widest = max(ranges.values(), default=0.0)
        moving = [name for name, width in ranges.items() if width > _STILL * widest]
        largest = sorted(moving, key=lambda name: -ranges[name])[:_MOST]
        reactions += [
            Observable(name, unit, str(truth[name].attrs["long_name"]), Role.REACTION, floor=_STILL * widest)
            for name in moving
            if name in largest
        ]
    return reactions
