# rustup puts cargo here, which is not on the PATH of every shell.
export PATH := $(PATH):$(HOME)/.cargo/bin

.PHONY: help setup setup-all demo test test-all lint prose

help:
	@echo "make demo   install what is missing, then fit and color the bundled scene"
	@echo "make test   install what is missing, then check format, lints and tests"
	@echo "make test-all   the same, also rare and slow tests, with COLMAP, FFmpeg, browsers, viewers"
	@echo "make prose  lint the documentation, if proselint is installed (pip install proselint)"

setup:
	@python3 tools/setup.py

setup-all:
	@python3 tools/setup.py --all

demo: setup
	cargo build --release
	rm -rf runs/demo
	cargo run --release --quiet -- fit assets/demo -o runs/demo
	cargo run --release --quiet -- colorize runs/demo --teacher assets/teacher/demo-teacher.onnx
	@echo
	@echo "Gray scene:      runs/demo/luma.ply"
	@echo "Colored scene:   runs/demo/color.ply"
	@echo "Contact sheet:   runs/demo/contact-sheet.png"
	@echo "In the browser:  target/release/gs-chroma view runs/demo"

# Two more than there are cores, for tests wait for programs and devices.
TEST_THREADS = $(shell echo $$(($$(getconf _NPROCESSORS_ONLN) + 2)))

# Programs that tests give another cache folder share what Mesa compiled for the others.
test test-all: export MESA_SHADER_CACHE_DIR := $(CURDIR)/target/mesa
test test-all: export RUST_TEST_THREADS := $(TEST_THREADS)
test: setup lint
	@python3 tools/test_python.py
	cargo test

# A missing program fails a test here. `PYTHON` has OpenUSD.
test-all: export PYTHON := $(CURDIR)/target/test-all/bin/python
test-all: export PATH := $(CURDIR)/target/test-all/bin:$(PATH)
test-all: setup-all lint
	cargo clippy --lib --test fuzz --no-default-features -- -D warnings
	cargo test --workspace -- --include-ignored
	cargo clippy --package gs-chroma-python -- -D warnings
	$(PYTHON) tools/test_python.py
	tools/check_package.sh
	$(if $(filter-out 0,$(shell id -u)),sudo -n --preserve-env=HOME) tools/bare_machine.sh

lint:
	@cargo fmt --version >/dev/null 2>&1 && cargo clippy --version >/dev/null 2>&1 || rustup component add rustfmt clippy
	cargo fmt --all --check
	cargo clippy --all-targets -- -D warnings
	@$(MAKE) --no-print-directory prose

# The style guide's list of words is no prose.
PROSE = README.md $(shell find docs -name '*.md' -not -name style.md)

prose:
	@if command -v proselint >/dev/null; then proselint check --config docs/proselint.json $(PROSE); \
	else echo "proselint is not installed: prose is not linted"; fi
