"""Random scenes of mechanisms: valid, repeatable, and with everything that a scene file may have."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.scene_file import load_scene
from proofroll.vocabulary.document import CHAPTERS
from proofroll_fuzz.drawing import Choices, drawn_scene
from proofroll_fuzz.mechanisms.families import FAMILIES
from proofroll_fuzz.relations import write_scene

SEEDS = range(10)
# Feature of a scene of contact -> capability that it asks for; an engine without it has the scene told as unfit.
SHAPES = {
    "sphere": MechanismCapability.SPHERES,
    "ellipsoid": MechanismCapability.ELLIPSOIDS,
    "box": MechanismCapability.BOXES,
    "capsule": MechanismCapability.CAPSULES,
    "cylinder": MechanismCapability.CYLINDERS,
    "bore": MechanismCapability.BORES,
    "shaft": MechanismCapability.SHAFTS,
    "bowl": MechanismCapability.BOWLS,
}
# Capability that no family has as a feature -> how it is drawn, or why not.
WITHOUT_FEATURE: Mapping[str, str] = {
    MechanismCapability.CONTACT: "every scene of contact has it",
    MechanismCapability.MASSLESS: "not drawn: every drawn body has mass and moments",
    MechanismCapability.REDUNDANT: "planar loops have it; an analysis of the scene finds it, not its keys",
    MechanismCapability.ORIENTATION: "asked for; no part of a scene",
    MechanismCapability.COUPLINGS_OF_MANY: "not drawn: its rows are those of a coupling of two",
    MechanismCapability.PLANES: "the ground of most scenes of contact",
    MechanismCapability.VERTICES: "not drawn: a box has eight",
    MechanismCapability.DISCS: "not drawn: a cylinder has two rims",
    MechanismCapability.CONES: "not drawn: tables and bowls are their limits",
    MechanismCapability.TORI: "not drawn: a shaft is the limit",
    MechanismCapability.SHARED_CONE: "not drawn: the truth does not follow it",
    MechanismCapability.DECLARED_WALLS: "not drawn: code of a package, no table",
    **{name: f"drawn as the feature {shape}" for shape, name in SHAPES.items()},
}
# Keys of the vocabulary that are not drawn, as table.key -> reason.
NOT_DRAWN: Mapping[str, str] = {
    "bushings.position_b": "position_a places a bushing",
    "bushings.orientation_b": "orientation_a turns a bushing",
    "couplings.joints": "see couplings of three or more joints",
    "couplings.coefficients": "see couplings of three or more joints",
    "couplings.offset": "coupled joints start at zero",
    "forces.reaction": "an opposite force of equal size adds no term",
    "geometries.orientation": "bodies are turned, not their shapes in them",
    "geometries.slope": "cones are not drawn",
    "geometries.ring_radius": "tori are not drawn",
    "loops.at_most": "cables are not drawn",
    "loops.restitution": "cables are not drawn",
    "pairs.cone": "the truth does not follow a shared one",
    "pairs.static_friction": "friction as a table says it",
    "points.name": "points are only reported",
    "points.body": "points are only reported",
    "points.position": "points are only reported",
}


def read(folder: Path, tables: Mapping[str, Any]) -> Scene:
    """Scene that the reader makes of some tables."""
    write_scene(folder, tables)
    return load_scene(str(folder))


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("family", FAMILIES)
def test_every_scene_is_valid(family: str, tmp_path: Path) -> None:
    """The reader accepts every scene, and it has the capability of each feature that it was drawn with."""
    for seed in SEEDS:
        drawn = drawn_scene({family: FAMILIES[family]}, seed)
        scene = read(tmp_path / str(seed), drawn.tables)
        assert 0 < drawn.tables["dt"] < drawn.tables["every"] < drawn.tables["duration"]
        assert scene.requires, drawn.features


@pytest.mark.nightly
@pytest.mark.parametrize("family", FAMILIES)
def test_hundreds_of_scenes_are_valid(family: str, tmp_path: Path) -> None:
    """As above, of as many seeds as cover each pair of features."""
    for seed in range(len(SEEDS), 300):
        assert read(tmp_path / "scene", drawn_scene({family: FAMILIES[family]}, seed).tables).requires


@pytest.mark.parametrize("family", FAMILIES)
def test_a_seed_decides_the_scene(family: str) -> None:
    """The same seed makes the same tables, another one makes others."""
    families = {family: FAMILIES[family]}
    scenes = [drawn_scene(families, seed).tables for seed in SEEDS]
    assert scenes == [drawn_scene(families, seed).tables for seed in SEEDS]
    assert all(one != two for one, two in pairwise(scenes))


@pytest.mark.drill
def test_each_capability_is_drawn_or_excused(tmp_path: Path) -> None:
    """A scene asked for a capability needs it from an engine; those that none is asked for have a reason."""
    features = {name: family for family, item in FAMILIES.items() for name in item.features}
    assert {str(item) for item in MechanismCapability} == {*features, *WITHOUT_FEATURE} & {*MechanismCapability}
    assert not features.keys() & WITHOUT_FEATURE.keys()
    for number, capability in enumerate(set(MechanismCapability) & features.keys()):
        tables = FAMILIES[features[capability]].draw(Choices(0), [capability])
        assert capability in read(tmp_path / str(number), tables).requires, capability


@pytest.mark.parametrize("shape", SHAPES)
def test_a_shape_is_asked_of_an_engine(shape: str, tmp_path: Path) -> None:
    """A scene drawn with a shape needs the capability of that shape."""
    tables = FAMILIES["contact"].draw(Choices(0), [shape])
    assert SHAPES[shape] in read(tmp_path / shape, tables).requires


@pytest.mark.drill
def test_each_key_is_drawn_or_excused() -> None:
    """Every key of the vocabulary is in some scene, or has a reason why not; no reason is stale."""
    vocabulary = {
        f"{table.header.strip('[]')}.{item.name}"
        for table in CHAPTERS["A scene with a mechanism"]
        for item in dataclasses.fields(table.read_by)
    }
    drawn = {
        f"{table}.{key}"
        for seed in range(400)
        for table, rows in drawn_scene(FAMILIES, seed).tables.items()
        for row in (rows if isinstance(rows, list) else [])
        for key in row
    }
    assert vocabulary - drawn == NOT_DRAWN.keys()


@pytest.mark.drill
def test_pairs_of_features_are_drawn_evenly() -> None:
    """Consecutive seeds of a family ask for every pair of its features before any pair comes again."""
    family = FAMILIES["contact"]
    pairs = [drawn_scene({"contact": family}, seed).features[:2] for seed in range(len(family.pairs))]
    assert len(set(pairs)) == len(family.pairs) == len(family.features) * (len(family.features) - 1) / 2


def test_a_family_keeps_to_what_an_engine_provides() -> None:
    """Without a capability no scene asks for it; features that are no capabilities stay."""
    contact = FAMILIES["contact"].within({MechanismCapability.CONTACT})
    assert not contact.features.keys() & set(MechanismCapability)
    assert "sphere" in contact.features
