"""The adapter: builds, steps and reads MuJoCo for mechanisms and for any ball on any surface."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import mujoco
import numpy as np

from proofroll.core.engine_abilities import Level, Term, require_provided
from proofroll.core.errors import Refused
from proofroll.core.plugins import resolve_settings
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.mujoco.contact import mechanism_geoms
from proofroll.engines.mujoco.contact.mechanism_geoms import MujocoGeoms
from proofroll.engines.mujoco.running import written
from proofroll.engines.mujoco.settings import PRESETS, TERMS, MujocoSettings, lowered
from proofroll.engines.mujoco.smooth import mechanism
from proofroll.engines.mujoco.smooth.mechanism import MujocoMechanism
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body
from proofroll.papers.blajer_2006.ball.model import NO_OTHER_BODIES
from proofroll.papers.blajer_2006.mujoco import run as ball

_MECHANISMS: Mapping[str, type[MujocoMechanism]] = {"joints": MujocoMechanism, "geoms": MujocoGeoms}


class Mujoco:
    """MuJoCo behind proofroll's protocol."""

    name: ClassVar[str] = "mujoco"
    title: ClassVar[str] = "MuJoCo"
    witness: ClassVar[bool] = False
    oldest: ClassVar[str] = "3.5"  # the first version with mj_copyData, which every sample needs
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        **ball.PROVIDES,
        "joints": mechanism.PROVIDES,
        "geoms": mechanism_geoms.PROVIDES,
    }
    made_for: ClassVar[Mapping[str, frozenset[str]]] = {"geoms": frozenset({MechanismCapability.CONTACT})}
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "chart": NO_OTHER_BODIES,
        "joints": mechanism.LACKING,
        "geoms": mechanism_geoms.LACKING,
    }
    settings: ClassVar[type[Any]] = MujocoSettings
    lowered = staticmethod(lowered)
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {
        "chart": Level.CONTACT,
        "joints": Level.CONSTRAINT,
        "geoms": Level.CONTACT,
    }
    terms: ClassVar[Sequence[Term]] = TERMS
    inherent: ClassVar[Mapping[str, Mapping[str, str]]] = ball.INHERENT

    @staticmethod
    def caveat(settings: MujocoSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.TellsCaveats`."""
        if settings.formulation != "geoms" or not settings.cone_correction:
            return ""
        return "the normal row of each contact is corrected between mj_step1 and mj_step2"

    family = staticmethod(mechanism_geoms.family)

    @staticmethod
    def version() -> str:
        """Version of MuJoCo."""
        return str(mujoco.__version__)

    @staticmethod
    def defaults() -> Mapping[str, Any]:
        """See :class:`proofroll.core.engine_abilities.TellsDefaults`: values of options and of a geom's attributes."""
        model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
        options = {name: getattr(model.opt, name) for name in dir(model.opt) if not name.startswith("_")}
        defaults = {
            f"option {key}": np.asarray(value).tolist() for key, value in options.items() if not callable(value)
        }
        geom = ("solref", "solimp", "friction", "condim", "margin", "gap", "priority")
        return defaults | {f"geom {name}": np.asarray(getattr(model, f"geom_{name}")[0]).tolist() for name in geom}

    @classmethod
    def build(cls, scene: Scene, settings: MujocoSettings) -> RunOnBody | MujocoMechanism:
        """See :class:`proofroll.core.engine.Engine`; ``joints`` and ``geoms`` build a run of a mechanism."""
        if settings.formulation in _MECHANISMS:
            return _MECHANISMS[settings.formulation](scene, settings)
        require_provided(cls, settings.formulation, scene)
        return on_body(ball.MujocoBall.of(scene, settings), scene)

    @classmethod
    def model_file(cls, scene: Scene, settings: MujocoSettings) -> str:
        """MJCF, whose keyframe ``start`` is time 0; see :class:`proofroll.core.engine_abilities.WritesModels`."""
        return written(cls._startable(scene, settings))

    @classmethod
    def _startable(cls, scene: Scene, settings: MujocoSettings) -> Any:
        """MjSpec of a scene, whose keyframe ``start`` is time 0."""
        if settings.formulation in _MECHANISMS:
            return _MECHANISMS[settings.formulation](scene, settings).spec()
        require_provided(cls, settings.formulation, scene)
        return ball.MujocoBall.startable(scene, settings)

    @classmethod
    def reproducer(cls, scene: Scene, settings: MujocoSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.Reproduces`: steps of the model file."""
        from proofroll.engines.mujoco.reproducer import mechanism_source

        if settings.formulation not in _MECHANISMS:
            raise Refused("the steps of a ball on a wall are proofroll's")
        return mechanism_source(cls.model_file(scene, settings), mechanism_of(scene))


def mjspec(scene: Scene, *, portable: bool = False, **settings: Any) -> mujoco.MjSpec:
    """MjSpec of a scene as ``proofroll export`` writes it; its keyframe ``start`` is time 0.

    Bodies and joints of a mechanism have the scene's names; of several MuJoCo joints that make up one, .0, .1 … follow.
    Reactions come from sensors ``FORCE0``, ``TORQUE0`` … of the joints in their order. A constant drive is an actuator
    ``drive.JOINT`` that needs no control.

    Args:
        scene: a ball on a surface, or a mechanism.
        portable: False keeps a state that is not finite as it is; True leaves MuJoCo's automatic reset on, for readers
            that refuse the flag (mujoco_warp).
        **settings: settings of the adapter (``formulation``, ``dt``, ``preset`` …), by default those of ``run``.

    Raises:
        InputError: a setting that does not exist.
        Refused: MuJoCo cannot represent the scene, or only with values that the adapter sets anew in every step.
    """
    spec = Mujoco._startable(scene, resolve_settings(Mujoco, settings, scene.requires))
    if portable:
        spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return spec
