"""A scene of a ball and a mechanism, as a file has it."""

BALL_AND_PENDULUM = """
title = "A ball in a cylinder, and a pendulum"
source = "chosen"
duration = 0.1

[gravity]
magnitude = 9.81
direction = [0, 0, -1]

[[balls]]
name = "ball"
radius = 0.025
mass = 0.5

[[surfaces]]
kind = "cylinder"
name = "wall"
radius = 0.2

[[contacts]]
body = "ball"
surface = "wall"

[[initial]]
body = "ball"
velocity = [0.5, 0.2]

[[bodies]]
name = "rod"
mass = 1.0
com = [0, 0, -0.5]
inertia = [0.08, 0.08, 0.001]

[[joints]]
name = "pivot"
kind = "revolute"
axis = [0, 1, 0]
parent = "world"
child = "rod"
q0 = 1.0
"""
