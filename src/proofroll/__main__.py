"""Command ``proofroll``; this module is small, so that signals are handled while the rest is loaded."""


def _leave(*_: object) -> None:
    """Ends the process at once: nothing has begun, and a module being loaded might swallow an exception."""
    import os

    os.write(2, b"proofroll: interrupted before anything was run\n")
    os._exit(130)


def main() -> None:
    """Entry point."""
    try:
        import gc
        import signal

        gc.set_threshold(20_000)  # imports leave no garbage, and collection takes a tenth of a short command

        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):  # else a shell ignores it
                signal.signal(number, _leave)
        from proofroll.cli import main as command_line

        command_line()
    except KeyboardInterrupt:
        _leave()


if __name__ == "__main__":
    main()
