"""Parts of the program as text: items of each formulation, solver, state of the ball."""

from __future__ import annotations

from proofroll.core.program_text import assigned
from proofroll.engines.exudyn.settings import ExudynSettings

BALL = """
node = mbs.AddNode(items.NodeRigidBodyEP(
    referenceCoordinates=[*POSITION, 1.0, 0.0, 0.0, 0.0],
    initialVelocities=[*VELOCITY, 0.0, *(np.array(START_SPIN) / 2)],
))
body = mbs.AddObject(items.ObjectRigidBody(mass=MASS, inertia=[INERTIA] * 3 + [0.0] * 3, nodeNumber=node))
centre = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body))
weight = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=body))
mbs.AddLoad(items.LoadMassProportional(markerNumber=weight, loadVector=GRAVITY))
"""


RESISTANCE = """

def resistance(mbs, t, load):
    \"\"\"Moment of rolling resistance: the normal force, which follows from the path, acts LEVER further on.

    It rises with the speed up to SLOW: Newton's method does not pass its jump at rest.
    \"\"\"
    p = mbs.GetNodeOutput(node, exu.OutputVariableType.Position)
    axes = frame(p)
    along = axes[1:] @ mbs.GetNodeOutput(node, exu.OutputVariableType.Velocity)
    N = MASS * (along @ np.array(CURVATURE) @ along + axes[0] @ np.array(GRAVITY))
    speed = max(np.hypot(*along), SLOW)
    return (LEVER * N / speed * (np.array([-along[1], along[0]]) @ axes[1:])).tolist() if speed else [0.0] * 3


mbs.AddLoad(items.LoadTorqueVector(
    markerNumber=centre, loadVector=[LEVER, 0.0, 0.0], loadVectorUserFunction=resistance
))
"""


CARRIER = """
ground = mbs.AddObject(items.ObjectGround())
carrier_node = mbs.AddNode(items.NodeRigidBodyEP(
    referenceCoordinates=[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
    initialVelocities=[*CARRIER_VELOCITY, 0.0, *(np.array(CARRIER_SPIN) / 2)],
))
carrier = mbs.AddObject(items.ObjectRigidBody(mass=0.0, inertia=[0.0] * 6, nodeNumber=carrier_node))
turned = np.eye(4)
turned[:3, :3] = JOINT_AXES
ends = [mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=end, localHT=turned)) for end in (ground, carrier)]
mbs.AddObject(items.GenericJoint(markerNumbers=ends, constrainedAxes=JOINT_CONSTRAINED))
pivot = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=carrier, localPosition=POSITION))
mbs.AddObject(items.GenericJoint(markerNumbers=[pivot, centre], constrainedAxes=[1, 1, 1, 0, 0, 0]))
# Rolling: the rate of the carrier's coordinate, and the spin of the ball relative to the carrier.
for kind, axis, about, factor in ROLLING:
    coordinate = getattr(items, f"MarkerBodiesRelative{kind}Coordinate")
    one = mbs.AddMarker(coordinate(bodyNumbers=[ground, carrier], axis0=axis))
    other = mbs.AddMarker(items.MarkerBodiesRelativeRotationCoordinate(
        bodyNumbers=[carrier, body], axis0=about, localPosition0=POSITION
    ))
    mbs.AddObject(items.CoordinateConstraint(markerNumbers=[one, other], factor1=factor, velocityLevel=True))
"""


ROLLING_DISC = """
ground = mbs.AddObject(items.ObjectGround())
plane = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground))
e1, e2, _ = frame(np.array(POSITION))
joint = mbs.AddObject(items.ObjectJointRollingDisc(
    markerNumbers=[plane, centre], discRadius=RADIUS, discAxis=e2, planeNormal=-e1
))


def aim(mbs, t, newton_iteration, discontinuous_iteration):
    \"\"\"Before each residual: the disc stands upright on the plane that touches the wall where the ball does.\"\"\"
    e1, e2, _ = frame(mbs.GetNodeOutput(node, exu.OutputVariableType.Position))
    rotation = mbs.GetNodeOutput(node, exu.OutputVariableType.RotationMatrix).reshape(3, 3)
    mbs.SetObjectParameter(joint, "planeNormal", (-e1).tolist())
    mbs.SetObjectParameter(joint, "discAxis", (e2 @ rotation).tolist())


mbs.SetPreNewtonResidualUserFunction(aim)
"""


CONTACT = """
HOLLOW = sum(RADII) - RADIUS


def hollow_centre(p):
    \"\"\"Centre of a hollow sphere that touches the wall where the ball at p does.\"\"\"
    return p + (gap(p) - (HOLLOW - RADIUS)) * frame(p)[0]


ground = mbs.AddObject(items.ObjectGround())
follower = mbs.AddMarker(items.MarkerBodyRigid(
    bodyNumber=ground, localPosition=hollow_centre(np.array(POSITION)).tolist()
))
state = mbs.AddNode(items.NodeGenericData(initialCoordinates=CONTACT_STATE, numberOfDataCoordinates=4))
mbs.AddObject(items.ObjectContactSphereSphere(
    markerNumbers=[centre, follower], nodeNumber=state, spheresRadii=RADII, isHollowSphere1=True,
    dynamicFriction=FRICTION, frictionProportionalZone=ZONE, contactStiffness=STIFFNESS,
))


def follow(mbs, t, newton_iteration, discontinuous_iteration):
    \"\"\"Before each residual: moves the hollow sphere along.\"\"\"
    p = mbs.GetNodeOutput(node, exu.OutputVariableType.Position)
    mbs.SetMarkerParameter(follower, "localPosition", hollow_centre(p).tolist())


mbs.SetPreNewtonResidualUserFunction(follow)
complaint = ""


def watch(mbs, t):
    \"\"\"After each step: ends the run where the contact opens, or slips though its friction stands for any.\"\"\"
    global complaint
    distance, slip = mbs.GetNodeOutput(state, exu.OutputVariableType.Coordinates)[:2]
    if t > 0 and distance > 0:
        complaint = f"the contact is open at {t:g} s"
    elif t > 0 and not BOUNDED and slip > SURELY * ZONE:
        complaint = f"the ball slips at {t:g} s with a coefficient of friction of {FRICTION:g}"
    return not complaint


mbs.SetPostStepUserFunction(watch)
"""


GENERIC = """
# q = (distance towards the wall, the wall's two coordinates, and three whose rates are the spin along e1, e2, e3)
ode = mbs.AddNode(items.NodeGenericODE2(
    referenceCoordinates=[0.0] * 6, initialCoordinates=[0.0, *COORDINATES, 0.0, 0.0, 0.0],
    initialCoordinates_t=RATES, numberOfODE2Coordinates=6,
))


def force(mbs, t, item, q, rates):
    \"\"\"Right-hand side: weight and the inertial terms, which are quadratic in the rates.\"\"\"
    result = list(WEIGHT)
    for row, i, j, factor in QUADRATIC:
        result[row] += factor * rates[i] * rates[j]
    if LEVER:  # rolling resistance; along the distance nothing accelerates, so the force there is N
        v2, v3 = (float(np.dot(row, rates[1:3])) for row in TANGENTS[1:])
        moment = LEVER * result[0] / (max(np.hypot(v2, v3), SLOW) or 1.0)
        result[4] -= moment * v3
        result[5] += moment * v2
    return result


mbs.AddObject(items.ObjectGenericODE2(nodeNumbers=[ode], massMatrix=np.array(MASS_MATRIX), forceUserFunction=force))
ground = mbs.AddNode(items.NodePointGround())
distance = [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=number, coordinate=0)) for number in (ground, ode)]
whole = [mbs.AddMarker(items.MarkerNodeCoordinates(nodeNumber=number)) for number in (ground, ode)]
mbs.AddObject(items.CoordinateConstraint(markerNumbers=distance))
mbs.AddObject(items.CoordinateVectorConstraint(
    markerNumbers=whole, scalingMarker1=np.array(ROWS), velocityLevel=True
))
"""


GENERIC_STATE = """

def seen():
    \"\"\"Centre, velocity and angular velocity in the world.\"\"\"
    q, rates = mbs.systemData.GetODE2Coordinates(), mbs.systemData.GetODE2Coordinates_t()
    p = np.array(POSITION)
    for (kind, axis), u, start in reversed(list(zip(GENERATORS, q[1:3], COORDINATES))):
        n, angle = np.array(axis), u - start
        if kind == "translation":
            p = p + angle * n
        else:
            along = np.dot(n, p) * n
            p = along + np.cos(angle) * (p - along) + np.sin(angle) * np.cross(n, p)
    e = frame(p)
    v = np.array(TANGENTS) @ rates[1:3] + np.array([rates[0], 0.0, 0.0])
    return p + q[0] * e[0], v @ e, np.array(rates[3:]) @ e
"""


_SETTINGS = """mbs.Assemble()

settings = exu.SimulationSettings()
settings.solution.file.write = False
settings.solution.sensors.active = False
settings.parallel.numberOfThreads = 1
integration = settings.timeIntegration
integration.verboseMode = 0
integration.numberOfSteps, integration.endTime = 1, STEP_SIZE
integration.adaptiveStep = HALVINGS > 0
if HALVINGS:
    integration.minimumStepSize = STEP_SIZE / 2**HALVINGS
integration.newton.relativeTolerance = NEWTON_TOLERANCE
integration.newton.absoluteTolerance = NEWTON_TOLERANCE / 100
integration.newton.modifiedNewtonJacUpdatePerStep = NEW_JACOBIAN
alpha = integration.generalizedAlpha
alpha.useNewmark = alpha.useIndex2Constraints = TRAPEZOIDAL
if SPECTRAL_RADIUS is not None:
    alpha.spectralRadius = SPECTRAL_RADIUS
solver = exu.MainSolverImplicitSecondOrder()
"""

CONSISTENT = """if ACCELERATIONS:
    # Consistent with constraints that turn with the ball, of which Exudyn cannot know.
    alpha.computeInitialAccelerations = False
    mbs.systemData.SetODE2Coordinates_tt(ACCELERATIONS, exu.ConfigurationType.Initial)
if not solver.InitializeSolver(mbs, settings):
    raise SystemExit("Exudyn does not accept the model")
if ACCELERATIONS:
    mbs.systemData.SetAECoordinates(MULTIPLIERS, exu.ConfigurationType.Current)
"""

RUN = """

def run(times):
    \"\"\"What is followed, at each time.\"\"\"
    now = 0.0
    for t in times:
        steps = round((t - now) / STEP_SIZE)
        if steps:
            solver.it.startTime = solver.it.currentTime = now
            solver.it.endTime, solver.it.numberOfSteps = t, steps
            try:
                done = solver.SolveSteps(mbs, settings)
            except Exception as error:
                raise RuntimeError(" ".join(str(error).split())) from None
            if solver.output.simulationStoppedByUserFunction:
                raise RuntimeError(complaint)
            if not done or abs(solver.it.currentTime - t) > STEP_SIZE / 2:
                words = " ".join(str(solver.GetErrorString()).split()) or "it gives no reason"
                raise RuntimeError(f"at {solver.it.currentTime:g} s: {words}")
            now = t
        yield seen()
"""


BALL_STATE = """

def seen():
    \"\"\"Centre, velocity and angular velocity in the world.\"\"\"
    kinds = (exu.OutputVariableType.Position, exu.OutputVariableType.Velocity, exu.OutputVariableType.AngularVelocity)
    return tuple(np.array(mbs.GetNodeOutput(node, kind)) for kind in kinds)
"""


def solver_source(settings: ExudynSettings) -> str:
    """Assembles ``mbs`` and makes ``settings`` and ``solver`` for it."""
    numbers = assigned(
        STEP_SIZE=settings.dt,
        HALVINGS=settings.halvings or 0,
        NEWTON_TOLERANCE=settings.newton_tolerance,
        NEW_JACOBIAN=settings.jacobian == "step",
        TRAPEZOIDAL=settings.integrator == "trapezoidal_index2",
        SPECTRAL_RADIUS=settings.spectral_radius,
    )
    return f"\n{numbers}{_SETTINGS}"
