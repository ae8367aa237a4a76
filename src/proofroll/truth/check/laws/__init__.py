"""Laws of mechanics, against which truths are held.

It shares nothing with the routes: kinematics from poses, coefficients, axes and shapes from the scene's own numbers.
What is published, and what happens between two stretches of a motion, is held against them.
"""
