"""Kinds of arithmetic: kernels of linear algebra, vector instructions, threads, interpreters, without heyoka."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[4]
# Declared in pyproject.toml; a test holds the two together.
PYTHONS = ("3.11", "3.12", "3.13")
# OpenBLAS: AVX2, AVX2 of another maker, AVX-512, and SSE alone.
CORES = ("Haswell", "Zen", "SkylakeX", "Prescott")
# Which of numpy's dispatched features need what; the names changed with numpy 2.4 (X86_V4 is AVX-512, X86_V3 is AVX2).
_AVX512 = ("AVX512", "X86_V4")
_AVX2 = (*_AVX512, "AVX", "FMA", "F16C", "X86_V3")
# The same for the functions of the C library, where it is glibc; elsewhere nobody reads this variable.
_PLAIN_LIBM = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"}
# A package that is installed is hidden from every process: an entry of None among the modules means that there is none.
_WITHOUT = "import sys; sys.modules.update(dict.fromkeys({names!r}))\n"
_PROBE = "import sys; from proofroll_drill.arithmetic import probe; probe.main()"


@dataclass(frozen=True)
class Arithmetic:
    """Variant of the arithmetic for the same numbers.

    Attributes:
        name: name of its option.
        says: difference in words.
        environment: variables of its processes.
        python: interpreter with this package; by default the one that runs this.
        threads: of linear algebra, in each process.
        without: modules that are not there.
        untried: why this machine cannot do it; empty: it can.
    """

    name: str
    says: str
    environment: dict[str, str] = field(default_factory=dict)
    python: str = sys.executable
    threads: int = 1
    without: tuple[str, ...] = ()
    untried: str = ""

    def variables(self, folder: Path) -> dict[str, str]:
        """The environment of its processes; ``folder`` takes what hides modules from them."""
        threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), str(self.threads))
        found = os.environ | threads | self.environment
        if self.without:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "sitecustomize.py").write_text(_WITHOUT.format(names=self.without), encoding="utf-8")
            found["PYTHONPATH"] = os.pathsep.join(filter(None, [str(folder), found.get("PYTHONPATH")]))
        return found


def kinds() -> list[Arithmetic]:
    """All kinds; the first is this machine as it is, which the others are held against."""
    return [
        Arithmetic("reference", "this machine as it is, one thread of linear algebra"),
        *(Arithmetic(core.lower(), f"OpenBLAS for {core}", {"OPENBLAS_CORETYPE": core}) for core in CORES),
        _without_features("no-avx512", "numpy without AVX-512", _AVX512, {}),
        _without_features("no-avx2", "numpy and the C library without AVX-512, AVX2 and FMA", _AVX2, _PLAIN_LIBM),
        _machine("avx2-machine", "processor with AVX2 alone", "Haswell", _AVX512, {}),
        _machine("sse-machine", "processor with SSE alone", "Prescott", _AVX2, _PLAIN_LIBM),
        Arithmetic("two-threads", "two threads of linear algebra", threads=2, untried=_lacks_a_second_core()),
        Arithmetic("no-heyoka", "without heyoka", without=("heyoka",), untried=_lacks_heyoka()),
        *(_interpreter(version) for version in PYTHONS if version != _version(sys.executable)),
    ]


def took_effect(kind: Arithmetic, folder: Path) -> str:
    """Reason that the kind has no effect here, as one clause; empty: its processes compute as declared."""
    done = subprocess.run(
        [kind.python, "-c", _PROBE], env=kind.variables(folder), capture_output=True, text=True, check=False
    )
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"its process ended by {_signal(done.returncode)}"])[-1]
        return f"this machine cannot: {last}"
    found = json.loads(done.stdout)
    asked = kind.environment.get("OPENBLAS_CORETYPE")
    if asked and not found["core"]:
        return "numpy here has another linear algebra than OpenBLAS"
    if asked and "not found" in done.stderr.lower():
        return f"this OpenBLAS has no kernels for {asked}"
    left = set(kind.environment.get("NPY_DISABLE_CPU_FEATURES", "").split()) & set(found["features"])
    return f"numpy still uses {', '.join(sorted(left))}" if left else ""


def _signal(code: int) -> str:
    """Exit status in words: on a processor without the instructions it is SIGILL."""
    return signal.Signals(-code).name if code < 0 else f"exit status {code}"


def make_ready(kind: Arithmetic) -> None:
    """Installs this package for the kind's interpreter, as ``make install`` does, where it is not yet.

    Raises:
        subprocess.CalledProcessError: a package cannot be installed.
    """
    python = Path(kind.python)
    if python.parent.parent.parent == REPOSITORY and python.parent.parent.name.startswith(".venv-"):
        version = python.parent.parent.name.removeprefix(".venv-")
        made = ["make", "install", f"VENV=.venv-{version}", f"PYTHON={_found(version)}"]
        subprocess.run(made, cwd=REPOSITORY, check=True, stdout=sys.stderr)


def _without_features(name: str, says: str, wanted: tuple[str, ...], more: dict[str, str]) -> Arithmetic:
    """A kind that switches off numpy's vector instructions, of those that this machine has."""
    features = _dispatched(wanted)
    untried = "" if features else "numpy dispatches to no such instructions on this processor"
    return Arithmetic(name, says, {"NPY_DISABLE_CPU_FEATURES": features} | more, untried=untried)


def _machine(name: str, says: str, core: str, lacks: tuple[str, ...], more: dict[str, str]) -> Arithmetic:
    """A kind that changes linear algebra, numpy and threads at once: one run where each alone would take its own."""
    variables = {"OPENBLAS_CORETYPE": core, "NPY_DISABLE_CPU_FEATURES": _dispatched(lacks)} | more
    return Arithmetic(name, f"{says}, and two threads", variables, threads=2)


def _dispatched(wanted: tuple[str, ...]) -> str:
    """Features that numpy chooses at run time and this processor has; a baseline cannot be switched off."""
    umath = import_module("numpy._core._multiarray_umath")  # numpy has no public name for it

    features = (name for name in umath.__cpu_dispatch__ if umath.__cpu_features__.get(name))
    return " ".join(name for name in features if name.startswith(wanted))


def _lacks_a_second_core() -> str:
    return "" if (os.cpu_count() or 1) > 1 else "this machine has one core"


def _lacks_heyoka() -> str:
    from proofroll.core import heyoka_library as library

    return "" if library.available() else "heyoka is not installed, so that every other kind is without it"


def _interpreter(version: str) -> Arithmetic:
    name, says = f"python{version}", f"Python {version}"
    python = REPOSITORY / f".venv-{version}" / "bin" / "python"
    return Arithmetic(name, says, python=str(python), untried="" if _found(version) else "it is not on this machine")


@cache
def _found(version: str) -> str | None:
    """An interpreter of this version on the path or among those of pyenv, which offers some that do not start."""
    others = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"), reverse=True)
    for candidate in (shutil.which(f"python{version}"), *map(str, others)):
        if candidate and _version(candidate) == version:
            return candidate
    return None


@cache
def _version(python: str) -> str:
    told = "import sys; print('%d.%d' % sys.version_info[:2])"
    done = subprocess.run([python, "-c", told], capture_output=True, text=True, check=False)
    return done.stdout.strip()
