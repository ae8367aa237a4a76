"""Engine PyBullet: a ball with its own contact solver, and mechanisms as multibodies from its importer of URDF."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from typing import Any, ClassVar

from proofroll.adapter import Family, MechanismCapability, Scene, of_contact
from proofroll_pybullet import ball, mechanism, spheres
from proofroll_pybullet.ball import PybulletBall
from proofroll_pybullet.mechanism import PybulletMechanism
from proofroll_pybullet.settings import PRESETS, PybulletSettings
from proofroll_pybullet.spheres import PybulletSpheres


class Pybullet:
    """PyBullet through its Python module; semi-implicit Euler. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "pybullet"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "plane": ball.PROVIDES,
        "urdf": mechanism.PROVIDES,
        "spheres": spheres.PROVIDES,
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "plane": {},
        "urdf": mechanism.LACKING,
        "spheres": spheres.LACKING,
    }
    made_for: ClassVar[Mapping[str, frozenset[str]]] = {"spheres": frozenset({MechanismCapability.CONTACT})}
    inherent: ClassVar[Mapping[str, Mapping[str, str]]] = {"plane": ball.INHERENT}
    settings: ClassVar[type[PybulletSettings]] = PybulletSettings
    presets: ClassVar[Mapping[str, Mapping[str, PybulletSettings]]] = PRESETS

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return importlib.metadata.version("pybullet")

    @staticmethod
    def family(_: PybulletSettings) -> Mapping[str, str]:
        """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
        return of_contact(Family.ANISOTROPIC)

    @staticmethod
    def build(scene: Scene, settings: PybulletSettings) -> Any:
        """See :class:`proofroll.core.engine.Engine`; builds a run of the formulation."""
        models = {"plane": PybulletBall, "urdf": PybulletMechanism, "spheres": PybulletSpheres}
        return models[settings.formulation].build(scene, settings)
