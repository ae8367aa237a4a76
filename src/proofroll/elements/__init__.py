"""What a scene can hold, one folder per kind of element."""
