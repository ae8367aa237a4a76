"""Vocabulary shared by all packages: scenes, the engine protocol, events, verdicts, claims."""
