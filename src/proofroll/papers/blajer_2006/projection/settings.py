"""Settings of the projection method for a ball that rolls in a cylinder, and its presets."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from typing_extensions import override

from proofroll.core.engine import presets_of
from proofroll.core.heyoka_library import TIGHTEST
from proofroll.engines.projection.settings import ProjectionSettings


@dataclass(frozen=True)
class ProjectionBallSettings(ProjectionSettings):
    """Settings of the projection method for a ball.

    In ``rotating_frame`` no step leaves a violation of the rolling constraints, for there they are linear with constant
    coefficients, but round-off does, and it grows.

    Attributes:
        formulation: ``euler``, the paper's angles, with a singularity, or ``rotating_frame``, the angular velocity
            along the local axes, without. The angles are always part of the equations; in the rotating frame the
            orientation is followed, as a quaternion, only for a scene that asks for it.
        singularity: action of ``euler`` near θ = 0 and π: ``renew``, choose the body's axes anew and say so, or
            ``stop``, as the paper's equations do by themselves.
    """

    formulation: Literal["euler", "rotating_frame"] = "euler"
    singularity: Literal["renew", "stop"] = "renew"

    @override
    def _rules(self) -> Iterator[tuple[bool, str, str]]:
        yield from super()._rules()
        advice = "only mechanisms have compiled equations; leave it out, or take integrator=taylor"
        yield self.equations == "compiled", "equations", advice
        advice = f"{self.formulation} has no angles, hence no singularity; leave it out, or take formulation=euler"
        yield self.singularity == "stop" and self.formulation != "euler", "singularity", advice

    @property
    @override
    def unused(self) -> tuple[str, ...]:
        without = () if self.formulation == "euler" else ("singularity",)
        return (*super().unused, *without, "equations")


_SETTINGS: Mapping[str, Mapping[str, object]] = {
    "default": {"integrator": "rk4"},
    "matched": {},
    "tuned": {"integrator": "taylor", "rtol": TIGHTEST},
}
PRESETS: Mapping[str, Mapping[str, ProjectionBallSettings]] = presets_of(
    ProjectionBallSettings, dict.fromkeys(("euler", "rotating_frame"), _SETTINGS)
)
