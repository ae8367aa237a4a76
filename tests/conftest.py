"""Fixtures that several kinds of tests share."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import dear
import found
import numpy as np
import pytest
import seldom
from ball_scenes import scene  # noqa: F401 -- a fixture, which pytest finds here
from forked_workers import Forks
from hostile import ENTRY_POINTS
from hypothesis import HealthCheck, Phase, settings
from known_truths import KnownTruths
from no_skips import pytest_make_collect_report, pytest_runtest_makereport  # noqa: F401 -- hooks, which pytest finds here
from source_code import nodes
from warm_workers import WarmWorkers
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

from proofroll import cli
from proofroll.files.scene_file import load_scene
from proofroll.running import idle_workers
from proofroll.running.case import Case, EngineFacts

PLUGINS = Path(__file__).parent / "plugins"
_METADATA = "Metadata-Version: 2.1\nName: throwaway\nVersion: 1.0\nRequires-Dist: no-such-library>=2\n"

# The same examples on every machine: a red test stays red when it is run again. It ends with the first example that
# fails: to look for the smallest one takes hundreds of runs, minutes where each is a simulation, and is left to who
# asks for it (--hypothesis-profile=shrinking).
settings.register_profile(
    "shrinking",
    derandomize=True,
    deadline=None,
    max_examples=5,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.register_profile(
    "repeatable",
    settings.get_profile("shrinking"),
    phases=[phase for phase in Phase if phase not in {Phase.shrink, Phase.explain}],
)
settings.load_profile("repeatable")

# Each measurement of speed is a real one, but short [s]: no test asks how exact it is.
idle_workers.SECONDS = 0.002

# Each core has a pytest process (``make test``): more worker processes at once would be more to start, and no faster.
os.cpu_count = lambda: 1

# Tests of Ctrl-C mean nothing where SIGINT was ignored when pytest began (nohup, a shell's "&"); children inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# Modules and tests leave nothing to collect: to look for it would take a quarter of the collection of tests.
gc.disable()


def pytest_configure(config: pytest.Config) -> None:
    """Registers hooks that fixtures of a whole session call, too, which they do not in this file."""
    config.pluginmanager.register(dear, "dear")
    config.pluginmanager.register(found, "found")
    for name, room in seldom.ROOMS.items():
        config.addinivalue_line("markers", f"drill_of_{name}: a drill of {', '.join(room.tests)}, which set it")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Marks what is nightly as drills before a mark chooses; truths come first.

    The files of truths are the longest, and begun last would leave one process without work.
    """
    dear.mark_drills(config, items)
    items.sort(key=lambda item: not item.nodeid.startswith("tests/unit/truth/"))


def pytest_collection_finish() -> None:
    """From here on what tests leave is collected, and what was imported is not looked at again.

    One of several processes imports here what nearly all its tests need: it is no time of the first of them.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        for name in ("exudyn", "heyoka", "mujoco", "pinocchio", "xarray"):
            with suppress(ImportError):
                import_module(name)
    gc.freeze()
    gc.enable()


class _TogetherWhatShares(LoadScopeScheduling):
    """One process runs the tests of a file: fixtures of a module are made once, and workers are warm."""

    def _split_scope(self, nodeid: str) -> str:
        path = nodeid.partition("::")[0]
        folder = path.split("/")[1]
        # A browser and pages are shared by a whole folder, truths by the rows of a comparison and by the engines that
        # are held against them; the many other checks of conformance share nothing dear.
        check = nodeid.rpartition("-")[2] if "moves_as_the_truth" in nodeid else nodeid
        # Files directly in tests/unit read the sources of the package, which are parsed once in a process.
        source = path.count("/") == 2
        # The comparison accuracy runs many cases of the paper's, which are stored by then.
        rows = nodeid.partition("-")[0].replace("[accuracy", "[paper")
        # Where a mark chooses, tests of a unit share little beside what each of them takes, but with those that differ
        # in their last parameter; in one file they would keep one process busy.
        expression = self.config.option.markexpr
        chosen = expression not in {"", "not drill"} and not expression.startswith("not nightly")
        unit = "sources" if source else nodeid.rpartition("-")[0] or nodeid if chosen else path
        return {"report": folder, "agreement": rows, "conformance": check, "unit": unit}.get(folder, path)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadScopeScheduling:
    """By no mark: what xdist 3.8 writes into a test's name for its groups is not seen by pytest 9.2.

    In the order of the tests, of which the last are in no long file: begun last, those with fewest tests left
    one process without work.
    """
    config.option.loadscopereorder = False
    return _TogetherWhatShares(config, log)


_WARM_WORKERS = WarmWorkers()
_FORKS = Forks()
_TRUTHS = KnownTruths()
# Tests of truths, which find each anew.
_OF_TRUTHS = (
    "tests/unit/truth/",
    "tests/unit/papers/blajer_2006/truth/",
    *(
        f"tests/drill/test_{name}.py"
        for name in ("contact_truths", "joint_law_truths", "law_faults", "published", "referee", "random_scenes")
    ),
)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Tests and the fixtures that they are the first to need share workers and truths, unless they are about these."""
    with ExitStack() as stack:
        if not item.get_closest_marker("own_workers"):
            stack.enter_context(_WARM_WORKERS.lent())
            stack.enter_context(_FORKS.lent())
        if not item.nodeid.startswith(_OF_TRUTHS):
            stack.enter_context(_TRUTHS.lent())
        return (yield)


def pytest_unconfigure() -> None:
    """Ends them."""
    _WARM_WORKERS.close()
    _FORKS.close()


@pytest.fixture
def started_workers(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """For whom worker processes were started since: engines by name, the truth, or a format that one defines."""
    names: list[str] = []
    begin = idle_workers.start

    def start(engine: str, memory: float | None) -> idle_workers.Worker:
        names.append(engine)
        return begin(engine, memory)

    monkeypatch.setattr(idle_workers, "start", start)
    return names


@pytest.fixture(autouse=True)
def signals_as_before() -> Iterator[None]:
    """What the command line does at Ctrl-C is undone after a test that called it in this process."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="session")
def site_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Mapping[str, str]], Path]:
    """Makes a folder in which engines of ``tests/plugins`` are announced: one for all who want the same ones."""

    @cache
    def made(engines: frozenset[tuple[str, str]]) -> Path:
        site = tmp_path_factory.mktemp("site")
        info = site / "throwaway-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(_METADATA)
        lines = [f"{name} = {target}" for name, target in sorted(engines)]
        (info / "entry_points.txt").write_text("\n".join(["[proofroll.engines]", *lines, ""]))
        return site

    return lambda engines: made(frozenset(engines.items()))


@pytest.fixture
def install_engines(
    site_of: Callable[[Mapping[str, str]], Path], monkeypatch: pytest.MonkeyPatch
) -> Callable[[Mapping[str, str]], None]:
    """Announces engines of ``tests/plugins`` as an installed package would, to this process and to its workers."""

    def install(engines: Mapping[str, str]) -> None:
        site = site_of(engines)
        places = [str(site), str(PLUGINS), *filter(None, [os.environ.get("PYTHONPATH")])]
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join(places))
        monkeypatch.syspath_prepend(str(site))

    return install


@pytest.fixture(scope="session")
def parsed_sources() -> None:
    """Parses the package once for all tests that read its sources."""
    for path in Path(cli.__file__).parents[1].rglob("*.py"):
        nodes(path)


@pytest.fixture
def make_case() -> Callable[..., Case]:
    """A case of the sphere in the cylinder, short, in an engine of ``tests/plugins``."""

    def make(engine: str, **changes: Any) -> Case:
        parameters = changes.pop("parameters", {})
        facts = EngineFacts(engine, "1", "code", changes.pop("settings", {}), "dt", None)
        values: dict[str, Any] = {
            "scene": "sphere_in_cylinder",
            "parameters": parameters,
            "scene_digest": load_scene("sphere_in_cylinder", **parameters).digest,
            "engine": facts,
            "until": 0.1,
            "every": 0.05,
            "time_limit": 60.0,
        }
        return Case(**(values | changes))

    return make


@pytest.fixture
def times() -> np.ndarray:
    """A time grid of two seconds, as the comparisons use it."""
    return np.linspace(0.0, 2.0, 101)


Proofroll = Callable[..., tuple[int, str, str]]


@pytest.fixture
def proofroll(
    command_line: Proofroll,
    install_engines: Callable[[Mapping[str, str]], None],
) -> Proofroll:
    """As ``command_line``, with engines besides that misbehave."""
    install_engines(ENTRY_POINTS)
    return command_line


@pytest.fixture
def command_line(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Proofroll:
    """Runs the command line in this process; exit code, standard output, standard error."""
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(cli.options, "_SAID_EVERY", 3600.0)  # no test hangs on how long its work takes

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["proofroll", *arguments])
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main()
        captured = capfd.readouterr()
        code = ended.value.code
        assert isinstance(code, int)
        return code, captured.out, captured.err

    return run
