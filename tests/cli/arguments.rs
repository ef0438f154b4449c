//! What was typed: every option reaches its field, every mistake is a message.

use clap::{CommandFactory as _, Parser as _};
use penombre::cli::args::bench::Study;
use penombre::cli::args::reference::{PixelFilter, ReferenceArgs};
use penombre::cli::args::{Cli, Command, RenderArgs};
use penombre::estimate::hemisphere::Method;
use penombre::pass::UpdateMode;
use penombre::refine::options::{Piece, Pieces, Priority};
use penombre::scene::camera::ImageSize;
use penombre::scene::{Display, ToneMapping};
use penombre::session::{Batches, Budget, Options, Pace, PixelCounts, Quality, Thresholds};
use std::path::PathBuf;
use std::time::Duration;

fn parse(line: &str) -> Result<Command, clap::Error> {
    let words = std::iter::once("penombre").chain(line.split_whitespace());
    Cli::try_parse_from(words).map(|cli| cli.command)
}

fn render(line: &str) -> RenderArgs {
    match parse(&format!("render {line}")) {
        Ok(Command::Render(args)) => args,
        other => panic!("{line}: {other:?}"),
    }
}

fn reference(line: &str) -> ReferenceArgs {
    match parse(&format!("reference {line}")) {
        Ok(Command::Reference(args)) => args,
        other => panic!("{line}: {other:?}"),
    }
}

fn refused(line: &str) -> String {
    let error = parse(line).err().unwrap_or_else(|| panic!("{line}: accepted"));
    assert_eq!(error.exit_code(), 2, "{line}");
    error.to_string()
}

#[test]
fn the_definition_is_sound() {
    Cli::command().debug_assert();
}

#[test]
fn render_needs_a_scene_and_an_output_only() {
    let args = render("scene.toml -o a.exr");
    assert_eq!(args.scene.path, PathBuf::from("scene.toml"));
    assert_eq!(args.scene.size, ImageSize { width: 1024, height: 768 });
    assert_eq!(args.output.paths, [PathBuf::from("a.exr")]);
    assert_eq!((args.output.exposure, args.output.tone_mapping), (None, None), "the scene's");
    assert_eq!((args.update, args.output.aa, args.refresh), (UpdateMode::Id, 1, None));
    assert_eq!((args.engine.threads, args.engine.seed, args.engine.deterministic), (None, 0, false));
    assert!(args.budget.time.is_none() && args.budget.frames.is_none() && args.log.is_none());
    assert!(refused("render -o a.exr").contains("SCENE"));
    assert!(refused("render a.obj").contains("OUT"));
}

#[test]
fn what_is_not_typed_is_as_sessions_have_it() {
    // The memory is half of what is free.
    let plain = Options { memory: None, ..render("scene.toml -o a.exr").options() };
    assert_eq!(plain, Options::default());
    assert_eq!(render("scene.toml -o a.exr --memory 64").options().memory, Some(64 << 20));
    let path = render("scene.toml -o a.exr --camera-path p.toml --frames 9").options();
    let path = Options { memory: None, ..path };
    let budget = Budget { error: Some(0.01), ..Budget::default() };
    assert_eq!(path, Options { budget, ..Options::default() }, "frames are no limit for a picture");
    let error = |line: &str| render(&format!("s.obj -o a.exr {line}")).options().budget.error;
    assert_eq!([error("--frames 9"), error("--rays 9"), error("--error 0.2 --rays 9")], [None, None, Some(0.2)]);
}

#[test]
fn presets_of_quality_give_way_to_what_is_typed() {
    let refinement = |line: &str| render(&format!("s.obj -o a.exr {line}")).options().refinement;
    for (name, quality) in Quality::NAMES {
        let options = render(&format!("s.obj -o a.exr --quality {name}")).options();
        assert_eq!(options.refinement.thresholds, quality.thresholds());
        assert_eq!(options.budget.error, Some(quality.error()));
    }
    let mixed = refinement("--min-pixels 0.5 --quality draft --shadow-size 2");
    assert_eq!(mixed.thresholds, Thresholds { min_pixels: 0.5, ..Quality::Draft.thresholds() });
    assert_eq!(mixed.shadow_size, Some(2.0));
    assert_eq!(refinement("--quality final --contrast 0.2").thresholds.contrast, 0.2);
    let comments = |line: &str| render(&format!("s.obj -o a.exr {line}")).image_options();
    assert!(comments("--quality final").contains(" --quality final"));
    assert_eq!(comments("--quality normal"), comments(""));
}

#[test]
fn every_option_of_render_reaches_its_field() {
    let args = render(
        "s.obj -o a.exr -o b.PNG --size 640x480 --camera desk --device llvm --threads 2 --seed 7 --update id \
         --log f.csv --reference r.exr --exposure -1.5 --tone-mapping pbr-neutral --aa 16 --refresh 20 -v \
         --time 2.5 --frames 3 --rays 4 --error 0.05",
    );
    assert_eq!(args.output.paths, ["a.exr", "b.PNG"].map(PathBuf::from));
    assert_eq!(args.scene.size, ImageSize { width: 640, height: 480 });
    assert_eq!(args.scene.camera.as_deref(), Some("desk"));
    assert_eq!(args.device.device.as_deref(), Some("llvm"));
    assert_eq!((args.engine.threads, args.engine.seed), (Some(2), 7));
    assert_eq!(args.update, UpdateMode::Id);
    assert_eq!((args.log, args.reference), (Some("f.csv".into()), Some("r.exr".into())));
    assert_eq!((args.output.exposure, args.output.tone_mapping), (Some(-1.5), Some(ToneMapping::PbrNeutral)));
    assert_eq!((args.output.aa, args.refresh), (16, Some(Duration::from_millis(20))));
    assert!(args.verbosity.verbose && !args.verbosity.quiet);
    assert_eq!(args.budget.time, Some(Duration::from_millis(2500)));
    assert_eq!((args.budget.frames, args.budget.rays, args.budget.error), (Some(3), Some(4), Some(0.05)));
    let args = render("s.obj -o a.exr --deterministic -q --direct-only --no-filter --pixel-counts atomic");
    assert!(args.engine.deterministic);
    let options = args.options();
    assert_eq!((options.pace, options.pixel_counts), (Pace::Fixed(Batches::A_FRAME), PixelCounts::Atomic));
    assert!(!options.refinement.indirect && !options.refinement.filter);
}

#[test]
fn tone_mapping_takes_every_name_of_the_scene_file() {
    for (name, operator) in ToneMapping::NAMES {
        let args = render(&format!("s.obj -o a.png --tone-mapping {name}"));
        assert_eq!(args.output.tone_mapping, Some(operator));
    }
}

#[test]
fn mistakes_are_refused_with_the_option_and_what_would_be_right() {
    for (options, message) in [
        ("--size 640", "1024x768"),
        ("--size 0x1", "from 1 to 16384"),
        ("--threads 0", "1..=256"),
        ("--threads 257", "1..=256"),
        ("--aa 0", "1..=1024"),
        ("--seed -1", "--seed"),
        ("--time 0", "more than 0"),
        ("--time -1", "more than 0"),
        ("--time nan", "more than 0"),
        ("--frames 0", "--frames"),
        ("--error inf", "more than 0"),
        ("--exposure 1e9", "-64 to 64"),
        ("--tone-mapping filmic", "agx"),
        ("--update ids", "stencil"),
        ("--log frames.txt", ".csv"),
        ("--reference r.exr", "--log"),
        ("--deterministic --time 1", "--deterministic"),
        ("-v -q", "--quiet"),
        ("-o b.jpg", ".png"),
        ("--hemisphere", "--hemisphere"),
        ("--quality best", "final"),
    ] {
        let text = refused(&format!("render s.obj -o a.exr {options}"));
        assert!(text.contains(message), "{options}: {text}");
    }
}

#[test]
fn commands_that_do_not_exist_are_usage_errors() {
    for command in ["backe", "rendre"] {
        let text = refused(&format!("{command} a b"));
        assert!(text.contains("unrecognized subcommand"), "{text}");
    }
    assert!(refused("").contains("Usage"));
}

#[test]
fn every_option_of_diff_arrives() {
    let line = "diff a.exr b.exr --mask m.png -o d.png --json --epsilon-absolute 0.01 --exposure -1 --tone-mapping agx \
        --max-rmse 1 --max-relmse 2 --max-flip 3 --max-mean-shift 4";
    let Ok(Command::Diff(args)) = parse(line) else { panic!("{line}") };
    assert_eq!((args.image, args.reference), ("a.exr".into(), "b.exr".into()));
    assert_eq!((args.mask, args.output), (Some("m.png".into()), Some("d.png".into())));
    assert!(args.json);
    assert_eq!(
        (args.epsilon_absolute, args.exposure, args.tone_mapping),
        (Some(0.01), Some(-1.0), Some(ToneMapping::Agx))
    );
    let limits = [args.limits.max_rmse, args.limits.max_relmse, args.limits.max_flip, args.limits.max_mean_shift];
    assert_eq!(limits, [1.0, 2.0, 3.0, 4.0].map(Some));
    assert!(refused("diff a.exr").contains("<B>"));
}

#[test]
fn every_option_of_bench_arrives() {
    let line = "bench s.toml --camera c --json --threads 3 --seed 5 -q";
    let Ok(Command::Bench(args)) = parse(line) else { panic!("{line}") };
    assert_eq!((args.scene, args.camera.as_deref()), (Some("s.toml".into()), Some("c")));
    assert_eq!((args.json, args.cpu.threads, args.cpu.seed, args.cpu.verbosity.quiet), (true, Some(3), 5, true));
    let Ok(Command::Bench(args)) = parse("bench") else { panic!("no scene") };
    assert_eq!((args.scene, args.cpu.seed), (None, 0));
}

#[test]
fn every_option_of_bench_convergence_arrives() {
    let convergence = |options: &str| {
        let line = format!("bench convergence s.toml --reference r.exr {options}");
        match parse(&line) {
            Ok(Command::Bench(args)) => match args.study {
                Some(Study::Convergence(args)) => args,
                other => panic!("{line}: {other:?}"),
            },
            other => panic!("{line}: {other:?}"),
        }
    };
    let args = convergence(
        "--camera c --time 2.5 --filtered --match-method --json --plot p.svg --threads 3 --seed 5 -q --min-pixels 0 \
         --hemisphere paper --priority random --device llvm",
    );
    assert_eq!((args.scene, args.camera.as_deref()), ("s.toml".into(), Some("c")));
    assert_eq!((args.reference, args.plot), ("r.exr".into(), Some("p.svg".into())));
    assert_eq!((args.time, args.filtered, args.match_method), (Duration::from_millis(2500), true, true));
    assert_eq!((args.json, args.cpu.threads, args.cpu.seed, args.cpu.verbosity.quiet), (true, Some(3), 5, true));
    assert_eq!((args.refinement.min_pixels, args.device.device.as_deref()), (Some(0.0), Some("llvm")));
    assert_eq!((args.refinement.hemisphere, args.refinement.priority), (Method::Paper, Priority::Random));
    let args = convergence("");
    assert_eq!((args.time, args.filtered, args.plot), (Duration::from_secs(10), false, None));
    for (line, part) in [
        ("bench convergence s.toml", "--reference"),
        ("bench convergence --reference r.exr", "SCENE"),
        ("bench convergence s.toml --reference r.exr --plot p.png", ".svg"),
        ("bench convergence s.toml --reference r.png", ".exr"),
        ("bench convergence s.toml --reference r.exr --direct-only --match-method", "cannot be used with"),
        ("bench s.toml --min-pixels 0", "--min-pixels"),
    ] {
        assert!(refused(line).contains(part), "{line}");
    }
    assert!(convergence("--plot r.exr.svg").check().is_ok());
}

#[test]
fn every_option_of_bench_ablate_arrives() {
    let ablate = |options: &str| {
        let line = format!("bench ablate s.toml=r.exr t.obj=q.exr@left {options}");
        match parse(&line) {
            Ok(Command::Bench(args)) => match args.study {
                Some(Study::Ablate(args)) => args,
                other => panic!("{line}: {other:?}"),
            },
            other => panic!("{line}: {other:?}"),
        }
    };
    let args = ablate(
        "--pieces checks,filter --pieces checks --seeds 2 --rays 5000,1000,5000 --trim 0.05 --filtered --json --seed 5 -q --without darks \
         --device llvm",
    );
    let scenes: Vec<_> =
        args.scenes.iter().map(|s| (s.path.to_str(), s.reference.to_str(), s.camera.as_deref())).collect();
    assert_eq!(scenes, [(Some("s.toml"), Some("r.exr"), None), (Some("t.obj"), Some("q.exr"), Some("left"))]);
    assert_eq!((args.pieces(), args.rays()), (vec![Piece::Filter, Piece::Checks], vec![1000, 5000]));
    assert_eq!((args.seeds, args.trim, args.filtered, args.json), (2, 0.05, true, true));
    assert_eq!((args.cpu.seed, args.cpu.verbosity.quiet, args.device.device.as_deref()), (5, true, Some("llvm")));
    assert_eq!(args.refinement.without().to_string(), "darks");
    let args = ablate("");
    assert_eq!(
        (args.pieces().len(), args.rays(), args.seeds, args.trim),
        (Piece::NAMES.len(), vec![1_000_000], 3, 0.01)
    );
    for (line, part) in [
        ("bench ablate", "SCENE=REF.exr"),
        ("bench ablate s.toml", "expected SCENE=REF.exr"),
        ("bench ablate s.toml=r.exr --pieces check", "'checks'"),
        ("bench ablate s.toml=r.exr --seeds 0", "--seeds"),
        ("bench ablate s.toml=r.exr --rays 0", "--rays"),
        ("bench ablate s.toml=r.exr --trim 1", "less than 1"),
    ] {
        assert!(refused(line).contains(part), "{line}: {}", refused(line));
    }
}

#[test]
fn pieces_are_taken_out_by_names_that_help_does_not_list() {
    assert_eq!(render("s.obj -o a.exr").refinement.without(), Pieces::default());
    for (name, piece) in Piece::NAMES {
        assert_eq!(
            render(&format!("s.obj -o a.exr --without {name}")).refinement.without(),
            Pieces::default().with(piece)
        );
    }
    let args = render("s.obj -o a.exr --without radiance-grid,darks");
    assert!(args.image_options().ends_with("--without radiance-grid,darks"), "{}", args.image_options());
    assert!(refused("render s.obj -o a.exr --without radiance-gird").contains("similar value exists: 'radiance-grid'"));
    let help = parse("render --help").expect_err("help").to_string();
    assert!(help.contains("--priority") && !help.contains("--without"));
}

#[test]
fn reference_options() {
    let args = reference("s.toml -o r.exr --direct-only --spp 64 --filter point --threads 3 --seed 5 --size 8x4");
    assert!(args.direct_only && !args.match_method);
    assert_eq!((args.spp, args.filter, args.cpu.threads, args.cpu.seed), (Some(64), PixelFilter::Point, Some(3), 5));
    assert_eq!(args.max_spp(), 64);

    let args = reference("s.toml -o r.exr");
    assert_eq!((args.filter, args.max_spp()), (PixelFilter::Box, 256));
    assert!(!args.direct_only && !args.match_method);
    assert!(reference("s.toml -o r.exr --match-method").match_method);
    assert!(refused("reference s.toml -o r.exr --match-method --direct-only").contains("cannot be used with"));
    assert_eq!(reference("s.toml -o r.exr --time 5").max_spp(), u32::MAX);
    assert!(refused("reference s.toml -o r.png").contains(".exr"));
    assert!(refused("reference s.toml -o r.exr --spp 0").contains("--spp"));

    let args = reference("s.toml -o r.exr --size 8x4 --pixels 32");
    assert_eq!((args.pixels, args.check().is_ok()), (Some(32), true));
    let message = reference("s.toml -o r.exr --size 8x4 --pixels 33").check().expect_err("too many").to_string();
    assert!(message.contains("--pixels 33: the image has 32"), "{message}");
    for bad in ["0", "-1", "1.5", "x", "5000000000"] {
        assert!(refused(&format!("reference s.toml -o r.exr --pixels {bad}")).contains("--pixels"), "{bad}");
    }
}

#[test]
fn outputs_are_checked_before_any_work() {
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let check = |line: String| render(&line).check_outputs().map_err(|e| e.to_string());
    assert_eq!(check(format!("s.obj -o {} -o {} --log {}", at("a.exr"), at("a.png"), at("a.csv"))), Ok(()));
    let refused = check(format!("s.obj -o {} --log {}", at("a.exr"), at("no/a.csv"))).expect_err("no folder");
    assert_eq!(refused.lines().count(), 2, "the log and its summary: {refused}");
    let options = format!("s.obj -o {} --log {} --reference {}", at("r.exr"), at("a.csv"), at("./r.exr"));
    assert!(check(options).expect_err("replaced").contains("both the reference and an output"));
    assert!(reference(&format!("s.obj -o {}", at("no/r.exr"))).check().is_err());
}

#[test]
fn display_is_as_asked_or_as_the_scene_says() {
    let scene = Display { exposure: 2.0, tone_mapping: ToneMapping::Agx };
    assert_eq!(render("s.obj -o a.png").output.display(&scene), scene);
    let asked = render("s.obj -o a.png --exposure -1 --tone-mapping clamp").output.display(&scene);
    assert_eq!(asked, Display { exposure: -1.0, tone_mapping: ToneMapping::Clamp });
}

#[test]
fn image_options_hold_what_makes_the_image_and_nothing_else() {
    let one = render("a/s.toml -o x.exr --threads 1 --size 8x4 --seed 3 --camera c --frames 9 --deterministic");
    let two = render("b/s.toml -o y.exr -o z.png --threads 2 --size 8x4 --seed 3 --camera c --frames 9 --log l.csv");
    assert_eq!(one.image_options(), two.image_options());
    assert_eq!(
        one.image_options(),
        "penombre render s.toml --size 8x4 --camera c --seed 3 --update id --aa 1 --frames 9"
    );
    let args = reference("s.toml -o r.exr --direct-only --size 8x4 --time 3 --threads 2");
    assert_eq!(args.image_options(), "penombre reference s.toml --size 8x4 --seed 0 --direct-only --filter box");
    let args = reference("s.toml -o r.exr --match-method --size 8x4 --filter point");
    assert_eq!(args.image_options(), "penombre reference s.toml --size 8x4 --seed 0 --match-method --filter point");
    let args = reference("s.toml -o r.exr --size 8x4 --pixels 7");
    assert_eq!(args.image_options(), "penombre reference s.toml --size 8x4 --seed 0 --filter box --pixels 7");
}
