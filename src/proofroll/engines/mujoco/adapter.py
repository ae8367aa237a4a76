"""The adapter: builds, steps and reads MuJoCo for mechanisms."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import mujoco
import numpy as np

from proofroll.core.engine_abilities import Level, Steps, Term
from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.mujoco.contact import mechanism_geoms
from proofroll.engines.mujoco.contact.mechanism_geoms import MujocoGeoms
from proofroll.engines.mujoco.own_lines import own_lines
from proofroll.engines.mujoco.running import written
from proofroll.engines.mujoco.settings import PRESETS, MujocoSettings
from proofroll.engines.mujoco.smooth import mechanism
from proofroll.engines.mujoco.smooth.mechanism import MujocoMechanism

_MECHANISMS: Mapping[str, type[MujocoMechanism]] = {"joints": MujocoMechanism, "geoms": MujocoGeoms}


class Mujoco:
    """MuJoCo behind proofroll's protocol."""

    name: ClassVar[str] = "mujoco"
    title: ClassVar[str] = "MuJoCo"
    witness: ClassVar[bool] = False
    oldest: ClassVar[str] = "3.5"  # the first version with mj_copyData, which every sample needs
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"joints": mechanism.PROVIDES, "geoms": mechanism_geoms.PROVIDES}
    made_for: ClassVar[Mapping[str, frozenset[str]]] = {"geoms": frozenset({MechanismCapability.CONTACT})}
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {"joints": mechanism.LACKING, "geoms": mechanism_geoms.LACKING}
    settings: ClassVar[type[Any]] = MujocoSettings
    lines = staticmethod(own_lines)
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {"joints": Level.CONSTRAINT, "geoms": Level.CONTACT}
    references: ClassVar[Mapping[str, Steps]] = {"geoms": Steps(exact_cone=False, hard_contact=True)}
    terms: ClassVar[Sequence[Term]] = ()

    @staticmethod
    def lowered(settings: MujocoSettings) -> Mapping[str, int]:
        """See :class:`proofroll.core.engine_abilities.LowersOrder`."""
        return settings.lowered

    @staticmethod
    def caveat(settings: MujocoSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.TellsCaveats`."""
        if settings.formulation != "geoms" or not settings.cone_correction:
            return ""
        return "the normal row of each contact is corrected between mj_step1 and mj_step2"

    @staticmethod
    def brought(settings: MujocoSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.BringsAPart`."""
        return "correction of each step" if settings.formulation == "geoms" and settings.cone_correction else ""

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
    def build(cls, scene: Scene, settings: MujocoSettings) -> MujocoMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return _MECHANISMS[settings.formulation](scene, settings)

    @classmethod
    def model_file(cls, scene: Scene, settings: MujocoSettings) -> str:
        """MJCF, whose keyframe ``start`` is time 0; see :class:`proofroll.core.engine_abilities.WritesModels`."""
        return written(cls.build(scene, settings).spec())

    @classmethod
    def reproducer(cls, scene: Scene, settings: MujocoSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.Reproduces`: steps of the model file."""
        from proofroll.engines.mujoco.own_lines import mechanism_source

        if settings.formulation not in _MECHANISMS:
            raise Refused(f"the steps of {settings.formulation} are not MuJoCo's alone")
        return mechanism_source(cls.model_file(scene, settings), mechanism_of(scene))


def mjspec(scene: Scene, *, portable: bool = False, sensors: bool = True, **settings: Any) -> mujoco.MjSpec:
    """MjSpec of a scene as ``proofroll export`` writes it; its keyframe ``start`` is time 0.

    Bodies and joints of a mechanism have the scene's names; of several MuJoCo joints that make up one, .0, .1 … follow.
    Reactions come from sensors ``FORCE0``, ``TORQUE0`` … of the joints in their order. A constant drive is an actuator
    ``drive.JOINT`` that needs no control.

    Args:
        scene: one that the formulation represents.
        portable: False keeps a state that is not finite as it is; True leaves MuJoCo's automatic reset on, for readers
            that refuse the flag (mujoco_warp), and takes targets held between instants, whose ``ctrl`` the reader sets.
        sensors: False leaves out the sensors of reactions.
        **settings: settings of the adapter (``formulation``, ``dt``, ``preset`` …), by default those of ``run``.

    Raises:
        InputError: a setting that does not exist.
        Refused: MuJoCo cannot represent the scene, or only with values that the adapter sets anew in every step.
    """
    engine = load_engine(Mujoco.name)
    spec = engine.build(scene, resolve_settings(engine, settings, scene.requires)).spec(portable)
    for sensor in () if sensors else tuple(spec.sensors):
        spec.delete(sensor)
    if portable:
        spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return spec
