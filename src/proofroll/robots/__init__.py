"""Robot files: whether engines hold the model that the file describes, and if not, who is wrong about what."""
