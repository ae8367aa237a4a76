"""Tables of a scene file read as a mechanism: its parts, loops closed at the start, odd numbers."""
