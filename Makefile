# make demo    install what is lacking, build, render the project's interior to out/
# make test    install what is lacking, run all tests; a machine without a Vulkan device fails
# make check   format, lints, tests, documentation: what a change must pass
# make bench   measure what a user waits for, on a quiet machine: a page for docs/results, in out/bench.md
# make kills   kill the program two hundred times while it saves light, and the store by itself: minutes
# make fuzz    feed spliced files to all readers, FUZZ_SECONDS each (tests/fuzz/README.md)
# make setup   only install what is lacking (make setup SETUP_FLAGS=--dry-run shows it)

CARGO ?= cargo
DEMO_SCENE ?= scenes/moonlit_library/moonlit_library.toml
DEMO_SIZE ?= 1024x768
DEMO_TIME ?= 20
SETUP_FLAGS ?=
BENCH_SCENES ?= \
	scenes/cornell_box/cornell_box.toml=out/references/cornell_box.exr \
	scenes/moonlit_library/moonlit_library.toml=out/references/moonlit_library.exr
BENCH_FLAGS ?=
BENCH_PAGE ?= out/bench.md
BENCH_PLOT ?= $(BENCH_PAGE:.md=.svg)
REFERENCE_FLAGS = --filter point --size 256x192 --pixels 8000 --spp 2048 --seed 1
# References among BENCH_SCENES that are made here.
BENCH_REFERENCES = $(foreach word,$(subst =, ,$(BENCH_SCENES)),$(filter out/references/%.exr,$(firstword $(subst .exr@,.exr ,$(word)))))

.PHONY: demo test check bench kills fuzz setup setup-tests format lint doc

demo: setup
	@mkdir -p out
	$(CARGO) run --release -- render $(DEMO_SCENE) --size $(DEMO_SIZE) --time $(DEMO_TIME) --log out/demo.csv -o out/demo.png -o out/demo.exr
	@echo "Picture: out/demo.png; linear layers: out/demo.exr; frame log: out/demo.csv, out/demo.json"

# Of address space 8 GiB: threads and the mapping of test programs take some of it.
FUZZ_SECONDS ?= 60
fuzz:
	ulimit -v 8388608; PENOMBRE_FUZZ_SECONDS=$(FUZZ_SECONDS) $(CARGO) test --test scene -- --ignored --nocapture breaks_for_long

# Written when it is whole.
bench: setup $(BENCH_REFERENCES)
	@mkdir -p $(dir $(BENCH_PAGE))
	@$(CARGO) build --release
	@{ echo "# Results, $$(date '+%-d %B %Y')"; echo; \
	   echo "**Build** $$(git describe --always --dirty)."; echo; \
	   echo "    penombre bench clock $(strip $(BENCH_SCENES) $(BENCH_FLAGS))"; echo; \
	   echo "References in out/references/ were made by"; echo; \
	   echo "    penombre reference scenes/NAME/NAME.toml $(REFERENCE_FLAGS) -o out/references/NAME.exr"; echo; \
	   $(CARGO) run --release --quiet -- bench clock $(BENCH_SCENES) $(if $(findstring .exr,$(BENCH_SCENES)),--plot $(BENCH_PLOT)) $(BENCH_FLAGS); \
	 } >$(BENCH_PAGE).part || { status=$$?; rm -f $(BENCH_PAGE).part; exit $$status; }
	@mv $(BENCH_PAGE).part $(BENCH_PAGE)
	@echo "Page: $(BENCH_PAGE), plot: $(BENCH_PLOT). If they are to stay: docs/results/$$(date +%F).md (docs/results/README.md says what belongs there)"

out/references/%.exr:
	@mkdir -p out/references
	$(CARGO) run --release -- reference scenes/$*/$*.toml $(REFERENCE_FLAGS) -o $@

# The development profile: optimised, with debug assertions, overflow checks and the validation layer.
test: setup-tests
	PENOMBRE_REQUIRE_GPU=1 $(CARGO) test
	PENOMBRE_REQUIRE_GPU=1 $(CARGO) test --features shader-reload --test shaders

kills: setup-tests
	$(CARGO) test --release --test store -- --ignored --nocapture
	PENOMBRE_REQUIRE_GPU=1 $(CARGO) test --release --test cli -- --ignored --nocapture two_hundred_killed_renders

check: format lint test doc

setup:
	@.ci/setup $(SETUP_FLAGS)

setup-tests:
	@.ci/setup --tests $(SETUP_FLAGS)

format:
	$(CARGO) fmt --check

lint:
	$(CARGO) clippy --all-targets -- -D warnings
	$(CARGO) clippy --all-targets --all-features -- -D warnings

doc:
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --no-deps
