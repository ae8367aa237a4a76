"""What proofroll itself costs: adapters against bare loops, and studies against the time inside engines."""
