"""Exceptions whose text is one sentence that a person can act on."""

from __future__ import annotations

import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
_ADAPTERS = tuple(_PACKAGE / folder for folder in ("engines", "papers", "robots/importers"))
_SHOWN = 20  # names of a list in a message
_LONGEST_FIELD = 300  # characters: a path and the keys that lead to a value; a key itself may have any length


class ProofrollError(Exception):
    """Base of everything proofroll raises on purpose; its text is one line for a person."""


class InputError(ProofrollError):
    """A wrong value given by the user.

    Attributes:
        field: name of the offending field as the user writes it, e.g. ``radius``.
        value: the value that was given; None: there is none.
        advice: the mistake and its remedy.
    """

    def __init__(self, field: str, value: object, advice: str) -> None:
        self.field = _short(field, _LONGEST_FIELD)
        self.value = value
        self.advice = advice
        head = f"{self.field} is missing" if value is None else f"{self.field} = {_shown(value)}"
        super().__init__(f"{head}: {advice}")

    def within(self, field: str, value: object) -> InputError:
        """The same error, reported for a larger field that contains this one."""
        return InputError(field, value, str(self))

    def of(self, place: str) -> InputError:
        """The same error with the name of a file, or of a part of it, before the field."""
        named = self.field.startswith(place) or self.field == "file"
        return self if named else InputError(f"{place}: {self.field}", self.value, self.advice)


class Refused(ProofrollError):  # noqa: N818 -- a refusal is an honest answer, not an error
    """The engine cannot represent this scene honestly; the text says why."""


class NotUnique(Refused):
    """The laws of the scene have no unique answer, by whatever method; the text says where."""


class Missing(ProofrollError):  # noqa: N818 -- a state of the machine: the engine is not installed
    """The engine cannot be loaded here; the text says why and how to get it."""


class Unwritable(ProofrollError):  # noqa: N818 -- a state of the machine, as a full disk
    """A file cannot be written; the text says which and why.

    Attributes:
        number: the system's number of the reason, as ``errno.ENOSPC``.
        reason: the same in words.
    """

    def __init__(self, message: str, number: int, reason: str) -> None:
        self.number, self.reason = number, reason
        super().__init__(message)


class Diverged(ProofrollError):  # noqa: N818 -- a finding about the engine
    """The engine gave up or produced a state that is not finite; the text says when.

    Attributes:
        time: up to which the motion is known [s]; None: the text alone says it.
    """

    def __init__(self, text: str = "", time: float | None = None) -> None:
        super().__init__(text)
        self.time = time


@contextmanager
def error_location(place: str) -> Iterator[None]:
    """Context manager that adds the name of a file to an InputError, see :meth:`InputError.of`."""
    try:
        yield
    except InputError as error:
        raise error.of(place) from None


def no_such_key(field: str, value: object, keys: Iterable[str]) -> InputError:
    """Error for an unknown key of a file, with the known keys and the one that is probably meant.

    Args:
        field: for the message; the key follows its last dot.
        value: of the key.
        keys: known keys.
    """
    names = list(keys)
    meant = get_close_matches(field.rpartition(".")[2].rpartition(" ")[2], names, 1)
    hint = f"; did you mean {meant[0]}?" if meant else ""
    return InputError(field, value, f"there is no such key here; the keys are {', '.join(names)}{hint}")


def require_known(
    field: str, name: object, names_allowed: Iterable[str], advice: str = "choose one of", value: object = None
) -> None:
    """Raises an error that lists known names and the one that is probably meant, unless ``name`` is known.

    Args:
        field: for the message.
        name: the name to look for.
        names_allowed: known names.
        advice: beginning of the advice, before the list.
        value: text to show instead of the name, if the user wrote more than the name.

    Raises:
        InputError: the name is unknown.
    """
    names = list(names_allowed)
    if name not in names:
        meant = get_close_matches(str(name), names, 1) if len(names) <= _SHOWN else ()
        hint = f"; did you mean {meant[0]}?" if meant else ""
        raise InputError(field, name if value is None else value, f"{advice} {choices(names, name)}{hint}")


def refuse_first(engine: str, settings: object, rules: Iterable[tuple[bool, str, str]]) -> None:
    """Raises an error for the first rule that settings of an engine break.

    Args:
        engine: its name.
        settings: of the engine.
        rules: True if the rule is broken, name of the setting, advice.

    Raises:
        InputError: a rule is broken.
    """
    for broken, name, advice in rules:
        if broken:
            raise InputError(f"{engine}: {name}", getattr(settings, name), advice)


def raised_at(error: BaseException) -> str:
    """Line of an adapter that raised an exception, as ``file:line in function``; empty if no adapter did.

    It is the innermost line in the first package outside the harness; lines of libraries that it calls are skipped, and
    those of modules that only pass on (``__tracebackhide__``, as in pytest).
    """
    traced = zip(traceback.walk_tb(error.__traceback__), traceback.extract_tb(error.__traceback__), strict=True)
    shown = [summary for (frame, _), summary in traced if not frame.f_globals.get("__tracebackhide__")]
    frames = [frame for frame in shown if "importlib" not in frame.filename]
    files = [(frame, Path(frame.filename)) for frame in frames]
    ours = [file.is_relative_to(_PACKAGE) and not any(map(file.is_relative_to, _ADAPTERS)) for _, file in files]
    outside = [frame for (frame, _), harness in zip(files, ours, strict=True) if not harness]
    if not outside:
        return ""
    home = Path(outside[0].filename).parent
    last = [frame for frame in outside if Path(frame.filename).is_relative_to(home)][-1]
    return f"{'/'.join(Path(last.filename).parts[-2:])}:{last.lineno} in {last.name}"


def lack_behind(error: BaseException) -> BaseException | None:
    """Lack of memory, a file or time (Ctrl-C) that caused an error; None: the engine itself failed."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, (MemoryError, OSError, KeyboardInterrupt)):
        cause = cause.__cause__ or cause.__context__
    return cause


def choices(names: Iterable[str], wrong: object = "") -> str:
    """List of names to choose from; of more than twenty those that resemble a wrong one, or the first twenty."""
    shown = list(dict.fromkeys(names))
    if len(shown) > _SHOWN and (near := get_close_matches(str(wrong), shown)):
        return ", ".join([*near, "…"])
    return ", ".join(shown[:_SHOWN] + ["…"] * (len(shown) > _SHOWN)) or "(there are none)"


def _shown(value: object) -> str:
    if isinstance(value, Path):
        return repr(str(value))  # a shortened path would be useless
    return _short(repr(value) if isinstance(value, str) else str(value), 60)


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 3] + "..."
