"""Text of programs: rolling resistance, the edits of ``efc_aref``, a formulation, the run."""

from __future__ import annotations

RESIST = '''

def foreseen(d, N):
    """Normal force now [N], continued from the two evaluations before: the moment is needed before the forces."""
    t, (last, before, N_before, slope) = d.time, d.userdata[:4].tolist()
    if last > before:
        slope = (N - N_before) / (last - before)
    d.userdata[:4] = t, last, N, slope
    return max(N + slope * (t - last), 0.0)


def resist(d, N, e1, v, began=None):
    """Moment of rolling resistance: the normal force acts LEVER further on. MuJoCo's condim 6 is another law.

    It does no more than stop a ball within the step that began with the velocity v, or the one given.
    """
    moment, speed = LEVER * N, np.linalg.norm(v)
    if STOPPING * speed <= moment:
        v = (v if began is None else began) + PULL - np.dot(PULL, e1) * e1
        speed = np.linalg.norm(v)
        moment = min(moment, STOPPING * speed)
    d.xfrc_applied[BALL, 3:] = moment / speed * np.cross(e1, v) if speed else 0.0
'''

CORRECT = '''

def correct(d, N):
    """Edits efc_aref, which is no documented use: takes the lift that a convex cone gives to a slipping contact.

    N is the normal force of the evaluation before; of that are the last 18 numbers of userdata, the rows of slip.
    """
    if d.nefc == 0:
        return
    slip, reference = d.efc_J.reshape(d.nefc, -1)[1:3], d.efc_aref[1:3]
    tangents = d.contact.frame[0].reshape(3, 3)[1:]
    memory = d.userdata[-18:].reshape(3, -1)
    residual = tangents @ (memory @ d.qacc) - reference
    memory[:] = tangents.T @ slip
    lift = PRELOAD * N
    lever = RADIUS + d.efc_pos[0] / 2
    if np.linalg.norm(d.qfrc_constraint[-3:]) >= NEAR_CONE * FRICTION * N * lever:
        lift += FRICTION * np.linalg.norm(residual)
    d.efc_aref[0] -= lift
'''

CURVATURE = '''

def add_curvature(d, rates, trend):
    """Edits efc_aref, which is no documented use: adds the term of the turning normal that contact rows lack."""
    p, contact = d.qpos[:3], d.contact[0]
    spin = d.xmat[BALL].reshape(3, 3) @ rates[3:]
    rows = -RADIUS * (contact.frame.reshape(3, 3) @ np.cross(spin, normal_rate(p, rates[:3])))
    ahead = rates[:3] + LEAD * trend[:3]
    rows[0] = ahead @ normal_rate(p, ahead)
    d.efc_aref[contact.efc_address : contact.efc_address + contact.dim] += SHARE * rows[: contact.dim]
'''

FREE_POSE = '''

def pose_wall(d):
    """Puts the plane where the ball touches the wall: MuJoCo has no concave cylinder."""
    p = d.qpos[:3]
    e1 = frame(p)[0]
    d.mocap_pos[0] = p + (RADIUS + gap(p)) * e1
    mujoco.mju_quatZ2Vec(d.mocap_quat[0], -e1)
'''

FREE_PLAIN = '''

def step():
    """One step, after the plane was posed."""
    if LEVER:
        e1 = frame(data.qpos[:3])[0]
        N = float(data.qfrc_constraint[:3] @ data.geom_xmat[WALL, 2::3])  # of the step before
        resist(data, foreseen(data, N), e1, data.qvel[:3])
    pose_wall(data)
    mujoco.mj_step(model, data)
'''

FREE_EDITED = '''

def prepare(d):
    """Poses the plane; rates now, their trend, and the normal force of the evaluation before.

    An Euler step moves the ball with the new velocity: with the turning of the normal it is a leapfrog, and its
    velocities are LAG behind the positions.
    """
    e1, normal = frame(d.qpos[:3])[0], d.geom_xmat[WALL, 2::3].copy()
    N, rates, trend = float(d.qfrc_constraint[:3] @ normal), d.qvel.copy(), d.qacc.copy()
    if LAG:
        trend[:3] -= (trend[:3] @ normal) * normal
        rates += LAG * trend
        rates[:3] -= (rates[:3] @ e1) * e1
    pose_wall(d)
    if LEVER:
        resist(d, foreseen(d, N), e1, rates[:3], d.qvel[:3])
    return rates, trend, N


def edit(d, rates, trend, N):
    """Changes the reference acceleration of the contact."""
    if d.nefc and CURVED:
        add_curvature(d, rates, trend)
    if d.nefc and CORRECTED:
        correct(d, N)


def evaluate(d):
    """Forces and accelerations of the present state."""
    motion = prepare(d)
    mujoco.mj_fwdPosition(model, d)
    mujoco.mj_fwdVelocity(model, d)
    edit(d, *motion)
    mujoco.mj_fwdActuation(model, d)
    mujoco.mj_fwdAcceleration(model, d)
    mujoco.mj_fwdConstraint(model, d)


def step():
    """One step, with the edit between its halves."""
    motion = prepare(data)
    mujoco.mj_step1(model, data)
    edit(data, *motion)
    mujoco.mj_step2(model, data)
'''

CHART = '''

def pose_wall(m, d, geom1, geom2):
    """Called between kinematics and collision at each evaluation: the plane takes the pose of the site."""
    touch = m.site("touch").id
    d.geom_xpos[WALL], d.geom_xmat[WALL] = d.site_xpos[touch], d.site_xmat[touch]
    return 0


mujoco.set_mjcb_contactfilter(pose_wall)


def step():
    """One step."""
    mujoco.mj_step(model, data)
'''

CHART_RESIST = '''

def passive(m, d):
    """Called between velocities and accelerations."""
    N = foreseen(d, -float(d.qfrc_constraint[DEPTH]))
    resist(d, N, -d.site_xmat[m.site("touch").id, 2::3], d.cvel[BALL, 3:])


mujoco.set_mjcb_passive(passive)
'''

CHART_CORRECT = '''

def control(m, d):
    """Called between the reference accelerations and the forces."""
    correct(d, -float(d.qfrc_constraint[DEPTH]))


mujoco.set_mjcb_control(control)
'''

FACETS = '''

def step():
    """One step."""
    if LEVER:
        e1 = frame(data.qpos[:3])[0]
        resist(data, -float(data.qfrc_constraint[:3] @ e1), e1, data.qvel[:3])
    mujoco.mj_step(model, data)
    if abs(frame(np.array(POSITION))[2] @ data.qpos[:3]) > model.geom_size[WALL, 2]:
        raise RuntimeError("the ball has left the ring of boxes")
'''

RUN = '''

FATAL = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC", "mjWARN_CONTACTFULL", "mjWARN_CNSTRFULL")


def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    look, velocity, done = mujoco.MjData(model), np.zeros(6), 0
    for t in times:
        while done < round(t / model.opt.timestep):
            step()
            done += 1
        for name in FATAL:
            if data.warning[getattr(mujoco.mjtWarning, name)].number:
                raise RuntimeError(f"MuJoCo warns of {name} before {t:g} s")
        mujoco.mj_copyData(look, model, data)
        if LAG:
            for _ in range(EVALUATIONS):
                evaluate(look)
            look.qvel += LAG * look.qacc  # velocities are behind the positions
        mujoco.mj_kinematics(model, look)
        mujoco.mj_comPos(model, look)
        mujoco.mj_comVel(model, look)
        mujoco.mj_objectVelocity(model, look, mujoco.mjtObj.mjOBJ_BODY, BALL, velocity, 0)
        yield look.xpos[BALL].copy(), velocity[3:].copy(), velocity[:3].copy()
'''
