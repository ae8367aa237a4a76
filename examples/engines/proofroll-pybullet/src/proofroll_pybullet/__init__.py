"""PyBullet for proofroll."""
