# Two commands do everything: `make report` (the main comparisons and studies, on one page; where its time goes:
# `make report REPORT=--profile`) and `make test`. Each makes .venv itself; another
# Python beside it: make test PYTHON=python3.12 VENV=.venv-3.12
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out
# A worker process that finds no bytecode compiles the package anew, which is a quarter of its start.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: install report test drills nightly bench drill check format readme docs gallery engines clean

install: $(VENV)/.installed

# A pip of today takes two thirds of the time of Python's own; what builds the packages is installed once for all of
# them. Bytecode is compiled on all cores, where pip would use one, and not for the thousands of modules that nobody imports.
$(VENV)/.installed: pyproject.toml constraints.txt fuzz/pyproject.toml throughput/pyproject.toml cluster/pyproject.toml balance/pyproject.toml benchmarks/pyproject.toml tests/drill/pyproject.toml
	$(PYTHON) -m venv $(VENV)
	PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --no-compile --upgrade pip hatchling editables
	PIP_CONSTRAINT=constraints.txt $(BIN)/python -m pip install --quiet --no-compile --no-build-isolation --editable ".[dev]" --editable ./fuzz --editable ./throughput --editable ./cluster --editable ./balance --editable ./benchmarks --editable ./tests/drill
	-$(BIN)/python -m compileall -q -j 0 -x '/(OpenGL|fontTools|mypyc?|setuptools|tests)/' $(VENV)/lib >/dev/null
	touch $@

report: install
	$(BIN)/proofroll report --out $(OUT) $(REPORT)

# Every test but drills: those that take more than 1 s of processor, of which none may be there without its mark, and
# most above a quarter of a second. `make test MARK=` runs all.
MARK ?= not drill
drills: MARK = drill and not nightly
test drills: install
	PROOFROLL_NO_DEAR=1 $(BIN)/python -m pytest -n 2 -m "$(MARK)"

# All drills, with the longest, and with those that .ci/run takes only where what they hold has changed; every comparison
# with all its rows; tests near round-off as two other kinds of processors compute. Each runs whatever another found, and a
# table of the searches ends it: how many examples each drew, and each finding with its seed.
nightly: install
	@failed=0; \
	$(BIN)/proofroll report --out $(OUT)/nightly --budget 3600 || failed=1; \
	$(BIN)/python -m proofroll_drill arithmetic --no-comparisons --tests nightly --kind haswell --kind prescott --jobs 2 || failed=1; \
	$(BIN)/python -m pytest -n 2 -m drill || failed=1; \
	.ci/engines nightly || failed=1; \
	exit $$failed

# Speed, and what proofroll itself costs; faults on purpose, other arithmetic, a referee. Each has more to offer:
# make bench WHAT=--help; make drill WHAT="referee --count 150".
bench: WHAT = adapters
bench: install
	$(BIN)/python -m proofroll_benchmarks $(WHAT)
drill: WHAT = faults
drill: install
	$(BIN)/python -m proofroll_drill $(WHAT)

check: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The packages under examples/engines, as their authors would install and test them.
engines: install
	.ci/engines

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The pictures of README.md and the tables of docs/sphere_in_cylinder.md, from real runs, on a machine that does
# nothing else; of one part: make readme PARTS=costs (or verdicts, regimes).
readme: install
	$(BIN)/python docs/update_readme.py $(PARTS)

# The documentation, from docs/ and the docstrings; a warning is an error.
docs: install
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going --builder html docs $(OUT)/docs

# The pages of docs/gallery, from real runs: of scenes that are lacking there, or have changed.
gallery: install
	$(BIN)/python docs/gallery.py

clean:
	rm -rf $(OUT) dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis
