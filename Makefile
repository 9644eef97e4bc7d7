# Every verb sets up what it needs: a virtual environment, the compiled core in release mode, the package.
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help install reproduce test test-core compile-tests test-quick test-slow test-browser fuzz fuzz-kinds fuzz-roots fuzz-panels verify lint lint-core lint-package format bench bench-long compare docs pages gallery examples wheel film clean

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT := out

RUST := $(shell find rust -name '*.rs' -o -name Cargo.toml) Cargo.toml $(wildcard Cargo.lock)
INSTALLED := $(VENV)/.installed

help: ## List the verbs
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

reproduce: $(INSTALLED) ## Compute every published number, compare, write the figures to out/
	PYTHONPATH=examples $(BIN)/python -m paper reproduce --output $(OUT)

install: $(INSTALLED) ## Set up the virtual environment with the package

test: test-core $(INSTALLED) ## Test the core and the package, without what runs every night (test-slow)
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal --durations 20 -m "not nightly"

# In the profile and with the features that the package is built in, so that the core and its dependencies compile once.
TEST_CORE := cargo test --release --locked --package stickslip-core --package stickslip-python --tests
test-core: ## Test the core alone, which needs no Python
	$(TEST_CORE)

compile-tests: ## Compile the tests of the core
	$(TEST_CORE) --quiet --no-run

test-quick: $(INSTALLED) ## Test the package, without what takes seconds or starts other processes
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal -m "not slow and not process and not nightly"

# pytest prints the seed of a failure; PYTEST="--hypothesis-seed=..." draws the same examples again.
PYTEST ?=
test-slow: $(INSTALLED) ## Test the package with all tests, and many new random examples of every property
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal --hypothesis-profile slow $(PYTEST)

# Playwright drives the browser of the system: CHROMIUM=..., by default `chromium`.
test-browser: $(VENV)/.extra-browser pages ## Look at the documentation, the report and the explorer in a browser
	$(BIN)/python -m pytest tests/browser

# Seeds share no scene; a campaign that was stopped goes on.
N ?= 1000
SEED ?= 1
fuzz: $(INSTALLED) ## Run N=1000 random scenes of SEED=1 against each other; EXTRAS="unsymmetric stops" with more in them; resumable
	$(BIN)/python tests/support/fuzz_campaign.py --scenes $(N) --seed $(SEED) --store $(OUT)/fuzz.jsonl \
		$(addprefix --,$(EXTRAS))

# Eight streams of what EXTRAS means, in one store.
fuzz-kinds: $(INSTALLED) ## Run N=1000 random scenes of SEED=1 of each of eight kinds: stops, springs of contacts, loads, unsymmetric terms, tables, laws that vanish at rest, nonlinear elements, twins
	@status=0; for kinds in "--stops" "--forced --compliant" "--stops --compliant" \
		"--unsymmetric --forced --stops --compliant" "--tables" "--vanishing" "--elements" "--twins"; do \
		echo "fuzz $$kinds"; $(BIN)/python tests/support/fuzz_campaign.py --scenes $(N) --seed $(SEED) \
			--store $(OUT)/fuzz.jsonl $$kinds || status=1; \
	done; exit $$status

# A failure is reduced to its smallest polynomial and kept in rust/core/proptest-regressions, where every later run of
# the core's tests meets it again.
fuzz-roots: ## Draw N=1000 random problems of the certified root search, of SEED=1
	PROPTEST_CASES=$(N) PROPTEST_RNG_SEED=$(SEED) $(TEST_CORE) first_root::fuzz

fuzz-panels: ## Draw N=1000 random motions under friction laws: errors of their panels against the bounds
	PROPTEST_CASES=$(N) PROPTEST_RNG_SEED=$(SEED) $(TEST_CORE) friction::fuzz -- --nocapture

# Python finds the cases in tests/verification; the tests compare the page with what they compute.
verify: $(INSTALLED) ## Compute the published models and closed forms, and write docs/verification.md
	PYTHONPATH=tests:tests/support:examples $(BIN)/python -m verification.manual

lint: lint-core lint-package ## Check format, lints, spelling, types, stubs and that the core knows no Python

lint-core: ## Check the format and the lints of the core, its documentation and that it knows no Python
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps --locked
	@if cargo tree --locked --package stickslip-core --edges all | grep -E '(^|[^a-z])(pyo3|numpy)'; \
	then echo 'stickslip-core must not depend on Python' >&2; exit 1; fi

lint-package: $(INSTALLED) ## Check format, lints, spelling, types and stubs of the package
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/codespell README.md CONTRIBUTING.md CHANGELOG.md docs examples python rust
	$(BIN)/mypy
	$(BIN)/python -m mypy.stubtest stickslip._core

format: $(INSTALLED) ## Format Rust and Python
	cargo fmt --all
	$(BIN)/ruff check --fix-only
	$(BIN)/ruff format

# INTO=docs writes every table and figure into the page that has its block. A script that fails leaves its block as it was, and
# the others go on.
INTO ?=
BENCHES := "work_precision --figure $(OUT)/work-precision.png" batch_throughput studies \
	"local_events --figure $(OUT)/local-events.png" peers_over_size method_choice eigenvalues missed_events \
	plane_events reduced_cycles random_scenes meshed_contact band_modes stability_boundary reduced_growth \
	"reduced_variants --variants 10"
LONG_BENCHES := "reduced_growth --reductions 150" reduced_variants
# $(1): the scripts
run_benches = mkdir -p $(OUT); status=0; for bench in $(1); do \
		begin=$$(date +%s); echo "bench $${bench%% *}"; script="benchmarks/$${bench%% *}.py $${bench\#$${bench%% *}}"; \
		$(BIN)/python $$script $(INTO:%=--into %) || { echo "bench $${bench%% *} FAILED" >&2; status=1; }; \
		echo "bench $${bench%% *} took $$(( $$(date +%s) - begin )) s"; \
	done

bench: $(VENV)/.bench ## Time, accuracy, throughput and size, beside other programs, within an hour; INTO=docs keeps them in the pages
	@$(call run_benches,$(BENCHES)); \
	$(if $(INTO),cp $(OUT)/work-precision.png $(OUT)/local-events.png $(INTO) || status=1;) exit $$status

bench-long: $(VENV)/.bench ## The tables of random reductions with 150 and 100 of them; INTO=docs keeps them in the pages
	@$(call run_benches,$(LONG_BENCHES)); exit $$status

# Where the other programs are: interpreters that import Siconos and pyHarm, the program of CalculiX; AUTO_DIR and FC for
# AUTO-07p. A program that is missing fails its page, and the others are written.
SICONOS ?= python3
PYHARM ?= python3
CCX ?= ccx
compare: $(VENV)/.bench ## Run this program beside others and write docs/comparisons; SICONOS=, PYHARM=, CCX=, AUTO_DIR= say where they are
	@status=0; for peer in heyoka auto "calculix --peer $(CCX)" "siconos --peer $(SICONOS)" "pyharm --peer $(PYHARM)"; do \
		PYTHONPATH=benchmarks $(BIN)/python -m comparisons.$$peer --into docs || status=1; \
	done; exit $$status

docs: $(VENV)/.extra-docs ## Run every snippet, redraw the figures, write the pages to docs/_build/html
	$(BIN)/python -m pytest tests/test_pages.py
	PYTHONPATH=examples $(BIN)/python -m paper reproduce --output $(OUT)
	cp $(OUT)/limit-cycle.png $(OUT)/energy-cycle.png $(OUT)/energy-flow.png docs
	$(BIN)/python docs/sketches/draw.py
	PYTHONPATH=tests/support $(BIN)/python -m pages docs/tutorial.md docs/pictures
	PYTHONPATH=tests/support $(BIN)/python -m pages docs/friction.md docs/pictures
	PYTHONPATH=tests/support $(BIN)/python -m pages docs/models.md docs/pictures
	$(MAKE) pages

pages: $(VENV)/.extra-docs ## Write the pages to docs/_build/html; warnings are errors
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet --builder html docs docs/_build/html

# The wheel comes from the source distribution, unpacked; both share the compiled dependencies of the other verbs.
# It is tried out where no compiler is in reach.
wheel: $(VENV)/.created ## Build source distribution and wheel in dist/, and try the wheel without Rust
	rm -rf dist build/source build/try
	mkdir -p build/source
	$(BIN)/maturin sdist --out dist
	tar -xzf dist/stickslip-*.tar.gz -C build/source --strip-components 1
	cd build/source && CARGO_TARGET_DIR=$(CURDIR)/target $(CURDIR)/$(BIN)/maturin build --quiet --release --locked \
		--interpreter $(CURDIR)/$(BIN)/python --out $(CURDIR)/dist
	$(PYTHON) -m venv build/try
	build/try/bin/python -m pip install --quiet dist/stickslip-*.whl
	cd build && env -i HOME=/nonexistent PATH=$(CURDIR)/build/try/bin:/usr/bin:/bin try/bin/python ../tests/smoke.py

film: $(VENV)/.extra-browser ## Film the explorer for its page of the documentation
	$(BIN)/python benchmarks/explorer_film.py docs/explorer.gif

gallery: $(INSTALLED) ## Redraw the pictures of docs/gallery.md
	PYTHONPATH=examples $(BIN)/python -m paper figures --output docs/gallery --format png

examples: $(INSTALLED) ## Run the examples and keep their pictures for the documentation
	mkdir -p $(OUT)/examples docs/examples
	cd $(OUT)/examples && for script in $(CURDIR)/examples/*.py; do $(CURDIR)/$(BIN)/python $$script || exit 1; done
	cp $(OUT)/examples/*.png docs/examples

clean: ## Remove everything that is built
	rm -rf $(VENV) target $(OUT) build dist docs/_build
	rm -f python/stickslip/*.so

$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and f"stickslip needs Python >= 3.11, {sys.executable} is {sys.version.split()[0]}; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet 'maturin>=1.9,<2'
	@touch $@

MATURIN := env -u CONDA_PREFIX VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/maturin develop --release --locked

$(INSTALLED): $(VENV)/.created pyproject.toml $(RUST)
	$(MATURIN) --extras test,lint,study,dask,fe
	@touch $@

$(VENV)/.bench: $(INSTALLED)
	$(MATURIN) --extras bench || echo 'benchmarks leave out the programs that could not be installed' >&2
	@touch $@

# What only one verb needs is installed when it is first used.
$(VENV)/.extra-%: $(INSTALLED)
	$(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["$*"], sep="\n")' > $@.txt
	$(BIN)/python -m pip install --quiet -r $@.txt
	@mv $@.txt $@
