# `make demo` and `make test` set up all they need in .venv; nothing here needs root.
PYTHON ?= python3
BIN := .venv/bin
# the set-up is repeated when the dependencies change, and only then
STAMP := .venv/.ready-$(shell cat pyproject.toml constraints.txt | cksum | cut -d' ' -f1)

.PHONY: setup demo test check docs bench clean

setup: $(STAMP)

$(STAMP):
	@$(PYTHON) -c 'import sys; v = sys.version_info; sys.exit(0 if v >= (3, 11) else f"Foreshock needs Python 3.11 or newer; {sys.executable} is {v.major}.{v.minor}. Name another with: make PYTHON=python3.12")'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[all,dev]'
	@rm -f .venv/.ready-*
	@touch $@

demo: $(STAMP)
	$(BIN)/foreshock demo --out out/demo

test: $(STAMP)
	$(BIN)/pytest

check: $(STAMP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.docs.generated --check

docs: $(STAMP)
	$(BIN)/python -m tests.docs.generated

bench: $(STAMP)
	$(BIN)/python -m tests.bench

clean:
	rm -rf .venv out build dist bench.json .pytest_cache .mypy_cache .ruff_cache .hypothesis
