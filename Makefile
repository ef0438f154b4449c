# make demo    install what is lacking, build, render the project's interior to out/
# make test    install what is lacking, run all tests; a machine without a Vulkan device fails
# make check   format, lints, tests, documentation: what a change must pass
# make setup   only install what is lacking (make setup SETUP_FLAGS=--dry-run shows it)

CARGO ?= cargo
DEMO_SCENE ?= scenes/moonlit_library/moonlit_library.toml
DEMO_SIZE ?= 1024x768
DEMO_TIME ?= 20
SETUP_FLAGS ?=

.PHONY: demo test check setup setup-tests format lint doc

demo: setup
	@mkdir -p out
	$(CARGO) run --release -- render $(DEMO_SCENE) --size $(DEMO_SIZE) --time $(DEMO_TIME) --log out/demo.csv -o out/demo.png -o out/demo.exr
	@echo "Picture: out/demo.png; linear layers: out/demo.exr; frame log: out/demo.csv, out/demo.json"

# The development profile: optimised, with debug assertions, overflow checks and the validation layer.
test: setup-tests
	PENOMBRE_REQUIRE_GPU=1 $(CARGO) test

check: format lint test doc

setup:
	@.ci/setup $(SETUP_FLAGS)

setup-tests:
	@.ci/setup --tests $(SETUP_FLAGS)

format:
	$(CARGO) fmt --check

lint:
	$(CARGO) clippy --all-targets -- -D warnings

doc:
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --no-deps
