"""Options of a person's own MuJoCo model, as settings of the engine's adapter."""

from __future__ import annotations

from pathlib import Path

import mujoco

from proofroll.core.errors import InputError
from proofroll.core.number_format import number
from proofroll.files.scene_sources import OwnOptions

# Integrators that the adapter has, by their number in MuJoCo.
_INTEGRATORS = {
    int(getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}")): name for name in ("Euler", "RK4", "implicitfast")
}
_CONES = {int(mujoco.mjtCone.mjCONE_PYRAMIDAL): "pyramidal", int(mujoco.mjtCone.mjCONE_ELLIPTIC): "elliptic"}
# Solver and iterations of the adapter, which are MuJoCo's defaults.
_SOLVER, _ITERATIONS = "Newton", 100


def own_options(path: Path) -> OwnOptions:
    """Options of an MJCF file: integrator, step and cone; what the adapter sets otherwise is named.

    Raises:
        InputError: MuJoCo cannot read the file, or the adapter has none of its integrator.
    """
    try:
        option = mujoco.MjSpec.from_file(str(path)).option
    except ValueError as error:
        raise InputError("--like", path, f"MuJoCo cannot read it: {error}") from None
    integrator = _INTEGRATORS.get(int(option.integrator))
    if integrator is None:
        known = ", ".join(_INTEGRATORS.values())
        raise InputError("--like", path, f"its integrator is none that can be compared; choose {known}")
    solver = mujoco.mjtSolver(int(option.solver)).name.removeprefix("mjSOL_").replace("NEWTON", _SOLVER)
    others = [f"solver {solver}"] if solver != _SOLVER else []
    others += [f"{option.iterations} iterations"] if int(option.iterations) != _ITERATIONS else []
    return OwnOptions(
        engine="mujoco",
        words=f"{integrator}, dt {number(option.timestep, 3)} s",
        settings={"integrator": integrator, "dt": f"{option.timestep:.12g}"},
        of_contacts={"cone": _CONES[int(option.cone)]},
        others=others,
    )
