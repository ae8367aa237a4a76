"""Truth of a ball on a surface: rolling, stick and slip, and the flight from the wall, each by two routes."""
