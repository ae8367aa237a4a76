"""Drake for proofroll."""
