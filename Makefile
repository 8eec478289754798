# rustup puts cargo here, which is not on the PATH of every shell.
export PATH := $(PATH):$(HOME)/.cargo/bin

.PHONY: help setup viewers demo test

help:
	@echo "make demo   install what is missing, then fit and color the bundled scene"
	@echo "make test   install what is missing, then check format, lints and tests"
	@echo "make viewers   install what make test then tests splat files with: Chromium, Node, viewers"

setup:
	@python3 tools/setup.py

viewers:
	@python3 tools/setup.py --viewers

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

test: setup
	@cargo fmt --version >/dev/null 2>&1 && cargo clippy --version >/dev/null 2>&1 || rustup component add rustfmt clippy
	cargo fmt --check
	cargo clippy --release --all-targets -- -D warnings
	cargo clippy --release --lib --no-default-features -- -D warnings
	cargo test --release
