"""Equations of motion as compiled Taylor series (heyoka): for engines, for the truth, and for the benchmarks."""
