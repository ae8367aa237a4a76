"""Command ``balance``: an equilibrium, the efforts that hold it, and eigenvalues about it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.number_format import with_bar

if TYPE_CHECKING:
    from rich.table import Table

    from proofroll_balance.balance import Balance


_FAINT = 1e-10  # relative to the largest value of its unit: what is shown as zero


def balance(
    scene: options.SceneName,
    settings: options.Set = None,
    _root: options.Root = None,
    engine: options.Engines = None,
    hold: Annotated[list[str] | None, typer.Option(help="Joint that is held where it starts; repeat.")] = None,
    control: options.Control = None,
    tolerance: Annotated[float, typer.Option(help="Relative difference up to which an engine agrees.")] = 1e-3,
    as_json: options.Json = False,
) -> None:
    """Find an equilibrium, what holds it, and eigenvalues. It is sought near the start, in every engine.

    Velocities are zero and signals are as at time 0. The effort of a joint that is held, or moves as prescribed, is
    drive.<joint>; the reaction of a fixed one is force.<joint> and torque.<joint>, on its child, along the axes of the
    world.
    """
    from proofroll_balance.balance import balance as found

    scene = options.controlled(scene, control)
    with options.spinner(scene) as says:
        study = found(
            scene,
            options.assignments(settings),
            engines=engine or (),
            hold=tuple(dict.fromkeys(hold or [])),
            tolerance=tolerance,
            progress=says,
        )
    options.show(study, as_json, lambda: _parts(study))
    ran = [item for item in study.engines if not item.refused]
    if engine and not ran:
        raise typer.Exit(options.ENGINE)
    raise typer.Exit(options.OK if all(item.agrees for item in ran) else options.CONTRADICTED)


def _parts(study: Balance) -> Iterator[Table | str]:
    from rich.table import Table
    from rich.text import Text

    held = f", with {', '.join(study.held)} held" if study.held else ""
    yield f"{study.scene} at rest{held}; degrees of freedom: {study.freedom}"
    values = Table(box=None, pad_edge=False)
    for heading in ("value", "", "unit", "±"):
        values.add_column(heading, justify="left" if heading in {"value", "unit"} else "right")
    largest = {item.unit: max(abs(row.value) for row in study.values if row.unit == item.unit) for item in study.values}
    for item in study.values:
        faint = abs(item.value) if abs(item.value) < _FAINT * largest[item.unit] else 0.0
        value, bar = with_bar(item.value, max(item.error_bar, faint), 1)
        values.add_row(Text(item.name), value, item.unit, bar)
    yield values
    if study.freedom:
        yield f"eigenvalues [1/s] ± {study.eigenvalue_error:.1g}, {'stable' if study.stable else 'unstable'}:"
        upper = [(real, imaginary) for real, imaginary in study.eigenvalues if imaginary >= 0]
        for real, imaginary in upper:
            yield f"  {real:.6g} ± {imaginary:.6g} i" if imaginary else f"  {real:.6g}"
    engines = Table(box=None, pad_edge=False)
    for heading in ("engine", "", "acceleration left", "efforts", "reactions", "eigenvalues"):
        engines.add_column(heading, justify="left" if heading in {"engine", ""} else "right", no_wrap=not heading)
    for row in study.engines:
        if row.refused:
            continue
        numbers = (row.left, row.efforts, row.reactions, row.eigenvalues)
        parts = ["–" if number is None else f"{number:.2g}" for number in numbers]
        engines.add_row(Text(row.engine), "✓ agrees" if row.agrees else "✗ differs", *parts)
    if engines.row_count:
        yield engines
        yield "Differences are relative to the largest value of their kind; the acceleration is in m/s² or rad/s²."
    for row in study.engines:
        if row.refused:
            yield f"{row.engine} is left out: {row.refused}"
