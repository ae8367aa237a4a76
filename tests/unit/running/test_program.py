"""Engines that are programs in another language, spoken to through a pipe."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from other_pythons import script

from proofroll.core.certificate import certify, first_difference
from proofroll.core.errors import Diverged, InputError, ProofrollError, Refused
from proofroll.core.plugins import resolve_settings
from proofroll.files.scene_file import load_scene
from proofroll.running.engine_questions import describe
from proofroll.running.idle_workers import Workers
from proofroll.running.process import WorkerDied
from proofroll.running.program import engine

ROD = Path(__file__).resolve().parents[3] / "examples" / "workers" / "rod.pl"
CLAIM = f"""title = "A rod in Perl"
question = "Is a program in another language an engine?"
scene = "pendulum"
until = 2
every = 0.2
timed = false
[tolerances.close]
because = "the classical Runge-Kutta method leaves far less of a turn at this step"
positions = "1e-5 m"
energy_error = "1e-6 J"
[[rows]]
engine = "rod@program:{ROD}"
tolerance = "close"
order = {{ positions = [3.8, 4.2] }}
"""
FORMULATIONS = {"one": {"provides": ["revolute joints"], "order": 1, "presets": {"matched": {"dt": 0.01}}}}
DESCRIBED = json.dumps({"protocol": 1, "name": "rod", "version": "1", "formulations": FORMULATIONS})
STANDS = '{"sample": {"p_WB": [[0, 0, 0]], "v_WB": [[0, 0, 0]], "w_WB": [[0, 0, 0]]}, "built": {"mass": [7]}}'


def answering(folder: Path, build: str, advance: str = "exit 0") -> str:
    """A program of the shell that says this to every request of a kind, as an engine."""
    cases = f"*describe*) echo '{DESCRIBED}';; *build*) {build};; *) {advance};;"
    program = script(folder / "rod", f'while read -r line; do case "$line" in {cases} esac; done')
    return f"rod@program:{program}"


def built(name: str, scene: str = "pendulum", **options: Any) -> Any:
    """The scene in an engine that is a program."""
    kind = engine(name)
    return kind.build(load_scene(scene), resolve_settings(kind, options))


@pytest.mark.nightly
def test_a_program_in_perl_is_judged(proofroll: Callable[..., Any], tmp_path: Path) -> None:
    """The example agrees with the truth, at the order that it declares."""
    claim = tmp_path / "rod.toml"
    claim.write_text(CLAIM, encoding="utf-8")
    code, out, err = proofroll("compare", str(claim), "--out", str(tmp_path / "out"), "--json")
    assert code == 0, err
    (row,) = json.loads(out)["rows"]
    assert (row["verdict"], row["declared_order"]) == ("agrees", 4)


def test_a_program_refuses_what_it_cannot_represent() -> None:
    """Its own reason is the refusal, and no time between its steps is asked for."""
    with pytest.raises(Refused, match="more than one body"):
        built(f"rod@program:{ROD}", "double_pendulum")
    with pytest.raises(InputError, match="choose a step that divides the interval"):
        built(f"rod@program:{ROD}", dt=0.003).advance(0.05)


@pytest.mark.parametrize(
    ("advance", "error", "says"),
    [
        ("exit 3", ProofrollError, r"rod ended \(3\) instead of answering advance"),
        ("echo hello", ProofrollError, "rod answered advance with 'hello', which is no JSON object"),
        ("""echo '{"diverged": "gave up"}'""", Diverged, "gave up"),
    ],
)
def test_what_a_program_answers_is_told(tmp_path: Path, advance: str, error: type[ProofrollError], says: str) -> None:
    """Whatever a program answers, the error says what it was."""
    with pytest.raises(error, match=says):
        built(answering(tmp_path, f"echo '{STANDS}'", advance)).advance(0.01)


def test_what_a_program_built_is_certified(tmp_path: Path) -> None:
    """A wrong model is found before it is run; no sample at all is an error."""
    wrong = built(answering(tmp_path, f"echo '{STANDS}'"))
    assert "mass is 7 instead of 1 kg" in str(first_difference(certify(wrong, load_scene("pendulum"))))
    (tmp_path / "other").mkdir()
    with pytest.raises(ProofrollError, match="rod gave no sample with p_WB"):
        built(answering(tmp_path / "other", """echo '{"sample": {"p_WB": [[0, 0, 0]]}}'"""))


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        (None, InputError, "is no program"),
        ("exit 0", ProofrollError, r"ended \(0\) instead of answering describe"),
        ("cat", ProofrollError, "does not say its name"),
        ("""read x; echo '{"protocol": 2, "name": "rod"}'""", ProofrollError, "speaks protocol 2, and this"),
        ("""read x; echo '{"protocol": 1, "name": "bar"}'""", InputError, "is bar; write bar@program:"),
        ("""read x; echo '{"protocol": 1, "name": "rod", "version": "1"}'""", ProofrollError, "does not describe"),
    ],
)
def test_a_program_that_is_no_engine_says_so(
    tmp_path: Path, text: str | None, error: type[ProofrollError], says: str
) -> None:
    """One line for each way not to be one."""
    program = tmp_path / "rod" if text is None else script(tmp_path / "rod", text)
    with pytest.raises(error, match=says):
        engine(f"rod@program:{program}")


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"dt": 0}, "dt = 0: give a positive number"),
        ({"dt": "x"}, 'dt = "x": give a positive number'),
        ({"rtol": None}, "rtol = null: give a number"),
        ({"dt": 1e-3, "law": [1]}, "law = \\[1\\]: give a number, a text, true or false"),
    ],
)
def test_a_preset_that_no_run_could_take(tmp_path: Path, values: dict[str, Any], says: str) -> None:
    """A preset with a step that is none is told in a line that names the program, the preset and the value."""
    formulations = {"one": {"provides": [], "order": 1, "presets": {"matched": values}}}
    described = json.dumps({"protocol": 1, "name": "rod", "version": "1", "formulations": formulations})
    program = script(tmp_path / "rod", f"read -r line; echo '{described}'")
    with pytest.raises(ProofrollError, match=f"rod: preset matched of one: {says}"):
        engine(f"rod@program:{program}")


def test_what_a_program_started_costs_nothing(tmp_path: Path) -> None:
    """A helper that a program started, and that holds its pipe, is not waited for and ends with the program."""
    note = tmp_path / "helper"
    helper = f"sleep 300 & echo $! >{note}; "
    name = answering(tmp_path, f'{helper} echo \'{{"refused": "too heavy"}}\'')
    began = time.monotonic()
    with pytest.raises(Refused, match="too heavy"):
        built(name)
    assert time.monotonic() - began < 60
    status = Path(f"/proc/{note.read_text().strip()}/stat")
    while (alive := status.exists() and status.read_text().split()[2] not in "ZX") and time.monotonic() < began + 60:
        time.sleep(0.05)  # the system takes a moment to end it
    assert not alive


def test_a_program_that_does_not_answer_is_asked_once(tmp_path: Path) -> None:
    """An engine that once gave no answer within the user's limit is not waited for again, and is told by its name."""
    program = script(tmp_path / "rod", f"echo begun >>{tmp_path}/begun; sleep 300")
    workers = Workers(patience=1.0)
    for _ in range(2):
        with pytest.raises(WorkerDied, match=r"rod@program:.*: no result within 1 s; it was ended"):
            describe(f"rod@program:{program}", workers)
    workers.close()
    begun = tmp_path / "begun"
    assert not begun.exists() or begun.read_text().split() == ["begun"]


@pytest.mark.nightly
@pytest.mark.nightly_of("recommend")
@pytest.mark.parametrize(
    "command", ["run", *(pytest.param(name, marks=pytest.mark.drill) for name in ("compare", "recommend"))]
)
def test_a_program_that_is_waited_for(
    command: str, command_line: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A command says now and then that it waits for a program to start."""
    program = script(tmp_path / "rod", "read -r line; sleep 0.7; exit 1")
    monkeypatch.setattr("proofroll.cli.options._SAID_EVERY", 0.1)
    row = f'[[rows]]\nengine = "rod@program:{program}"\nexpect = "agrees"\ntolerance = "any"\n'
    bands = '[tolerances.any]\nbecause = "none is needed"\npositions = "1 %"\n'
    claim = tmp_path / "claim.toml"
    claim.write_text(f'title = "a"\nquestion = "a?"\nscene = "pendulum"\nuntil = 0.1\nevery = 0.1\n{bands}{row}')
    asked = str(claim) if command == "compare" else "pendulum"
    out = [] if command == "run" else ["--out", str(tmp_path / "out")]
    code, _, err = command_line(command, asked, "--engine", f"rod@program:{program}", *out)
    assert code == 3
    assert re.search(rf"waiting for .*rod@program:{program}.* to start", err)
