"""MuJoCo Warp for proofroll."""
