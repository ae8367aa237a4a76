"""Runs of engines on mechanisms, and their errors against route 1 of the truth."""

import dataclasses
import functools

import numpy as np
from lone_routes import by_joints
from mechanism_scenes import mechanism_named

from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Tree
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.rotations import from_quaternion

# Formulation for mechanisms -> its engine, and the preset for which tests have tight bounds.
FORMULATIONS = {
    "joints": ("mujoco", "tuned"),
    "redundant": ("exudyn", "tuned"),
    "tree": ("exudyn", "matched"),
    "null_space": ("pinocchio", "tuned"),
    "constraint_dynamics": ("pinocchio", "tuned"),
    "dependent": ("projection", "matched"),
}


@functools.cache
def model(name, **parameters):
    """The mechanism of a scene."""
    return mechanism_named(name, **parameters)


@functools.cache
def true(mechanism, until):
    """Route 1 at six times from 0, and which components of reactions are determinate."""
    found = analyse(mechanism)
    return by_joints(mechanism, np.linspace(0, until, 6), 1e-13), found.determinate


def settings(formulation, **options):
    """The engine, and the settings of its tight preset with some of them changed."""
    name, preset = FORMULATIONS[formulation]
    engine = load_engine(name)
    return engine, dataclasses.replace(engine.presets[formulation][preset], **options)


def build(formulation, mechanism, **options):
    """Run of a mechanism in a formulation with its tight preset."""
    engine, chosen = settings(formulation, **options)
    return engine.build(mechanism, chosen)


def wrench(sample):
    """Force and moment of each joint and loop, (joints + loops, 6)."""
    return np.concatenate([sample.joint_force, sample.joint_torque], axis=1)


def errors(run, mechanism, until):
    """Largest errors of bodies and points, and of determinate reactions, over a grid of times after 0."""
    truth, determinate = true(mechanism, until)
    position, reaction = 0.0, 0.0
    for k, t in enumerate(truth.time[1:], start=1):
        run.advance(float(t))
        sample = run.sample()
        position = max(position, np.abs(sample.p_WB - truth.p_WB[k]).max())
        for point in mechanism.points:
            i = mechanism.body_index[point.body]
            found, place = (
                p_WB[i] + from_quaternion(q_WB[i]) @ point.position
                for p_WB, q_WB in ((sample.p_WB, sample.q_WB), (truth.p_WB[k], truth.q_WB[k]))
            )
            position = max(position, np.abs(found - place).max())
        if sample.joint_force is not None:
            reaction = max(reaction, np.nanmax(np.abs(wrench(sample) - truth.wrench[k])[determinate], initial=0.0))
    return position, reaction


def start(mechanism):
    """The bodies' frames at time 0, their accelerations (bodies, 6), and the wrenches of joints and loops."""
    equations = JointCoordinates(mechanism)
    found = equations.solve(*mechanism.start())
    motion = Tree(mechanism).at(*mechanism.start())
    accelerations = (found.motion.J @ found.acceleration + found.motion.bias)[:-1]
    return motion, accelerations, equations.sample(*mechanism.start())["wrench"]
