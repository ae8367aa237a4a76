"""Random scenes of mechanisms, valid by construction, with each feature of the vocabulary."""
