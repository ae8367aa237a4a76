"""Options of a person's own MJCF: integrator, step and cone, and what else differs from MuJoCo's defaults."""

from pathlib import Path

import mujoco
import numpy as np

from proofroll.core.engine_abilities import OwnOptions
from proofroll.core.errors import InputError
from proofroll.core.number_format import counted, number
from proofroll.engines.mujoco.settings import LARGEST_IMPEDANCE, OF_ROWS, SHORTEST_TIME_CONSTANT
from proofroll.robots.files.robot_file import read_xml

# Integrators that the adapter has, by their number in MuJoCo.
_INTEGRATORS = {
    int(getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}")): name for name in ("Euler", "RK4", "implicitfast")
}
_CONES = {int(mujoco.mjtCone.mjCONE_PYRAMIDAL): "pyramidal", int(mujoco.mjtCone.mjCONE_ELLIPTIC): "elliptic"}
# Options that are settings, that the scene has, and that act on contacts, islands and speed alone.
_READ = {"integrator", "timestep", "cone", "gravity", "density", "viscosity", "disableflags", "disableactuator"}
_READ |= {"impratio", "sleep_tolerance", "wind", "magnetic", "enableflags", "jacobian"}
_READ |= {f"{family}_{what}" for family in ("o", "ccd", "sdf") for what in ("friction", "margin", "solref", "solimp")}
_READ |= {"ccd_iterations", "ccd_tolerance", "sdf_iterations", "sdf_initpoints"}
_FINER = 4  # part of the file's step that is tried
_SOLVERS = {name.upper(): name for name in ("PGS", "CG", "Newton")}
_HARD = {"time_constant": str(SHORTEST_TIME_CONSTANT), "impedance": str(LARGEST_IMPEDANCE)}
_RK4 = {"integrator": "RK4", "eulerdamp": "true", "damping_armature": "false"}  # the flags are of Euler alone
_FLAGS = {"REFSAFE": "refsafe"}  # of rows, which no scene has


def own_options(path: Path) -> OwnOptions | None:
    """Options of an MJCF file: integrator, step and cone; what the adapter sets otherwise is named.

    None: the file is a URDF.

    Raises:
        InputError: MuJoCo cannot read the file, or the adapter has none of its integrator.
    """
    if read_xml(path).tag == "robot":
        return None
    try:
        spec, plain = mujoco.MjSpec.from_file(str(path)), mujoco.MjSpec()
    except ValueError as error:
        raise InputError("--like", path, f"MuJoCo cannot read it: {error}") from None
    option = spec.option
    integrator = _INTEGRATORS.get(int(option.integrator))
    if integrator is None:
        names = ", ".join(_INTEGRATORS.values())
        raise InputError("--like", path, f"its integrator is none that can be compared; choose {names}")
    keys = [key for key in dir(option) if not key.startswith("_") and key not in _READ]
    unlike = [key for key in keys if np.any(getattr(option, key) != getattr(plain.option, key))]
    solver = mujoco.mjtSolver(int(option.solver)).name.removeprefix("mjSOL_")
    words = {"solver": f"solver {solver}", "iterations": counted(int(option.iterations), "iterations")}
    clauses = {key: words.get(key, f"{key} {getattr(option, key):g}") for key in unlike}
    of_rows = [clauses.pop(key) for key in OF_ROWS if key in clauses]
    others = list(clauses.values())
    bits = mujoco.mjtDisableBit
    others += [f"flag {word}" for name, word in _FLAGS.items() if option.disableflags & getattr(bits, f"mjDSBL_{name}")]
    body, of_contacts = plain.worldbody.add_body(), list[str]()
    usual = {"joints": body.add_joint(), "equalities": plain.add_equality(), "geoms": body.add_geom()}
    for kind, element in usual.items():
        named = of_contacts if kind == "geoms" else others
        for key in [key for key in dir(element) if key.startswith(("solref", "solimp"))]:
            count = sum(bool(np.any(getattr(item, key) != getattr(element, key))) for item in getattr(spec, kind))
            named += [f"{key.replace('_', '')} of {counted(count, kind)}"] if count else []
    switches = {"hard constraints in place of soft ones": _HARD}
    if _CONES[int(option.cone)] == "pyramidal":
        switches["elliptic cone in place of the pyramidal"] = {"cone": "elliptic"}
    if of_rows:
        usual_solver = {"solver": "Newton", "iterations": str(plain.option.iterations), "noslip_iterations": "0"}
        switches[f"MuJoCo's default solver in place of {', '.join(of_rows)}"] = usual_solver
    euler = integrator == "Euler"  # the only one that the flag is for
    explicit = euler and bool(option.disableflags & bits.mjDSBL_EULERDAMP)
    if euler and not explicit and any(np.any(joint.damping) for joint in spec.joints):
        switches["damping as armature in place of implicit"] = {"damping_armature": "true"}
    if integrator != "RK4":
        switches[f"RK4 in place of {integrator}"] = _RK4
    finer = option.timestep / _FINER
    switches[f"dt {number(finer, 3)} s in place of {number(option.timestep, 3)} s"] = {"dt": f"{finer:.12g}"}
    return OwnOptions(
        engine="mujoco",
        words=f"{integrator}, dt {number(option.timestep, 3)} s",
        settings={
            "integrator": integrator,
            "dt": f"{option.timestep:.12g}",
            **({"eulerdamp": "False"} if explicit else {}),
            "solver": _SOLVERS[solver.upper()],
            "iterations": str(option.iterations),
            "noslip_iterations": str(option.noslip_iterations),
        },
        of_contacts={"cone": _CONES[int(option.cone)], "impratio": str(float(option.impratio))},
        others=others,
        others_of_contacts=of_contacts,
        switches=switches,
    )
