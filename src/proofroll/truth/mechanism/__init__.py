"""Two routes to the truth of a mechanism that share no kinematics, and closed forms."""
