"""Exudyn (https://github.com/jgerstmayr/EXUDYN), an engine for flexible and rigid multibody systems.

Mechanisms are bodies in redundant coordinates (:mod:`redundant`), with contacts of spheres (:mod:`spheres`) or discs
that roll (:mod:`discs`), or its kinematic tree (:mod:`tree`).
"""

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any, ClassVar

from proofroll.core.engine_abilities import Level, Term
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.exudyn.contact import discs, spheres
from proofroll.engines.exudyn.contact.discs import Discs
from proofroll.engines.exudyn.contact.spheres import Spheres
from proofroll.engines.exudyn.integration import own_lines
from proofroll.engines.exudyn.native import exu
from proofroll.engines.exudyn.settings import PRESETS, ExudynSettings
from proofroll.engines.exudyn.smooth import redundant, tree
from proofroll.engines.exudyn.smooth.redundant import Redundant
from proofroll.engines.exudyn.smooth.tree import KinematicTree

_RUNS: Mapping[str, type[Redundant | KinematicTree]] = {
    "redundant": Redundant,
    "spheres": Spheres,
    "discs": Discs,
    "tree": KinematicTree,
}
NEW_JACOBIAN = "new Jacobian at every step"  # a term
_SWITCHES = (MechanismCapability.JOINT_FRICTION, MechanismCapability.STOPS, MechanismCapability.SATURATION)


class Exudyn:
    """Exudyn's implicit integration of multibody systems with constraints, or with its penalty contact."""

    name: ClassVar[str] = "exudyn"
    title: ClassVar[str] = "Exudyn"
    witness: ClassVar[bool] = False
    oldest: ClassVar[str] = "1.11"  # the oldest that was tried
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "redundant": redundant.PROVIDES,
        "spheres": spheres.PROVIDES,
        "discs": discs.PROVIDES,
        "tree": tree.PROVIDES,
    }
    made_for: ClassVar[Mapping[str, frozenset[str]]] = {
        "spheres": frozenset({MechanismCapability.CONTACT}),
        "discs": frozenset({MechanismCapability.UNBOUNDED_FRICTION}),
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "redundant": redundant.LACKING,
        "spheres": spheres.LACKING,
        "discs": discs.LACKING,
        "tree": tree.LACKING,
    }
    settings: ClassVar[type[ExudynSettings]] = ExudynSettings
    presets: ClassVar[Mapping[str, Mapping[str, ExudynSettings]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {
        "redundant": Level.CONSTRAINT,
        "spheres": Level.CONTACT,
        "discs": Level.CONSTRAINT,
        "tree": Level.CONSTRAINT,
    }
    terms: ClassVar[Sequence[Term]] = (
        Term(
            name=NEW_JACOBIAN,
            formulations=("redundant", "spheres", "discs"),
            on={"jacobian": "step"},
            off={"jacobian": "reused"},
            because="lets Newton's method end after two or three iterations where an old Jacobian needs seven",
        ),
        Term(
            name="halving of steps",
            formulations=("spheres",),
            on={"halvings": 10},
            off={"halvings": 0},
            because="goes on where Newton's method fails at the edge of the friction zone",
        ),
    )

    @staticmethod
    def caveat(settings: ExudynSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.TellsCaveats`; a step that halves itself has no order."""
        caveats = []
        if settings.preset == "default" and not settings.halvings:
            caveats = ["the adaptive step, Exudyn's default, is off"]
        if settings.formulation == "spheres":
            caveats.append("radii and softness of the spheres follow proofroll's own contact forces at the start")
        return "; ".join(caveats)

    lines = staticmethod(own_lines)
    family = staticmethod(spheres.family)

    @staticmethod
    def lowered(_: ExudynSettings) -> Mapping[str, int]:
        """See :class:`proofroll.core.engine_abilities.LowersOrder`; a joint may begin to slip anywhere in a step."""
        return dict.fromkeys(_SWITCHES, 1)

    @staticmethod
    def version() -> str:
        """Version of the installed package; on some platforms the extension module reports a different one."""
        return version("exudyn")

    @staticmethod
    def defaults() -> Mapping[str, Any]:
        """See :class:`proofroll.core.engine_abilities.TellsDefaults`: the settings of a simulation."""
        import exudyn

        defaults: dict[str, Any] = {}

        def flatten(path: str, values: Mapping[str, Any]) -> None:
            for name, value in values.items():
                if isinstance(value, Mapping):
                    flatten(f"{path}{name}.", value)
                else:
                    defaults[path + name] = value.tolist() if hasattr(value, "tolist") else str(value)

        flatten("", exudyn.SimulationSettings().GetDictionary())
        return defaults

    @classmethod
    def build(cls, scene: Scene, settings: ExudynSettings) -> Redundant | KinematicTree:
        """See :class:`proofroll.core.engine.Engine`; builds a run of the formulation."""
        require_frames(settings.formulation)
        return _RUNS[settings.formulation](scene, settings)

    @classmethod
    def reproducer(cls, scene: Scene, settings: ExudynSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.Reproduces`."""
        from proofroll.engines.exudyn.reproducer import mechanism_source

        if settings.formulation not in {"redundant", "tree"}:
            raise Refused("the steps of bodies in contact are proofroll's")
        return mechanism_source(cls.build(scene, settings), mechanism_of(scene), settings)


def require_frames(formulation: str) -> None:
    """Checks that joints can be given by whole frames (exudyn.HT). Raises Refused: this Exudyn is too old for it."""
    if not hasattr(exu, "HT"):
        raise Refused(f"{formulation} needs the frames of markers of exudyn 1.13, and this is {Exudyn.version()}")
