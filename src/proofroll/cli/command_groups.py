"""Commands in groups by purpose, as ``proofroll --help`` lists them."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

# Title -> commands in their order. Commands of other packages that are not named here come last.
GROUPS = {
    "Ask": ("scenes", "run", "replay", "watch", "compare", "recommend", "report", "diff"),
    "Bring": ("new", "check", "judge", "export"),
    "Study": ("stability", "ladder", "fuzz", "throughput", "balance", "paper"),
    "Maintain": ("engines", "findings", "cite"),
}
_OTHERS = "Others"
_WIDE = 80  # columns of a screen
# Command of earlier versions -> command that does the same now. The last two come with a clone, not with the wheel;
# `balance`, `fuzz` and `throughput` are looked for here only where their packages are not installed.
NOW = {
    "tradeoff": "proofroll recommend SCENE --plot FILE.svg",
    "plot": "proofroll run SCENE --engine NAME --plot FILE, and of a stored run proofroll replay RUN",
    "history": "proofroll replay [NAME]..., of runs that proofroll run --keep NAME keeps",
    "versions": "proofroll diff ENGINE@OLD ENGINE@NEW [SCENE]...",
    "onset": "proofroll paper onset",
    "regimes": "proofroll paper regimes",
    "figures": "proofroll paper figures",
    "vocabulary": "proofroll check --keys [WORD]",
    "fuzz": "in a package of its own: pip install proofroll-fuzz; in a clone of the repository, pip install ./fuzz",
    "throughput": "in a package of its own: pip install proofroll-throughput; in a clone, pip install ./throughput",
    "balance": "in a package of its own: pip install proofroll-balance; in a clone, pip install ./balance",
    "bench": "python -m proofroll_benchmarks; in a clone of the repository, pip install ./benchmarks",
    "drill": "python -m proofroll_drill; in a clone of the repository, pip install ./tests/drill",
}


class GroupedCommands(TyperGroup):
    """The commands, listed by :data:`GROUPS`: a line for each, on one screen."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:  # noqa: ARG002 -- of the base
        """Words behind the program's name; the options are among them, as they have no list."""
        return ["[--version]", "COMMAND", "[ARGS]...", "[--help]"]

    def format_help_text(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 -- of the base
        """Writes what the commands answer below the usage, without an empty line, which a screen lacks."""
        formatter.write(f"{self.help}\n")

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Writes a line for each command, with the title of its group beside the first."""
        left = dict.fromkeys(self.list_commands(ctx))
        widest = max(map(len, left), default=0)
        margin = max(map(len, (*GROUPS, _OTHERS)))
        for group, names in (*GROUPS.items(), (_OTHERS, tuple(left))):
            title = group
            for name in (name for name in names if name in left):
                del left[name]
                command = self.get_command(ctx, name)
                if command is not None and not command.hidden:
                    words = command.get_short_help_str(_WIDE - margin - widest - 4)
                    formatter.write(f"{title:{margin}}  {name:{widest}}  {words}\n")
                    title = ""
