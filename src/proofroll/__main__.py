"""Command ``proofroll``; this module is small, so that Ctrl-C is handled while the rest is loaded."""


def _leave(*_: object) -> None:
    """Ends the process at once: nothing has begun, and a module being loaded might swallow an exception."""
    import os

    os.write(2, b"proofroll: interrupted before anything was run\n")
    os._exit(130)


def main() -> None:
    """Entry point."""
    try:
        import signal

        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a shell may have set it to be ignored
            signal.signal(signal.SIGINT, _leave)
        from proofroll.cli import main as command_line

        command_line()
    except KeyboardInterrupt:
        _leave()


if __name__ == "__main__":
    main()
