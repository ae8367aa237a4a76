"""What everything speaks: scenes, the engine protocol, events, verdicts, claims."""
