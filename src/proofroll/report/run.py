"""What ``proofroll run`` says."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from proofroll.core.diagnosis.of_scene import diagnosed
from proofroll.core.events import events_of
from proofroll.files.netcdf import read
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, Result

_EVENTS = 8  # of so many the terminal tells; the JSON document has all


def run_content(case: Case, result: Result, trajectory: Path) -> dict[str, Any]:
    """A run as plain data.

    ``final`` is the state at the last sample, empty if there is none; ``absent`` says of variables without a value why.
    """
    content: dict[str, Any] = {
        "scene": case.scene,
        "parameters": case.parameters,
        "engine": case.engine.name,
        "settings": case.engine.settings,
        "status": result.status.value,
        "message": result.message,
        "until": case.until,
        "final": {},
        "units": {},
        "absent": {},
        "events": [],
        "wall_seconds": result.wall_seconds,
        "versions": result.versions,
        "certificate": result.certificate,
        "diagnosis": [],
    }
    if result.trajectory is None and result.certificate:
        scene = load_scene(case.scene, asks=case.asks, **case.parameters)
        content["diagnosis"] = [item.as_dict() for item in diagnosed(scene, result.certificate)]
    if result.trajectory is None:
        return content
    dataset = read(trajectory)
    curves = {name: variable for name, variable in dataset.data_vars.items() if variable.dims == ("time",)}
    content["final"] = {"time": float(dataset["time"][-1])} | {str(k): float(v[-1]) for k, v in curves.items()}
    content["units"] = {"time": "s"} | {str(name): variable.attrs["units"] for name, variable in curves.items()}
    content["absent"] = {str(k): str(v.attrs["absent"]) for k, v in curves.items() if "absent" in v.attrs}
    if "smallest_N" in dataset.attrs:
        content["smallest_N"] = float(dataset.attrs["smallest_N"])
    content["events"] = [dataclasses.asdict(event) for event in events_of(dataset)]
    bars = {str(k): float(v.attrs["error_bar"]) for k, v in curves.items() if "error_bar" in v.attrs}
    if bars:
        content["error_bars"] = bars
    return content


def _told(event: Mapping[str, Any]) -> str:
    """One event with its bracket."""
    kind, bar = event["kind"].replace("_", "-"), 0.5 * (event["time_high"] - event["time_low"])
    return f"{kind} at {event['time']:.9g} ± {bar:.1g} s"


def run_lines(content: dict[str, Any]) -> list[Any]:
    """A run for a person, as things that rich prints."""
    from rich.table import Table
    from rich.text import Text

    settings = ", ".join(f"{key}={value}" for key, value in content["settings"].items())
    lines: list[Any] = [Text(f"{content['scene']} in {content['engine']}" + (f" ({settings})" if settings else ""))]
    lines.append(Text(f"{content['status']}: {content['message']}"))
    lines += [Text(f"  {cause['sentence']}") for cause in content["diagnosis"]]
    if not content["final"]:
        return lines
    bars = content.get("error_bars", {})
    table = Table(box=None, pad_edge=False)
    table.add_column("at the end")
    table.add_column("value", justify="right")
    table.add_column("unit")
    if bars:
        table.add_column("error bar", justify="right")
    shown = {name: value for name, value in content["final"].items() if name not in content["absent"]}
    for name, value in shown.items():
        bar = [f"{bars[name]:.1e}" if name in bars else ""] if bars else []
        table.add_row(name, f"{value:.12g}", content["units"][name], *bar)
    lines.append(table)
    for reason in dict.fromkeys(content["absent"].values()):
        without = [name for name, why in content["absent"].items() if why == reason]
        lines.append(Text(f"{reason}: {', '.join(without)}"))
    if "smallest_N" in content:
        lines.append(Text(f"smallest normal force: {content['smallest_N']:.6g} N"))
    if content["events"]:
        said = ", ".join(_told(event) for event in content["events"][:_EVENTS])
        more = len(content["events"]) - _EVENTS
        lines.append(Text(f"events: {said}{f' and {more} more' if more > 0 else ''}"))
    lines.append(Text(f"{content['wall_seconds']:.3g} s of wall time"))
    for key in ("trajectory", "plot"):
        if key in content:
            lines.append(Text(f"The {key} is in {content[key]}."))
    return lines
