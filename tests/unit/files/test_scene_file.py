from __future__ import annotations

import contextlib
import math
import os
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, cast

import pytest

from proofroll.core.errors import InputError
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene
from proofroll.files import scene_file
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene, read_scene_file, scene_names
from proofroll.files.toml import read_toml
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.kind import BallOnSurfaceKind

CYLINDER = "sphere_in_cylinder"


@pytest.fixture
def edited(tmp_path: Path) -> Callable[[str, str], str]:
    """A copy of the sphere's scene with one text replaced; its folder."""

    def edit(old: str, new: str) -> str:
        shutil.copytree(data_folder("models") / CYLINDER, tmp_path, dirs_exist_ok=True)
        text = (tmp_path / "scene.toml").read_text(encoding="utf-8")
        assert old in text
        (tmp_path / "scene.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
        return str(tmp_path)

    return edit


def problem(name: str, **parameters: Any) -> InputError:
    """The error of loading a scene, after a look at its form."""
    with pytest.raises(InputError) as caught:
        load_scene(name, **parameters)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith((f"{caught.value.field} = ", f"{caught.value.field} is missing: "))
    return caught.value


def test_all_keys_that_are_missing_are_told_at_once(tmp_path: Path) -> None:
    """A file without several required keys is answered by all of them, not by one after another."""
    text = 'title = "A body"\n[parameters.mass]\nvalue = 1.0\nunit = "kg"\n[[bodies]]\nname = "b"\nmass = "$mass"\n'
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    error = problem(str(tmp_path))
    assert str(error).endswith(
        "source is missing: this key is required; add it, gravity, parameters.mass.meaning, parameters.mass.source"
    )


def test_both_scenes_are_there() -> None:
    """The scenes are found by name."""
    assert scene_names() == sorted(scene_names())
    assert {CYLINDER, "inclined_plane"} <= set(scene_names())


@pytest.mark.parametrize("name", scene_names())
def test_every_parameter_has_unit_meaning_and_source(name: str) -> None:
    """No number of a scene is without unit, meaning and source; each has a symbol of its own, or its name for one."""
    parameters = read_scene_file(name).parameters
    assert all(item.unit and item.meaning and item.source for item in parameters.values())
    symbols = [item.symbol or key for key, item in parameters.items()]
    assert len(set(symbols)) == len(symbols)


@pytest.mark.one_in(4)
@pytest.mark.parametrize("name", scene_names())
def test_every_parameter_reaches_the_mechanics(name: str) -> None:
    """Changing any parameter changes the scene: none is decoration."""
    file, as_it_is = read_scene_file(name), cache(lambda **needed: load_scene(name, **needed).digest)
    for key, item in file.parameters.items():
        known = 1.0 if isinstance(item.value, str) or math.isinf(item.value) else item.value
        needed = {"mu_static": 0.5} if key == "mu_kinetic" else {}
        assert _changed(name, key, known, needed).digest != as_it_is(**needed), key


def _changed(name: str, key: str, value: float, needed: dict[str, float]) -> Scene:
    """The scene with another value of one parameter: the first that it allows."""
    for other in (0.3 * value + 1e-3, 0.9 * value, 1.01 * value + 1e-3, value - 1.0):
        with contextlib.suppress(InputError):
            return load_scene(name, **needed, **{key: other})
    raise AssertionError(f"{name}: no other value of {key} is allowed")


@pytest.mark.parametrize(
    ("parameters", "field", "advice"),
    [
        ({"wheels": 4}, "wheels", "no such parameter; choose from radius"),
        ({"radius": 0.225}, "radius", "must be below cylinder_radius = 0.225"),
        ({"radius": 0.3}, "radius", "must be below cylinder_radius = 0.225"),
        ({"cylinder_radius": 0.02}, "radius", "must be below cylinder_radius = 0.02"),
        ({"radius": 0.0}, "radius", "must be above 0"),
        ({"radius": -0.01}, "radius", "must be above 0"),
        ({"cylinder_radius": -1}, "cylinder_radius", "must be above 0"),
        ({"mass": 0}, "mass", "must be above 0"),
        ({"mass": -0.517}, "mass", "must be above 0"),
        ({"gravity": -9.81}, "gravity", "must be at least 0"),
        ({"rolling_resistance": -1e-9}, "rolling_resistance", "must be at least 0"),
        ({"mu_static": -0.1}, "mu_static", "must be at least 0"),
        ({"mu_static": 0.3, "mu_kinetic": 0.4}, "mu_kinetic", "must be at most mu_static = 0.3"),
        ({"mass": math.nan}, "mass", "finite"),
        ({"mu_static": math.nan}, "mu_static", "finite"),
        ({"speed": math.inf}, "speed", "finite"),
        ({"mu_static": -math.inf}, "mu_static", "finite"),
        ({"speed": "fast"}, "speed", "not a number; give one in m/s"),
        ({"speed": ""}, "speed", "not a number"),
        ({"speed": None}, "speed", "not a number"),
        ({"speed": True}, "speed", "not a number"),
        ({"speed": [4]}, "speed", "not a number"),
        ({"speed": 10**400}, "speed", "not a number"),
        ({"speed": "1_0"}, "speed", "not a number"),
        ({"speed": 1e101}, "speed", "its cube overflows"),
        ({"mu_kinetic": "mu_static"}, "mu_kinetic", "not a number"),
        ({"speed": 0}, "speed", "nothing to roll on"),
        ({"speed": "-0.0"}, "speed", "nothing to roll on"),
    ],
    ids=str,
)
def test_bad_parameters(parameters: dict[str, Any], field: str, advice: str) -> None:
    """Each bad value gives one line with its field, the value and what to do."""
    error = problem(CYLINDER, **parameters)
    assert error.field == field
    assert advice in error.advice


def test_a_number_whose_square_overflows_is_refused() -> None:
    """A radius whose square is beyond double precision is wrong input, not a traceback."""
    with pytest.raises(InputError, match="its cube overflows; give a smaller one"):
        load_scene("cone", radius=1e300)


def test_the_value_that_was_given_is_blamed() -> None:
    """A huge value is shown, and shown briefly."""
    error = problem(CYLINDER, speed="x" * 500)
    assert "xxxxx" in str(error)
    assert len(str(error)) < 200


def test_text_that_is_a_number_is_a_number() -> None:
    """The command line gives text, which counts as the number it says."""
    assert load_scene(CYLINDER, speed="3.3", mu_static="inf").digest == load_scene(CYLINDER, speed=3.3).digest  # type: ignore[arg-type]


def test_numbers_in_other_units(edited: Callable[[str, str], str]) -> None:
    """A parameter, its bounds and its value on the command line may have another unit of the same kind."""
    text = '[parameters.lean]\nvalue = "30 deg"\nat_most = "45 deg"\nunit = "rad"\nmeaning = "lean"\nsource = "test"\n'
    folder = edited("[gravity]", text + "[gravity]")
    assert load_scene(folder).parameters["lean"] == pytest.approx(math.pi / 6)
    assert load_scene(folder, lean=cast("Any", "40 deg")).parameters["lean"] == pytest.approx(math.pi * 2 / 9)
    assert "must be at most" in problem(folder, lean="50 deg").advice
    assert "in m, and not in deg" in problem(folder, radius="1 deg").advice
    assert load_scene(folder, radius=cast("Any", "59 mm")).parameters["radius"] == 0.059
    assert "in m, and not in ms" in problem(folder, radius="1 ms").advice
    assert "not a number" in problem(folder, radius="1 furlong").advice


def test_kinetic_friction_follows_static_friction() -> None:
    """mu_kinetic is mu_static unless it is given."""
    assert rolling_ball(load_scene(CYLINDER, mu_static=0.35)).contact.mu_kinetic == 0.35
    assert rolling_ball(load_scene(CYLINDER, mu_static=0.35, mu_kinetic=0.2)).contact.mu_kinetic == 0.2
    assert rolling_ball(load_scene(CYLINDER)).contact.mu_kinetic == math.inf


@pytest.mark.parametrize("name", ["no_such_scene", "", "/", "..", "a" * 1000])
def test_unknown_scene(name: str) -> None:
    """An unknown scene is answered with some of those that exist."""
    error = problem(name)
    assert error.field == "scene"
    assert "andrews_squeezer, arm_pd" in error.advice


def test_a_scene_outside_models(edited: Callable[[str, str], str]) -> None:
    """A scene may lie in any folder."""
    scene = load_scene(edited("value = 4.0", "value = 5.0"))
    assert rolling_ball(scene).v0 == pytest.approx([0, 5, 0])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[gravity]", "[gravity", ["broken", "line"]),
        ("[gravity]", "[gravity]\nmagnitud = 3", ["magnitud", "no such key"]),
        ("title =", "titel =", ["titel", "no such key"]),
        ("[gravity]", "[gravitation]", ["gravitation", "no such key", "gravity"]),
        ('kind = "cylinder"', 'kind = "nowhere"', ["surfaces", "cylinder", "plane"]),
        ('kind = "cylinder"', "", ["surfaces.0.kind is missing"]),
        ('radius = "$radius"', 'radius = "wide"', ["balls.0.radius", "'wide'", "number"]),
        ('radius = "$radius"', "", ["balls.0.radius", "required"]),
        ("velocity = [", "velocity = [1, ", ["initial.0.velocity"]),
        ("value = 0.517", "", ["parameters.mass.value", "required"]),
        ("value = 0.517", 'valu = 0.517\nvalue = "x"', ["parameters.mass.valu", "no such key"]),
        ('mass = "$mass"', "mass = -1", ["balls.0.mass = -1", "above 0"]),
        ('mass = "$mass"', "mass = inf", ["balls.0.mass = inf", "finite"]),
        ('mass = "$mass"', "mass = nan", ["balls.0.mass = nan", "finite"]),
        ('mass = "$mass"', "mass = 1e101", ["balls.0.mass = 1e+101", "its cube overflows"]),
        ('mass = "$mass"', 'mass = "= mass*1e101"', ["balls.0.mass", "its cube overflows"]),
        ("direction = [0, 0, -1]", "direction = [1e308, 0, -1]", ["gravity.direction.0 = 1e+308", "overflows"]),
        ('name = "ball"', 'name = "the.ball"', ["balls.0.name = 'the.ball'", "no dot and no slash"]),
        ('name = "ball"', 'name = "../../x"', ["balls.0.name = '../../x'", "no dot and no slash"]),
        ("[parameters.mass]", f"[parameters.{'m' * 201}]", ["parameters = 'mmm", "at most 200 printable characters"]),
        ('title = "', 'duration = 1e308\ntitle = "', ["duration = 1e+308", "at most 1e+09 s"]),
        ('mass = "$mass"', "mass = true", ["balls.0.mass = True", "give one in kg"]),
        ('radius = "$radius"', "radius = 0", ["balls.0.radius = 0", "above 0"]),
        ('radius = "$radius"', "radius = 0.3", ["radius = 0.3", "smaller than wall with 0.225 m"]),
        ('mass = "$mass"', 'mass = "$mass"\ninertia_ratio = -0.4', ["balls.0.inertia_ratio = -0.4", "above 0"]),
        ('radius = "$cylinder_radius"', "radius = -0.2", ["surfaces.0.radius = -0.2", "above 0"]),
        ('radius = "$cylinder_radius"', "radius = 1\ntilt = nan", ["surfaces.0.tilt = nan", "finite"]),
        ('magnitude = "$gravity"', "magnitude = -9.81", ["gravity.magnitude = -9.81", "at least 0"]),
        ("direction = [0, 0, -1]", "direction = [0, 0, 0]", ["gravity.length of direction = 0", "above 0"]),
        ("direction = [0, 0, -1]", "direction = [0, nan, -1]", ["gravity.direction = nan", "finite"]),
        ('mu_static = "$mu_static"', "mu_static = -1", ["contacts.0.mu_static = -1", "at least 0"]),
        ('mu_static = "$mu_static"', "mu_static = nan", ["contacts.0.mu_static = nan", "number"]),
        ('mu_static = "$mu_static"', "mu_static = 0.3", ["contacts.0.mu_kinetic = inf", "at most mu_static = 0.3"]),
        ('rolling_resistance = "$rolling_resistance"', "rolling_resistance = -1", ["contacts.0.rolling", "at least 0"]),
        ("coordinates = [0, 0]", "coordinates = [0, inf]", ["initial.0.coordinates = inf", "finite"]),
        ('spin = "$radial_spin"', "spin = nan", ["initial.0.spin = nan", "finite"]),
        (
            'value = 0.025\nunit = "m"',
            'value = 25\nunit = "mm"',
            ["parameters.radius.unit = 'mm'", "write the value in"],
        ),
        ('mass = "$mass"', 'mass = "$radius"', ["balls.0.mass = '$radius'", "in kg, that parameter in m"]),
        ('velocity = ["$speed"', 'velocity = ["$gravity"', ["initial.0.velocity.0", "in m/s, that parameter in m/s^2"]),
        ("coordinates = [0", 'coordinates = ["$radius"', ["initial.0.coordinates.0", "in rad, that parameter in m"]),
        ('below = "cylinder_radius"', 'below = "mass"', ["parameters.radius.below = 'mass'", "its unit is kg"]),
        ("value = inf", 'value = "mu_kinetic"', ["mu_static.value", "mu_static -> mu_kinetic -> mu_static", "circle"]),
        ('title = "', f'a = {"[" * 5000}\ntitle = "', ["nested more than 16 deep"]),
        ("[gravity]", f"[gravity.{'.'.join('d' * 5000)}]\n[gravity]", ["nested more than 16 deep"]),
        ("value = 0.517", f"value = {'9' * 5000}", ["broken"]),
        (
            'value = "mu_static"',
            'value = "$mu_static"',
            ["mu_kinetic.value = '$mu_static'", "by its name alone, without $"],
        ),
        ('mass = "$mass"', "mass = 5e-324", ["balls.0.inertia = 0.0", "above 0"]),
        ("value = 0.517", "value = true", ["parameters.mass.value = True", "not a number"]),
        ("value = 0.517", "value = -1", ["parameters.mass.value = -1", "must be above 0 kg"]),
        ("value = 0.517", "value = [1]", ["parameters.mass.value = [1]", "give a number"]),
        ("[parameters.mass]", "[parameters]\nwheels = 4\n[parameters.mass]", ["parameters.wheels = 4", "give a table"]),
        ('title = "', 'duration = inf\ntitle = "', ["duration = inf", "positive, finite time in s"]),
        ('title = "', 'duration = 0\ntitle = "', ["duration = 0", "positive, finite time in s"]),
        ('title = "', 'duration = true\ntitle = "', ["duration = True", "not a number"]),
        ('title = "', 'asks = ["colour"]\ntitle = "', ["asks = 'colour'", "choose orientation"]),
        (
            'title = "',
            'wheels = 4\ntitle = "',
            ["wheels = 4", "no such key", "duration, every, files, gravity", "balls, surfaces"],
        ),
        ("direction = [0, 0, -1]", "direction = [0, 1]", ["gravity.direction = [0, 1]", "list is too short"]),
        ("direction = [0, 0, -1]", "direction = [0, 0, 0, 1]", ["[0, 0, 0, 1]: the list should have at most 3 items"]),
        ('mass = "$mass"', 'mass = "= mass.real"', ["mass = ' mass.real': is no arithmetic; use numbers, + - * / ^"]),
    ],
)
def test_broken_scene_files(edited: Callable[[str, str], str], old: str, new: str, words: list[str]) -> None:
    """A broken file gives one line with the file, the key and what to do."""
    folder = edited(old, new)
    text = str(problem(folder))
    assert folder in text
    for word in words:
        assert word in text


@pytest.mark.parametrize(
    ("old", "new", "name"),
    [
        ('radius = "$radius"', 'radius = "$raduis"', "raduis"),
        ('below = "cylinder_radius"', 'below = "cylinder_raduis"', "cylinder_raduis"),
        ('value = "mu_static"', 'value = "mu_statik"', "mu_statik"),
        ('body = "ball"', 'body = "bowl"', "bowl"),
        ('surface = "wall"', 'surface = "hall"', "hall"),
    ],
)
def test_names_that_a_scene_file_does_not_define(
    edited: Callable[[str, str], str], old: str, new: str, name: str
) -> None:
    """A name that leads nowhere gives one line that shows it."""
    assert name in str(problem(edited(old, new)))


def test_too_many_parameters(edited: Callable[[str, str], str]) -> None:
    """A file with 100,000 parameters is refused by its size, before it is read."""
    item = '={value=1,unit="m",meaning="x",source="x"}'
    many = "[parameters]\n" + "\n".join(f"p{i}{item}" for i in range(100_000))
    assert "larger than 256 kB" in str(problem(edited("[gravity]", many + "\n[gravity]")))


def test_of_many_names_some_are_shown(edited: Callable[[str, str], str]) -> None:
    """Advice names some of many parameters, not all."""
    item = '={value=1,unit="m",meaning="x",source="x"}'
    many = "\n".join(f"parameters.p{i}{item}" for i in range(1000))
    assert len(str(problem(edited('title = "', f'{many}\ntitle = "'), wheels=4))) < 400


def test_defaults_that_follow_one_another(edited: Callable[[str, str], str]) -> None:
    """A default may name a parameter that is defined later and itself follows another."""
    first = '[parameters.first]\nvalue = "mu_kinetic"\nunit = "1"\nunbounded = true\n'
    first += 'meaning = "x"\nsource = "x"\n'
    folder = edited("[parameters.radius]", f"{first}[parameters.radius]")
    assert load_scene(folder, mu_static=0.3).parameters["first"] == 0.3
    assert load_scene(folder, mu_static=0.3, mu_kinetic=0.2).parameters["first"] == 0.2
    assert load_scene(folder).parameters["first"] == math.inf


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    """A named pipe in the place of a file is refused at once."""
    os.mkfifo(tmp_path / "pipe.toml")
    with pytest.raises(InputError, match="no ordinary file"):
        read_toml(tmp_path / "pipe.toml")


def test_not_text(tmp_path: Path) -> None:
    """A file that is not UTF-8 is broken, not a traceback."""
    (tmp_path / "scene.toml").write_bytes(b"\xff\xfe\x00title")
    assert "broken" in str(problem(str(tmp_path)))


def test_a_scene_file_that_asks(edited: Callable[[str, str], str]) -> None:
    """What the file asks for is required, together with what the caller asks for, and once."""
    folder = edited('title = "', 'asks = ["orientation"]\ntitle = "')
    for asks in ((), ("orientation",)):
        assert load_scene(folder, asks=asks).asks == ("orientation",)


def test_a_key_of_any_length_is_one_short_line(edited: Callable[[str, str], str]) -> None:
    """The line about a wrong key is short, however long the key."""
    text = str(problem(edited("[gravity]", f"{'a' * 5000} = 1\n[gravity]")))
    assert len(text) < 1000
    assert text.index("aaa") < text.index("there is no such key")


@pytest.mark.parametrize(
    ("old", "new", "keys"),
    [
        ("mass = ", "weight = 1\nmass = ", "name, radius, mass"),
        ('kind = "plane"', 'kind = "plane"\nangle = 0.3', "name, tilt"),
        ("magnitude = ", "size = 1\nmagnitude = ", "magnitude, direction"),
    ],
)
def test_an_unknown_key_is_told_the_known_ones(tmp_path: Path, old: str, new: str, keys: str) -> None:
    """Whoever misspells a key reads which there are, of that table and that kind of wall."""
    folder = tmp_path / "mine"
    shutil.copytree(data_folder("models") / "inclined_plane", folder)
    text = (folder / "scene.toml").read_text(encoding="utf-8")
    (folder / "scene.toml").write_text(text.replace(f"\n{old}", f"\n{new}", 1), encoding="utf-8")
    with pytest.raises(InputError, match=f"there is no such key here; the keys are {keys}"):
        load_scene(str(folder))


class BlockKind:
    """Blocks on floors, a kind of element that has [[contacts]] as balls have them."""

    name: ClassVar[str] = "block"
    tables: ClassVar[tuple[str, ...]] = ("blocks", "contacts")
    units: ClassVar[dict[str, str]] = {}

    @staticmethod
    def read(tables: Any, *_: object) -> list[Any]:
        """What it was given."""
        return [SimpleNamespace(kind="block", tables=tables)]


def test_two_kinds_have_rows_of_one_table(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each row of [[contacts]] goes to the kind of the thing that it names, and one that names none is refused."""
    monkeypatch.setattr(scene_file, "load_element_kinds", lambda: [BallOnSurfaceKind, BlockKind])
    ball, block = {"body": "ball", "surface": "wall"}, {"of": ["crate", "floor"], "friction": 0.5}
    tables: dict[str, Any] = {
        "blocks": [{"name": "crate"}],
        "balls": [{"name": "ball", "radius": 0.025, "mass": 0.5}],
        "surfaces": [{"kind": "plane", "name": "wall", "tilt": 0.35}],
        "initial": [{"body": "ball", "velocity": [0.5, 0.2]}],
        "contacts": [block, ball],
    }
    given = tables, Gravity(9.81, (0.0, 0.0, -1.0)), Parameters({}, {}), "scene.toml"
    rolling, other = cast(Any, scene_file._elements(*given))
    assert rolling.mechanism.pairs[0].geometries == ("ball", "wall")
    assert other.tables == {"blocks": [{"name": "crate"}], "contacts": [block]}
    tables["contacts"].append({"of": ["another"]})
    with pytest.raises(InputError, match=r"scene.toml: contacts.2 = .*name a table that only one of them has"):
        scene_file._elements(*given)
    tables["contacts"] = ball
    with pytest.raises(InputError, match=r"scene.toml: contacts = .*\[\[contacts\]\]"):
        scene_file._elements(*given)
