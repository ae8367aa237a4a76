"""Elements of scenes, one folder per kind."""
