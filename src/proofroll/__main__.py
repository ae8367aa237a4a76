"""The command ``proofroll``; small, so that Ctrl-C finds it ready while the rest loads."""

import sys


def main() -> None:
    """Entry point."""
    try:
        from proofroll.cli import main as command_line
    except KeyboardInterrupt:
        sys.stderr.write("proofroll: interrupted before anything was run\n")
        sys.exit(130)
    command_line()


if __name__ == "__main__":
    main()
