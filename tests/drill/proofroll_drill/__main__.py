"""Runs the commands of this package: ``python -m proofroll_drill``."""

from proofroll.cli import main
from proofroll_drill.command import drill

if __name__ == "__main__":
    main(drill)
