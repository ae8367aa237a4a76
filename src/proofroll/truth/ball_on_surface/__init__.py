"""Truth of a ball on a surface: rolling, stick and slip, flight and impact, each by two routes."""
