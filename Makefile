# make        set up .venv, rebuild all results, write the report
# make test   set up .venv, run all checks and tests
# make blind   400 blind cases instead of the 8 of make, about an hour on 2 cores: results/blind_400
# make foreign  diagnose 300 records of the independent simulator (rotorstudy.blind.machines), several hours on 2 cores
# make browser  open the charts of the pages in Chromium (Debian: apt install chromium), driven by Playwright
# make docs   build the pages of docs/ as a site, with a check for dead links
# make cracks   identify cracks of the independent simulator in millimetres, half an hour on 2 cores; can be interrupted
# make elasticity  the flexibility of cracks by three-dimensional elasticity anew, in an environment of its own
# make ross     diagnose records of the package ROSS, in an environment of its own, and write the rotors of tests/measured/ross
# make lock     write environment.txt again: the newest versions that fit together, with hashes
# make newest   run the tests (or TESTS=tests/published) with the newest versions of everything, on Python 3.11 to 3.14 as far as these can be had
# make peers    speed, memory and results beside ROSS and scipy on one rotor, about ten minutes on 1 core
PYTHON ?= python3
CORES ?= all
SNAKEMAKE = .venv/bin/snakemake --cores $(CORES)
# uv takes a third of the time of pip; pip is used where uv reaches no index, as uv does not read pip's configuration
PIP = .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-compile --no-deps --require-hashes
UV = .venv/bin/uv pip install --quiet --python .venv/bin/python --no-deps --require-hashes

# else each of the hundred processes of the workflow and of the tests compiles all that it imports; pip need not compile
# (--no-compile) the many files that none of them imports
unexport PYTHONDONTWRITEBYTECODE

.PHONY: all results report test check browser bench blind foreign cracks elasticity ross peers docs lock newest clean

all: report
	@echo
	@echo "Done. Look at"
	@echo "  results/index.html        headline results, and links to every page, figure and table"
	@echo "  results/report.html       every figure and table, with captions (open it in a browser)"
	@echo "  results/scoreboard.html   each published number beside ours (data: results/scoreboard.csv)"
	@echo "  results/chapter_2 to results/chapter_6   figures, tables, NetCDF"

results: .venv/ready
	@.venv/bin/python workflow/unlock.py
	$(SNAKEMAKE)

report: results
	.venv/bin/snakemake --quiet all --report results/report.html --report-stylesheet workflow/report/style.css

check: .venv/ready
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/lint-imports --no-cache --no-logo > .venv/lint.log 2>&1 || { cat .venv/lint.log; exit 1; }
	.venv/bin/snakemake --lint > .venv/lint.log 2>&1 || { cat .venv/lint.log; exit 1; }

# one BLAS thread a worker: small matrices, and workers that would wait for each other's threads; the tests and what they
# import are compiled beside the checks, which leave a core idle, and not by both workers
test: .venv/ready
	@.venv/bin/pytest --collect-only -q > .venv/collected.log 2>&1 & \
	  $(MAKE) --no-print-directory check; checked=$$?; wait; exit $$checked
	@.venv/bin/python -c 'import playwright' 2>/dev/null || echo "Charts are not opened in a browser; make browser does so"
	OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 .venv/bin/pytest -n 2 --dist loadfile --no-loadscope-reorder --durations 15

browser: .venv/ready
	.venv/bin/python -m pip install --quiet --disable-pip-version-check playwright==1.65.2
	.venv/bin/pytest -q tests/test_charts.py

bench: .venv/ready
	.venv/bin/python benchmarks/scaling.py

blind: .venv/ready
	.venv/bin/rotorstudy blind --cases 400 --cores 2 --out results/blind_400

foreign: .venv/ready
	.venv/bin/python benchmarks/foreign.py --cases 300 --processes 2 --out results/foreign

cracks: .venv/ready
	.venv/bin/python benchmarks/cracks.py --cases 200 --processes 2 --minutes 30 --out results/crack_cases

elasticity: .venv-elasticity/ready
	mkdir -p results/elasticity
	for fronts in ellipse arc; do .venv-elasticity/bin/python benchmarks/elasticity/crack_compliance.py \
		--fronts $$fronts --out results/elasticity/$$fronts.csv || exit 1; done
	@echo "plugins/depths/elasticity.csv and src/rotorstudy/blind/machines/elastic_crack.csv are copies of these two tables"

ross: .venv/ready .venv-ross/ready
	.venv-ross/bin/python benchmarks/ross/simulate.py results/ross
	.venv/bin/python benchmarks/ross/diagnose.py results/ross
	.venv-ross/bin/python benchmarks/ross/models.py results/ross/models

peers: .venv/ready .venv-ross/ready
	.venv/bin/python benchmarks/peers/run.py .venv-ross/bin/python results/peers
	@echo "Look at results/peers/peers.csv; benchmarks/peers/run.py with --page puts the numbers into docs and README"

docs: .venv-docs/ready
	.venv-docs/bin/mkdocs build --quiet
	@echo "Look at results/docs/index.html; for its search: python3 -m http.server --directory results/docs 8000"

lock: .venv/ready
	.venv/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes --no-annotate --no-header \
	  pyproject.toml --extra uff --group dev --output-file .venv/lock.txt
	{ head -2 environment.txt; cat .venv/lock.txt; } > .venv/environment.txt && mv .venv/environment.txt environment.txt

# interpreters: of the system, of pyenv, else those that uv can download; that the versions are those of environment.txt is not tested
newest: .venv/ready
	@PATH="$$PATH:$$(echo $$HOME/.pyenv/versions/*/bin | tr ' ' :)"; for version in 3.11 3.12 3.13 3.14; do \
	  python=.venv-newest/$$version; \
	  .venv/bin/uv venv --quiet --clear --seed --python $$version $$python 2>/dev/null || { missing="$$missing $$version"; continue; }; \
	  .venv/bin/uv pip install --quiet --upgrade --python $$python/bin/python --editable '.[uff]' --group dev && \
	  PATH="$$PWD/$$python/bin:$$PATH" OPENBLAS_NUM_THREADS=1 $$python/bin/pytest -q -n 2 --dist loadfile $(TESTS) \
	    --deselect tests/workflow/test_parts.py::test_every_installed_package_is_pinned_with_hashes || \
	  failed="$$failed $$version"; \
	  tried="$$tried $$version"; \
	done; echo "newest: tried on Python$${tried:- none}, no interpreter for$${missing:- none}"; \
	test -z "$$failed" || { echo "error: the tests fail with the newest versions on Python$$failed"; exit 1; }

clean:
	rm -rf results/* .snakemake

.venv/ready: environment.txt pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "error: $$($(PYTHON) --version) found, Python 3.11 or newer is needed; try make PYTHON=python3.12"; exit 1; }
	@echo "Setting up .venv (up to a minute) ..."
	$(PYTHON) -m venv .venv
	awk '/^[^ ]/ {of_uv = /^uv==/} of_uv' environment.txt > .venv/uv.txt
	$(PIP) --requirement .venv/uv.txt && $(UV) --requirement environment.txt || $(PIP) --requirement environment.txt
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	@touch $@

.venv-ross/ready: benchmarks/ross/requirements.txt
	$(PYTHON) -m venv .venv-ross
	.venv-ross/bin/python -m pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

.venv-elasticity/ready: benchmarks/elasticity/requirements.txt
	$(PYTHON) -m venv .venv-elasticity
	.venv-elasticity/bin/python -m pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@

.venv-docs/ready: docs/requirements.txt
	$(PYTHON) -m venv .venv-docs
	.venv-docs/bin/python -m pip install --quiet --disable-pip-version-check --requirement $<
	@touch $@
