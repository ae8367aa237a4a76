"""The command ``proofroll``; small, so that Ctrl-C finds it ready while the rest loads."""


def _leave(*_: object) -> None:
    """Ends the process at once: nothing has been begun, and an exception could be lost in whatever is being loaded."""
    import os

    os.write(2, b"proofroll: interrupted before anything was run\n")
    os._exit(130)


def main() -> None:
    """Entry point."""
    try:
        import signal

        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a shell may have told us to ignore it
            signal.signal(signal.SIGINT, _leave)
        from proofroll.cli import main as command_line

        command_line()
    except KeyboardInterrupt:
        _leave()


if __name__ == "__main__":
    main()
