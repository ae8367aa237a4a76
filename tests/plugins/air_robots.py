"""A robot in the air under a policy: a body with two legs, written here, and solo12 of a package."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from servo_robots import servo_tables

from proofroll.core.parameters import Parameters
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.reading.reader import made_mechanism
from proofroll.elements.mechanism.scene.policy import Observation, PolicySource
from proofroll.robots.control.bookkeeping.law import ControlLaw


def make_policy(joints: Sequence[str]) -> Policy:
    """Makes a small network with fixed random weights."""
    return Policy(len(joints))


class Policy:
    """Network with one hidden layer of fixed random weights, which sees all of an observation but its place."""

    def __init__(self, count: int) -> None:
        generator = np.random.default_rng(7)
        self.first = generator.normal(size=(32, 3 * count + 9)) * 0.4
        self.second = generator.normal(size=(count, 32)) * 0.5

    def __call__(self, seen: Observation) -> np.ndarray:
        """Action of the network."""
        parts = (seen.q, 0.1 * seen.v, seen.last, seen.v_WB_W, 0.5 * seen.w_WB_B, seen.gravity_B)
        return np.tanh(self.second @ np.tanh(self.first @ np.concatenate(parts)))


def legged() -> Mechanism:
    """A body that floats, with two legs of three joints."""
    bodies = [Body("trunk", 2.0, (0.02, 0.0, 0.01), ((0.02, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.04)))]
    joints = [Joint("base", "free", "world", "trunk", q0=(0, 0, 1, 1, 0, 0, 0))]
    for leg, side in (("FL", 0.1), ("FR", -0.12)):
        parent, place = "trunk", (0.15, side, 0.0)
        for part, axis in (("HAA", (1, 0, 0)), ("HFE", (0, 1, 0)), ("KFE", (0, 1, 0))):
            name = f"{leg}_{part}"
            inertia = ((2e-3, 0.0, 0.0), (0.0, 2.1e-3, 0.0), (0.0, 0.0, 6e-4))
            bodies.append(Body(name, 0.3, (0.0, 0.01, -0.08), inertia))
            joints.append(Joint(name, "revolute", parent, name, position=place, axis=axis, q0=(0.0,), armature=1e-3))
            parent, place = name, (0.0, 0.02, -0.16)
    return Mechanism(tuple(bodies), tuple(joints))


def solo12() -> Mechanism:
    """Solo12 of its package, with an armature at every joint."""
    tables = servo_tables("solo12", 1e-3)
    return made_mechanism({**tables, "actuators": []}, (0.0, 0.0, -9.81), Parameters({}, {}))


def law_of(mechanism: Mechanism, limit: float = 0.8) -> ControlLaw:
    """Law of a probe: a policy at 50 Hz with servos that saturate at the start."""
    joints = tuple(joint.name for joint in mechanism.joints if joint.nq == 1)
    pose = np.array([{"HAA": 0.1, "HFE": 0.7, "KFE": -1.4}[name[-3:]] for name in joints])
    pose *= np.array([1.0 if name[0] == "F" else -1.0 for name in joints])
    count = len(joints)
    return ControlLaw(
        joints=joints,
        rate=50.0,
        delay=0,
        scale=0.25,
        pose=pose,
        kp=np.full(count, 5.0),
        kd=np.full(count, 0.2),
        limit=np.full(count, limit),
        armature=np.full(count, 1e-3),
        policy=PolicySource("test:make", make=make_policy),
        targets=tuple(pose.tolist()),
        down=np.array([0.0, 0.0, -1.0]),
        signs=np.ones(count),
    )


def start_of(law: ControlLaw) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints off their pose, and a base that is tilted and spins, so that every convention shows."""
    generator = np.random.default_rng(3)
    q = law.pose + 0.15 * generator.choice([-1.0, 1.0], len(law.pose))
    turned = np.array([np.cos(0.25), 0.3, -0.2, 0.35])
    turned /= np.linalg.norm(turned)
    base = np.concatenate([[0.0, 0.0, 1.0], turned, [0.2, -0.1, 0.3], [0.3, -0.4, 0.9]])
    return q, np.zeros(len(q)), base
