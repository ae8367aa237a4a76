"""``python -m proofroll.cli``."""

from proofroll.cli import main

main()
