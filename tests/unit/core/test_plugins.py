from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import distribution, distributions
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from annotated_types import Gt

from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.plugins import (
    EngineSpec,
    engine_names,
    load_engine,
    parse_engine,
    require_engine,
    resolve_settings,
)
from proofroll.files.scene_file import load_scene


@dataclass(frozen=True)
class ToySettings:
    """Settings of every type that engines use."""

    formulation: Literal["free", "chart"] = "free"
    preset: Literal["default", "matched", "tuned"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    iterations: int = 5
    exact: bool = False


class Toy:
    """An engine that has nothing but settings."""

    name = "toy"
    provides: Mapping[str, frozenset[str]] = {"free": frozenset(), "chart": frozenset()}
    settings = ToySettings
    presets: Mapping[str, Mapping[str, ToySettings]] = {
        "free": {"default": ToySettings("free", "default", 2e-3), "matched": ToySettings("free", "matched", 1e-3)},
        "chart": {"default": ToySettings("chart", "default", 4e-3)},
    }


def test_everything_announced_is_there() -> None:
    """Each entry point of the package loads: commands, studies, subjects of versions, and all others."""
    announced = distribution("proofroll").entry_points
    assert len(announced) > 25
    for item in announced:
        try:
            item.load()
        except Missing:  # an engine that is not installed says so
            continue


@pytest.mark.parametrize(
    ("text", "name", "options"),
    [
        ("truth", "truth", {}),
        ("mujoco[]", "mujoco", {}),
        (" mujoco [ dt = 1e-4 , formulation=chart, ] ", "mujoco", {"dt": "1e-4", "formulation": "chart"}),
        ("my-engine[label=a=b]", "my-engine", {"label": "a=b"}),
    ],
)
def test_parse_engine(text: str, name: str, options: dict[str, str]) -> None:
    """An engine is a name with settings in brackets, with or without blanks."""
    assert parse_engine(text) == EngineSpec(name, options)


def test_an_engine_is_written_as_it_is_read() -> None:
    """The text of a parsed engine parses to the same again."""
    for text in ("truth", "mujoco[formulation=chart,dt=1e-4]"):
        assert str(parse_engine(text)) == text


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("", "write name"),
        ("mujoco[dt=1e-4", "write name"),
        ("mujoco dt=1e-4", "write name"),
        ("mujoco[dt]", "write key=value instead of 'dt'"),
        ("mujoco[dt=1,dt=2]", "dt is given twice"),
    ],
)
def test_engines_of_another_form(text: str, advice: str) -> None:
    """A text that is no engine gets one line that shows the form."""
    with pytest.raises(InputError, match="engine") as caught:
        parse_engine(text)
    assert advice in str(caught.value)
    assert "\n" not in str(caught.value)


def test_settings_without_options_are_matched() -> None:
    """An engine without brackets takes its first formulation with the preset matched, or the first preset there is."""
    assert resolve_settings(Toy, {}) == ToySettings("free", "matched", 1e-3)
    assert resolve_settings(Toy, {"formulation": "chart"}) == ToySettings("chart", "default", 4e-3)


@pytest.mark.parametrize(("scene", "formulation"), [("pendulum", "null_space"), ("sled", "impulses")])
def test_a_formulation_made_for_other_scenes_is_not_taken_unasked(scene: str, formulation: str) -> None:
    """Without a formulation it is one that is made for such scenes, if there is one, in whatever order they stand."""
    pytest.importorskip("pinocchio")
    from proofroll.engines.pinocchio.adapter import Pinocchio

    assert resolve_settings(Pinocchio, {}, load_scene(scene).requires).formulation == formulation


def test_where_no_formulation_suffices_the_one_that_lacks_least_is_taken() -> None:
    """What a refusal then names is lacking in every formulation."""
    pytest.importorskip("pinocchio")
    from proofroll.engines.pinocchio.adapter import Pinocchio

    assert resolve_settings(Pinocchio, {}, {*load_scene("pendulum").requires, "a tendon"}).formulation == "null_space"


def test_options_go_over_the_preset() -> None:
    """A preset gives what is not given, and text becomes the type of its field."""
    found = resolve_settings(Toy, {"preset": "default", "iterations": "7", "exact": "true"})
    assert found == ToySettings("free", "default", 2e-3, 7, True)


@pytest.mark.parametrize(
    ("options", "field", "words"),
    [
        ({"step": "1"}, "toy: step", ["no such setting", "choose from formulation, preset, dt"]),
        ({"formulation": "cubic"}, "toy: formulation", ["choose one of free, chart"]),
        ({"preset": "best"}, "toy: preset", ["free has default, matched"]),
        ({"formulation": "chart", "preset": "matched"}, "toy: preset", ["chart has default"]),
        ({"dt": "0"}, "toy: dt", ["greater than 0"]),
        ({"dt": "-1e-3"}, "toy: dt", ["greater than 0"]),
        ({"dt": "nan"}, "toy: dt", ["nan"]),
        ({"dt": "inf"}, "toy: dt", ["finite"]),
        ({"dt": "small"}, "toy: dt", ["'small'", "number"]),
        ({"iterations": "2.5"}, "toy: iterations", ["2.5", "whole number"]),
        ({"exact": "perhaps"}, "toy: exact", ["perhaps", "true or false"]),
    ],
    ids=str,
)
def test_bad_settings(options: dict[str, Any], field: str, words: list[str]) -> None:
    """Each bad setting gives one line with engine, setting, value and what to do."""
    with pytest.raises(InputError) as caught:
        resolve_settings(Toy, options)
    assert caught.value.field == field
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)


def test_settings_survive_json(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """Complete settings given again as options give the same settings: that is how a worker gets them."""
    del install_engines
    for presets in Toy.presets.values():
        for settings in presets.values():
            assert resolve_settings(Toy, dataclasses.asdict(settings)) == settings


def test_engines_of_other_packages_are_found(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """An engine that any installed package announces is found beside our own."""
    install_engines({"oracle": "hostile:Oracle"})
    assert {"oracle", "projection"} <= set(engine_names())
    assert load_engine("oracle").name == "oracle"


def test_unknown_engine() -> None:
    """An engine that nobody announces is answered with those that exist."""
    with pytest.raises(
        InputError, match=r"engine = 'adams': there is no such engine; choose one of truth, .*projection"
    ):
        load_engine("adams")


def test_the_truth_is_offered_where_it_may_stand() -> None:
    """Where engines alone may stand the truth is not offered; where it may, too, it is."""
    with pytest.raises(InputError, match=r"choose one of (?!.*truth).*projection"):
        require_engine("adams")
    with pytest.raises(InputError, match=r"choose one of truth, .*projection"):
        require_engine("adams", "truth")


def test_missing_engine_says_what_is_missing(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """An engine whose library is not installed says which, and how to get it."""
    install_engines({"absent": "no_such_module_anywhere:Engine"})
    with pytest.raises(
        Missing, match=r"absent is not installed here \(no_such_module_anywhere is missing\): pip install 'no-such"
    ):
        load_engine("absent")


@pytest.mark.parametrize(
    ("source", "entry", "kind", "words"),
    [
        ("import nupmy", "Engine", Missing, ["imports nupmy (site/mine.py:1 in <module>)", "if it is misspelt"]),
        ("import numpy.linlag", "Engine", ProofrollError, ["numpy is installed, but has no such module"]),
        ("", "Enigne", ProofrollError, ["mine is announced as mine:Enigne", "correct the entry point"]),
        ("Engine = 5", "Engine", ProofrollError, ["mine is announced as mine:Engine, which is no engine", "build"]),
        ("class Engine: name = 'mine'", "Engine", ProofrollError, ["it has no provides, settings, presets, version"]),
    ],
    ids=["module", "submodule", "class", "number", "members"],
)
def test_a_misspelt_name_is_not_a_library_that_is_missing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    source: str,
    entry: str,
    kind: type[ProofrollError],
    words: list[str],
) -> None:
    """A wrong entry point, of a package that has all it requires, gives one line that says what it leads to."""
    info = tmp_path / "site" / "mine-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\nRequires-Dist: numpy\n")
    (info / "entry_points.txt").write_text(f"[proofroll.engines]\nmine = mine:{entry}\n")
    (info.parent / "mine.py").write_text(source)
    monkeypatch.syspath_prepend(str(info.parent))
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    with pytest.raises(kind) as caught:
        load_engine("mine")
    assert type(caught.value) is kind
    for text in words:
        assert text in str(caught.value)


def test_a_path_that_changes_during_the_look_up_does_not_change_what_is_found(
    site_of: Callable[[Mapping[str, str]], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Engines that another thread takes off the path while all are looked up are found all the same."""
    site = str(site_of({"late": "tiny:Tiny"}))
    monkeypatch.syspath_prepend(site)

    def torn(path: list[str]) -> Any:
        sys.path.remove(site)
        found = list(distributions(path=path))
        sys.path.insert(0, site)
        return found

    monkeypatch.setattr("proofroll.core.entry_points.distributions", torn)
    assert "late" in engine_names()


@pytest.mark.parametrize("name", ["exudyn", "mujoco", "pinocchio", "projection", "reduced"])
def test_a_class_whose_build_gives_another_is_an_engine(name: str) -> None:
    """Every engine of this package loads, also where `advance` belongs to what `build` gives."""
    assert load_engine(name).name == name
