"""Commands in groups by purpose, as ``proofroll --help`` lists them."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

# Title -> commands in their order. Commands of other packages that are not named here come last.
GROUPS = {
    "Ask": ("scenes", "run", "plot", "replay", "compare", "recommend", "report", "diff"),
    "Bring your own scene, engine or trajectory": ("new", "vocabulary", "check", "judge", "export"),
    "Study": ("stability", "ladder", "fuzz", "balance"),
    "Blajer's article (2006)": ("onset", "regimes", "figures"),
    "Maintain": ("engines", "versions", "findings", "cite", "bench", "drill"),
}
_OTHERS = "Others"
# Command of earlier versions -> what does the same now.
_NOW = {"tradeoff": "recommend SCENE --plot FILE.svg"}
# Command -> folder of the package that brings it; the wheel does not contain these.
_OF_THE_REPOSITORY = {"bench": "benchmarks", "drill": "tests/drill"}


class GroupedCommands(TyperGroup):
    """The commands, listed by :data:`GROUPS`."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Writes a section of the help for each group of commands."""
        left = dict.fromkeys(self.list_commands(ctx))
        widest = max(map(len, left), default=0)
        for title, names in (*GROUPS.items(), (_OTHERS, tuple(left))):
            rows = []
            for name in (name for name in names if name in left):
                del left[name]
                command = self.get_command(ctx, name)
                if command is not None and not command.hidden:
                    rows.append((name.ljust(widest), command.get_short_help_str(10_000)))
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def origin(name: str) -> str:
    """Sentence on where a command comes from that the wheel does not contain, or what it became; empty for others."""
    if name in _NOW:
        return f"{name} is now proofroll {_NOW[name]}"
    if name not in _OF_THE_REPOSITORY:
        return ""
    folder = _OF_THE_REPOSITORY[name]
    return f"{name} is a package of the repository: in a clone of it, pip install ./{folder}"
