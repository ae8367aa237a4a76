"""Runs the commands of this package: ``python -m proofroll_benchmarks``."""

from proofroll.cli import main
from proofroll_benchmarks.command import bench

if __name__ == "__main__":
    main(bench)
