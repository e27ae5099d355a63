# Two commands set a fresh machine up: `make demo` and `make test`. They need python3 with venv,
# make and gcc, and nothing else.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# One more than processors: some tests wait for sockets, browsers and other processes. Neighbours
# stay together, so that what a file prepares is seldom prepared twice.
WORKERS ?= $(shell expr $$(nproc 2>/dev/null || echo 2) + 1)
SHARED_OUT := -n $(WORKERS) --dist worksteal
# What is compiled is kept, whatever the shell says: commands that tests start need it at once.
export PYTHONDONTWRITEBYTECODE :=

# Processes share the processors; threads of each of them would wait for one another.
tests units end-to-end browser slow: export OMP_NUM_THREADS := 1
# As many tests run as there are processors: a test that starts more processes only imports more.
# What the number of processes must not change is tested with numbers that are given. At night, pools
# start as they do for users.
tests units end-to-end browser: export LOKY_MAX_CPU_COUNT := 1

.PHONY: demo test style types lint tests units end-to-end browser docs-strict site fuzz-lines nightly slow process-figures coverage lowest package lock mutation notebooks docs docs-version bench paired house fuzz clean

demo: $(VENV)/installed
	$(BIN)/elastocal demo afp --out demo --force

# What a second finds comes first. All else shares the processors, so that none of them waits while a
# test waits for a socket or a browser.
test: $(VENV)/installed-fuzz style
	$(MAKE) --no-print-directory -j4 tests types docs-strict fuzz-lines

lint: style types

style: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports

types: $(VENV)/installed-dev
	$(BIN)/mypy

# All at once: every process collects the suite once, and where a browser is waited for others work.
# In a fresh clone one process compiles what all of them read.
tests: $(VENV)/installed-dev
	@test -d tests/__pycache__ || $(BIN)/pytest --collect-only -qq > /dev/null
	$(BIN)/pytest $(SHARED_OUT)

units: $(VENV)/installed-dev
	$(BIN)/pytest $(SHARED_OUT) -m 'not slow and not end_to_end and not browser'

end-to-end: $(VENV)/installed-dev
	$(BIN)/pytest $(SHARED_OUT) -m 'end_to_end and not slow and not browser' tests

# Looks are of the night: who changes a page looks at all of them.
browser: $(VENV)/installed-dev
	$(BIN)/pytest $(SHARED_OUT) -m browser tests

# Every page and link; an index for the search says nothing of them, nor do figures, colours of code
# and folded signatures.
docs-strict: $(VENV)/installed-dev
	NO_MKDOCS_2_WARNING=1 SITE_SEARCH=false SITE_FIGURES=false SITE_COLOURS=false SITE_LINE=100000 \
		$(BIN)/mkdocs build --strict --quiet --site-dir .cache/site

# The site as readers see it: its figures drawn, its notebooks run.
site: $(VENV)/installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

# Every parser of what devices send, under Atheris; `make fuzz-lines UNTIL=-runs=1000000` is longer.
UNTIL ?= -max_total_time=6
fuzz-lines: $(VENV)/installed-fuzz
	cd tests && ../$(BIN)/python -m fuzz.lines $(UNTIL) -max_len=4096 -verbosity=0 -print_final_stats=1

nightly: slow site notebooks process-figures stopping coverage lowest package paired mutation

slow: $(VENV)/installed-dev
	$(BIN)/pytest $(SHARED_OUT) -m slow -rA

# The notebooks that readers download, as they run them: by Jupyter, in a fresh kernel and an empty
# folder each. The site's build runs their cells, too, but all in one process.
notebooks: $(VENV)/installed-nightly
	cd docs/hooks && OMP_NUM_THREADS=1 ../../$(BIN)/python -m gallery.notebooks

# The tables of simulated processes that the site and the README quote: what is not yet written down
# in docs/hooks/gallery/process_figures.json, or all of it with ANEW=--anew. Up to an hour.
process-figures: $(VENV)/installed-dev
	cd docs/hooks && OMP_NUM_THREADS=1 ../../$(BIN)/python -m gallery.process_figures $(ANEW)

# Campaigns that stop by themselves: what is not yet written down in docs/hooks/gallery/stopping.json.
# An hour for all.
stopping: $(VENV)/installed-dev
	cd docs/hooks && OMP_NUM_THREADS=1 ../../$(BIN)/python -m gallery.stopping

# Tests that count imported modules would count those of coverage.
coverage: $(VENV)/installed-nightly
	$(BIN)/pytest $(SHARED_OUT) --cov --cov-report=term:skip-covered --deselect tests/test_startup.py

# The lowest versions that pyproject.toml allows, as wheels: what a user without a compiler gets.
LOWEST := .venv-lowest
lowest: $(VENV)/installed-nightly
	$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(LOWEST)
	$(BIN)/uv pip install --quiet --python $(LOWEST)/bin/python --resolution lowest-direct \
		--only-binary :all: --no-binary elastocal -e . $(TESTING)
	OMP_NUM_THREADS=1 $(LOWEST)/bin/python -m pytest $(SHARED_OUT) -p no:cacheprovider $(QUICK)
TESTING := 'pytest>=8.3' 'pytest-xdist>=3.6' 'hypothesis>=6.120' 'py-opw-kinematics>=1.3'
QUICK := tests/test_units.py tests/test_files.py tests/test_meshes.py tests/test_tables.py \
	$(addprefix tests/,cell dataset elastic records robot shapes sim)

# Wheel and packed sources as they are released, each installed without anything else, and tried.
PACKAGE := .venv-package
package: $(VENV)/installed-nightly
	rm -rf dist
	$(BIN)/uv build --quiet --out-dir dist
	set -e; for built in dist/*.whl dist/*.tar.gz; do \
		$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(PACKAGE); \
		$(BIN)/uv pip install --quiet --require-hashes --python $(PACKAGE)/bin/python \
			-r requirements/user.lock; \
		$(BIN)/uv pip install --quiet --no-deps --python $(PACKAGE)/bin/python $$built; \
		$(PACKAGE)/bin/elastocal --version; \
		$(PACKAGE)/bin/elastocal init $(PACKAGE)/cell --json; \
		$(PACKAGE)/bin/python -m elastocal check $(PACKAGE)/cell/cell.yaml --json; \
	done

# What users and developers share, with hashes:
# `pip install --require-hashes -r requirements/user.lock`, then elastocal with `--no-deps`.
lock: $(VENV)/installed-nightly
	$(BIN)/uv pip compile pyproject.toml --universal \
		--python-version 3.11 --generate-hashes --quiet --no-header -o requirements/user.lock
	$(BIN)/uv pip compile pyproject.toml --extra dev --extra docs --universal \
		--python-version 3.11 --generate-hashes --quiet --no-header -o requirements/dev.lock

# A tenth of all mutants, another one each day of ten; `make mutation TENTH=3` chooses. Two hours at
# most, or MUTATION_TIME: what is not tried then is not counted.
MUTATION_TIME ?= 2h
TENTH ?= $(shell date +%j | tail -c 2)
mutation: $(VENV)/installed-nightly
	timeout $(MUTATION_TIME) $(BIN)/mutmut run '*__mutmut_*$(TENTH)' > mutants.log || test $$? -eq 124
	$(BIN)/python tools/survivors.py

docs: $(VENV)/installed-dev
	$(BIN)/mkdocs serve

# The documentation of this version on the branch gh-pages, beside those of others: `latest` of them.
# Nothing is pushed. `$(BIN)/mike serve -F mkdocs-versions.yml` shows them. mike looks for mkdocs in
# the PATH.
docs-version: $(VENV)/installed-dev
	$(BIN)/pip install --quiet --disable-pip-version-check -e '.[versions]'
	PATH="$(CURDIR)/$(BIN):$$PATH" NO_MKDOCS_2_WARNING=1 \
		$(BIN)/mike deploy -F mkdocs-versions.yml --update-aliases \
		"$$($(BIN)/python -c 'import elastocal; print(".".join(elastocal.__version__.split(".")[:2]))')" latest
	$(BIN)/mike set-default -F mkdocs-versions.yml latest

# Processor time of the commands that users wait for, in turns with the last commit of an earlier day;
# `make paired BASE=COMMIT` names another one.
paired: $(VENV)/installed-dev
	$(BIN)/python benchmarks/paired.py $(BASE)

bench: $(VENV)/installed-dev
	$(BIN)/python benchmarks/run.py
	$(BIN)/python benchmarks/search.py
	$(BIN)/python benchmarks/pool.py
	$(BIN)/python benchmarks/study.py 50
	$(BIN)/python benchmarks/compensation.py
	$(BIN)/python benchmarks/ladder.py
	$(BIN)/python benchmarks/geometry.py 16811
	$(BIN)/python benchmarks/codec.py
	$(BIN)/python benchmarks/live.py 20
	$(BIN)/python benchmarks/demo.py
	$(BIN)/python benchmarks/record.py

# CASES and SEED choose; what falls is printed as lines for tests/fuzz/corpus.json.
CASES ?= 10000
SEED ?= 0
fuzz: $(VENV)/installed-dev
	cd tests && ../$(BIN)/python -m fuzz.harness --cases $(CASES) --seed $(SEED)

house:
	$(PYTHON) tools/house.py

clean:
	rm -rf $(VENV) $(LOWEST) $(PACKAGE) dist demo site mutants

say = @printf '%s\n' $(1)

$(VENV)/bin/python:
	$(call say,"Making $(VENV) with $$($(PYTHON) --version): nothing is installed outside of it.")
	@$(PYTHON) -m venv $(VENV)

comma := ,
# uv takes a third of pip's time; where it cannot be had, pip does it.
PIP := $(BIN)/pip install --quiet --disable-pip-version-check
install = { $(PIP) uv && $(BIN)/uv pip install --quiet --python $(BIN)/python \
	-e $(1); } 2>/dev/null || $(PIP) -e $(1)

NEEDED = sed -n '/^dependencies = \[/,/^\]/s/^ *"\([A-Za-z0-9_-]*\).*/\1/p' pyproject.toml

$(VENV)/installed: pyproject.toml | $(VENV)/bin/python
	$(call say,"Installing elastocal and the packages that it needs: about a minute$(comma) 1 GB." \
		"They are $$($(NEEDED) | paste -sd ' ').")
	@$(call install,.)
	@touch $@

$(VENV)/installed-dev: pyproject.toml | $(VENV)/bin/python
	$(call say,"Installing elastocal$(comma) what it needs$(comma) and the tools of developers.")
	@$(call install,'.[dev$(comma)docs]')
	@touch $@ $(VENV)/installed

# Where it cannot be had nothing is fuzzed, and that is said.
$(VENV)/installed-fuzz: $(VENV)/installed-dev
	$(call install,'.[fuzz]') || true
	touch $@

$(VENV)/installed-nightly: $(VENV)/installed-dev
	$(call install,'.[nightly]')
	touch $@
