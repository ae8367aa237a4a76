"""Reader of balls on surfaces, which are bodies with spheres that touch walls."""
