"""Contact between bodies: what touches, by which law, where and how."""
