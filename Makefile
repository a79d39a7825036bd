# Each target works as the first command after a clone: it makes .venv, installs clpt into it, and
# sees to an OpenCL device. Another Python: make PYTHON=python3.12 test
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SHELL := /bin/bash

# a prefix that lets apt-get install: nothing for root, sudo where it asks no password, else false
SUDO := $(shell if [ "$$(id -u)" = 0 ]; then echo env; \
	elif sudo -n true 2>/dev/null; then echo sudo -n; else echo false; fi)
APT := $(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get
# $(call apt,packages): install them, quietly; fails where that is not allowed
apt = { [ "$(SUDO)" != false ] && echo "make: apt-get install $(1)" && $(APT) update -qq >/dev/null \
	&& $(APT) install -y -qq --no-install-recommends $(1) >/dev/null; }
# tests are mostly the compiling of kernels, on one core each; neighbours in a file share theirs.
# auto: a worker more than there are cores, see tests/conftest.py
SHARED := -n auto --maxprocesses 8 --dist worksteal
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet
OFFLINE := "make: pip could not install clpt; the lines above tell why (is there a network?)"

# scene files that others made: see bench/assets.py
ASSETS ?= ../shared/assets

# the lowest versions that pyproject.toml allows, in an environment of their own
LOWEST := .venv-lowest
LOWEST_TESTS := tests/test_lowest.py tests/test_public.py tests/files/test_input_files.py tests/images \
	tests/formats/test_fuzz_formats.py tests/formats/test_files_that_change.py \
	tests/formats/meshes/test_mesh.py tests/formats/gltf/test_draco.py tests/formats/test_vdb.py \
	tests/formats/test_volumes.py tests/device/test_program.py tests/pictures/film/test_resume.py
LOWEST_SCENES := cornell_box wine_and_jade cloud prism color_checker oil_film mist

.PHONY: help demo test test-all test-lowest bench assets-report lint docs clean blender
help:
	@echo "make demo      render a scene to demo.exr and demo.png"
	@echo "make test      the tests;  make test-all  the slow ones too"
	@echo "make test-lowest  some of them with the lowest versions of all that clpt needs"
	@echo "make assets-report  which of the scenes in ASSETS=$(ASSETS) render, and how fast"
	@echo "make docs      the documentation as a site, in site/"
	@echo "make bench     measure;  make lint  ruff and mypy;  make clean  remove .venv"

demo: $(VENV)/.run
	$(BIN)/clpt render scenes/three_spheres -o demo.exr -o demo.png
	@echo "make: demo.png is there. Go on by typing:"
	@echo "          . $(VENV)/bin/activate"
	@echo "          clpt scenes"

test: $(VENV)/.dev
	$(BIN)/python -m pytest -q $(SHARED)

test-all: $(VENV)/.dev
	$(BIN)/python -m pytest -q $(SHARED) -m ""

# These versions have wheels for Python 3.10 and 3.11 alone.
test-lowest: $(VENV)/.run
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] > (3, 11))' \
		|| { echo "make: the lowest versions are for Python 3.10 or 3.11; make PYTHON=python3.11 $@"; exit 1; }
	$(PYTHON) -m venv --clear $(LOWEST)
	$(LOWEST)/bin/python -m pip --disable-pip-version-check install --quiet --prefer-binary \
		$$($(PYTHON) tests/lowest.py) hypothesis pytest pytest-rerunfailures scipy
	$(LOWEST)/bin/python -m pip --disable-pip-version-check install --quiet --no-deps --editable .
	$(LOWEST)/bin/python -m pip --disable-pip-version-check list
	$(LOWEST)/bin/python -m pytest -q $(LOWEST_TESTS)
	for scene in $(LOWEST_SCENES); do \
		$(LOWEST)/bin/clpt render scenes/$$scene --size 32x24 --spp 2 --quiet -o $(LOWEST)/$$scene.png \
			|| exit 1; \
	done

bench: $(VENV)/.dev
	ASSETS=$(ASSETS) $(BIN)/python -m bench

assets-report: $(VENV)/.dev
	$(BIN)/python -m bench.assets $(ASSETS)

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy --config-file= --strict --follow-imports=silent tests/typed_program.py

# the extension, with all wheels: Blender installs it from disk. For another system:
# make blender PLATFORM=windows-x64
blender: $(VENV)/.run
	$(BIN)/python packaging/blender_zip.py $(addprefix --platform ,$(PLATFORM))

docs: $(VENV)/.docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build
	@echo "make: see site/index.html"

clean:
	rm -rf $(VENV) $(LOWEST)

$(BIN)/python:
	@command -v $(PYTHON) >/dev/null || $(call apt,python3) \
		|| { echo "make: there is no $(PYTHON); install Python 3.10 or newer" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' \
		|| { echo "make: $(PYTHON) is older than 3.10; try make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null \
		|| $(call apt,python3-venv) \
		|| { echo "make: $(PYTHON) has no venv; run apt-get install python3-venv" >&2; exit 1; }
	@echo "make: setting up $(VENV)"
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

$(VENV)/.run: pyproject.toml | $(BIN)/python
	@$(PIP) --editable . || { echo $(OFFLINE) >&2; exit 1; }
	@$(MAKE) --no-print-directory $(VENV)/.opencl
	@touch $@

$(VENV)/.dev: pyproject.toml | $(BIN)/python
	@$(PIP) --editable '.[dev,peers]' \
		|| { echo "make: going on without the renderers that tests compare with"; \
			$(PIP) --editable '.[dev]'; } \
		|| { echo $(OFFLINE) >&2; exit 1; }
	@$(MAKE) --no-print-directory $(VENV)/.opencl
	@touch $@

$(VENV)/.docs: $(VENV)/.run
	@$(PIP) --editable '.[docs]' || { echo $(OFFLINE) >&2; exit 1; }
	@touch $@

# a device that runs a kernel; else PoCL by apt-get; else Intel's CPU runtime by pip
WORKS := $(BIN)/python -c 'from clpt.device.choosing import selection; selection()'
$(VENV)/.opencl:
	@$(WORKS) 2>/dev/null \
		|| { $(call apt,pocl-opencl-icd) && $(WORKS) 2>/dev/null; } \
		|| { echo "make: pip install clpt[cpu]" && $(PIP) --editable '.[cpu]' && $(WORKS); } \
		|| { echo "make: no OpenCL device; install a driver, e.g. apt-get install pocl-opencl-icd," \
			"and see $(BIN)/clpt devices" >&2; exit 1; }
	@touch $@
