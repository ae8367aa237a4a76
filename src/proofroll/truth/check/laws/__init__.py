"""Law check: the record of each route of the truth, held against the laws of mechanics themselves.

It shares nothing with the routes: kinematics from poses, coefficients, axes and shapes from the scene's own numbers.
Over each piece of a motion, from its start to each of its points, momentum is the integral of the stated forces, and
the place that of the velocity; at an impact impulses take the place of integrals. No accelerations are needed, and no
digits are lost to differences.
"""
