//! What `bench clock` found as tables, in Markdown: a results page takes them as they are.

use super::report::{Cost, Document, Errors, MemoryFigures, SceneDocument, Stages, Target, Threads};
use crate::bench::Figure;
use std::path::Path;

/// A table with its columns aligned, the first to the left.
struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new<const N: usize>(header: [&str; N]) -> Self {
        Self { rows: vec![header.map(str::to_owned).to_vec()] }
    }

    fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.to_vec());
    }

    fn text(&self) -> String {
        let columns = self.rows.first().map_or(0, Vec::len);
        let width = |column: usize| self.rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0).max(3);
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let rule: Vec<String> = widths.iter().map(|&width| format!("{}:", "-".repeat(width - 1))).collect();
        let mut text = String::new();
        for (index, row) in self.rows.iter().enumerate() {
            text += &line(row, &widths);
            if index == 0 {
                text += &line(&rule, &widths).replacen("-:", "--", 1);
            }
        }
        text
    }
}

fn line(cells: &[String], widths: &[usize]) -> String {
    let cell = |(index, (text, &width)): (usize, (&String, &usize))| {
        if index == 0 { format!("| {text:<width$} |") } else { format!(" {text:>width$} |") }
    };
    cells.iter().zip(widths).enumerate().map(cell).collect::<String>() + "\n"
}

/// All tables.
#[must_use]
pub fn text(document: &Document) -> String {
    let names = names(&document.scenes);
    let scenes = || names.iter().map(String::as_str).zip(&document.scenes);
    let [width, height] = document.size;
    let whole = format!("    penombre render SCENE --size {width}x{height} --rays {} -o out.exr\n", document.rays);
    let mut text = head(document) + &scene_list(scenes());
    text += &format!("\n## First pictures\n\n{whole}\nSeconds from the start of the process.\n\n");
    text += &stage_table(scenes()).text();
    if document.scenes.iter().any(|scene| scene.errors.is_some()) {
        text += "\n## Error by wall clock\n\n    penombre render SCENE --size SIZE --time T -o out.exr\n\n\
            Seconds of the whole process; the reference's own noise is taken off.\n\n";
        text += &error_table(scenes()).text();
        text +=
            "\nSeconds of the whole process to a relMSE, between the runs above by straight lines of logarithms.\n\n";
        text += &target_table(scenes()).text();
    }
    text += &format!("\n## Where the time goes\n\n{whole}\nCPU seconds by threads, as long as there is an engine.\n\n");
    text += &thread_table(scenes()).text();
    text += &format!("\n## Memory\n\n{whole}\nBytes a leaf are the light engine's, all of them.\n\n");
    text += &memory_table(scenes()).text();
    text += &format!(
        "\n## Camera moves\n\nMilliseconds of a move, drawn at once while the engine works: {width}x{height}, {} rays shared out among the pictures.\n\n",
        document.rays
    );
    text + &move_table(scenes()).text()
}

/// What ran, and on what.
fn head(document: &Document) -> String {
    const GIB: f64 = (1_u64 << 30) as f64;
    let Document { version, machine, device, driver, threads, seed, runs, .. } = document;
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    let load = |load: Option<f32>| or_dash(load.map(|load| format!("{load:.2}")));
    format!(
        "**Machine** {} cores of {}, {} memory, {}; {device}, {driver}.\n**Load average** {} before, {} after. \
         penombre {version}, threads: {threads}, runs: {runs}, of seeds from {seed}: medians, ± how far the furthest run lies from them.\n\n",
        machine.cores,
        machine.processor.as_deref().unwrap_or("a processor without a name"),
        or_dash(machine.memory.map(|bytes| format!("{:.0} GiB", bytes as f64 / GIB))),
        machine.system,
        load(document.load_average_before),
        load(document.load_average_after),
    )
}

/// Short names of scenes: the file's, with its folder's where others have that, too, or the whole path.
fn names(scenes: &[SceneDocument]) -> Vec<String> {
    let tails = |count: usize| scenes.iter().map(|scene| tail(&scene.scene, count)).collect::<Vec<_>>();
    let all = [tails(1), tails(2)];
    let name = |(index, scene): (usize, &SceneDocument)| {
        let is_unique = |names: &&Vec<String>| names.iter().filter(|name| **name == names[index]).count() == 1;
        all.iter().find(is_unique).map_or_else(|| scene.scene.clone(), |names| names[index].clone())
    };
    scenes.iter().enumerate().map(name).collect()
}

/// The last parts of a path with a camera behind it, without the file's extension.
fn tail(scene: &str, parts: usize) -> String {
    let (path, camera) =
        scene.rsplit_once('@').map_or((scene, String::new()), |(path, camera)| (path, format!("@{camera}")));
    let stem = Path::new(path).with_extension("");
    let named: Vec<_> = stem.iter().map(|part| part.to_string_lossy()).collect();
    named[named.len().saturating_sub(parts)..].join("/") + &camera
}

/// A figure with how far the furthest run lies from it.
fn cell(figure: Option<Figure>, number: impl Fn(f64) -> String) -> String {
    match figure {
        None => "-".to_owned(),
        Some(Figure { median, spread }) if spread > 0.0 && spread.is_finite() => {
            format!("{} ±{:.0}%", number(median), spread * 100.0)
        }
        Some(Figure { median, .. }) => number(median),
    }
}

fn seconds(figure: Option<Figure>) -> String {
    cell(figure, |value| format!("{value:.2}"))
}

fn percent(figure: Option<Figure>) -> String {
    cell(figure, |value| format!("{:.0} %", value * 100.0))
}

fn mebibytes(figure: Option<Figure>) -> String {
    cell(figure, |value| format!("{:.0}", value / f64::from(1 << 20)))
}

fn whole(figure: Option<Figure>) -> String {
    cell(figure, |value| format!("{value:.0}"))
}

/// A line a scene: what it is, and what its errors are measured against.
fn scene_list<'a>(scenes: impl Iterator<Item = (&'a str, &'a SceneDocument)>) -> String {
    let against = |errors: &Errors| {
        let Errors { reference, size: [width, height], compared, own_relmse, .. } = errors;
        let own = if *own_relmse > 0.0 { format!("{own_relmse:.1e}") } else { "not known".to_owned() };
        format!("; against `{reference}`, {width}x{height}, {compared} pixels compared, its own relMSE {own}")
    };
    let line = |(name, scene): (&str, &SceneDocument)| {
        let against = scene.errors.as_ref().map_or_else(String::new, against);
        format!("- {name}: `{}`, {} triangles{against}\n", scene.scene, scene.triangles)
    };
    scenes.map(line).collect()
}

fn stage_table<'a>(scenes: impl Iterator<Item = (&'a str, &'a SceneDocument)>) -> Table {
    let mut table = Table::new(["scene", "clock", "first frame", "first light", "complete", "last frame", "end"]);
    for (name, scene) in scenes {
        let run = &scene.whole_run;
        for (name, clock, stages) in [(name, "wall", &run.wall_seconds), ("", "CPU", &run.cpu_seconds)] {
            let Stages { first_frame, lit_frame, complete_frame, last_frame, end } = *stages;
            let [first, lit, complete, last, end] =
                [first_frame, lit_frame, complete_frame, last_frame, end].map(seconds);
            table.row([name.to_owned(), clock.to_owned(), first, lit, complete, last, end]);
        }
    }
    table
}

fn error_table<'a>(scenes: impl Iterator<Item = (&'a str, &'a SceneDocument)>) -> Table {
    let mut table = Table::new(["scene", "T", "wall s", "CPU s", "engine's CPU s", "relMSE", "mean shift"]);
    for (name, scene) in scenes {
        for (index, point) in scene.errors.iter().flat_map(|errors| &errors.points).enumerate() {
            let relmse = |value: f64| if value > 0.0 { format!("{value:.1e}") } else { "noise".to_owned() };
            table.row([
                if index == 0 { name.to_owned() } else { String::new() },
                point.time.to_string(),
                seconds(point.wall_seconds),
                seconds(point.cpu_seconds),
                seconds(point.light_cpu_seconds),
                cell(point.relmse, relmse),
                format!("{:+.1} %", point.mean_shift * 100.0),
            ]);
        }
    }
    table
}

fn target_table<'a>(scenes: impl Iterator<Item = (&'a str, &'a SceneDocument)>) -> Table {
    let mut table = Table::new(["scene", "relMSE", "wall s", "CPU s"]);
    for (name, scene) in scenes {
        for (index, target) in scene.errors.iter().flat_map(|errors| &errors.targets).enumerate() {
            let Target { relmse, wall_seconds, cpu_seconds, at_most } = *target;
            let time = |figure: Option<Figure>| {
                let bound = if at_most { "≤ " } else { "" };
                figure.map_or_else(|| "not reached".to_owned(), |_| format!("{bound}{}", seconds(figure)))
            };
            let name = if index == 0 { name.to_owned() } else { String::new() };
            table.row([name, format!("{relmse:.0e}"), time(wall_seconds), time(cpu_seconds)]);
        }
    }
    table
}

fn thread_table<'a>(scenes: impl Iterator<Item = (&'a str, &'a SceneDocument)>) -> Table {
    let mut table = Table::new([
        "scene",
        "tracing",
        "engine's own",
        "main",
        "rasteriser, driver",
        "set-up",
        "tracing share",
        "serial share",
        "cores refining",
    ]);
    for (name, scene) in scenes {
        let of = |figure: fn(&Threads) -> Figure| scene.whole_run.threads.as_ref().map(figure);
        table.row([
            name.to_owned(),
            seconds(of(|threads| threads.tracing)),
            seconds(of(|threads| threads.engine)),
            seconds(of(|threads| threads.main)),
            seconds(of(|threads| threads.rasteriser)),
            seconds(of(|threads| threads.ended)),
            percent(of(|threads| threads.tracing_share)),
            percent(of(|threads| threads.serial_share)),
            seconds(scene.whole_run.cores_refining),
        ]);
    }
    table
}

fn memory_table<'a>(scenes: impl Iterator<Item = (&'a str, &'a SceneDocument)>) -> Table {
    let mut table =
        Table::new(["scene", "leaves", "bytes a leaf", "cache MiB", "device MiB", "peak of the process MiB"]);
    for (name, scene) in scenes {
        let MemoryFigures { triangles, bytes_a_triangle, cache_bytes, device_bytes, peak_bytes } =
            scene.whole_run.memory;
        let [cache, device, peak] = [cache_bytes, device_bytes, peak_bytes].map(mebibytes);
        table.row([name.to_owned(), whole(triangles), whole(bytes_a_triangle), cache, device, peak]);
    }
    table
}

fn move_table<'a>(scenes: impl Iterator<Item = (&'a str, &'a SceneDocument)>) -> Table {
    let mut table = Table::new(["scene", "walk", "of a move", "median", "worst"]);
    for (name, scene) in scenes {
        let moves = &scene.moves;
        let path = moves.camera_path.as_deref().unwrap_or("about the camera");
        let walk = format!("{path}, {} pictures", moves.pictures);
        for (name, walk, what, cost) in [
            (name, walk.as_str(), "engine's CPU ms", &moves.engine_ms),
            ("", "", "device ms", &moves.device_ms),
            ("", "", "wall ms to its picture", &moves.wall_ms),
        ] {
            let of = |figure: fn(&Cost) -> Figure| cell(cost.as_ref().map(figure), |ms| format!("{ms:.1}"));
            let [median, worst] = [of(|cost| cost.median), of(|cost| cost.worst)];
            table.row([name.to_owned(), walk.to_owned(), what.to_owned(), median, worst]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_as_markdown_wants_them() {
        let mut table = Table::new(["scene", "±"]);
        table.row(["a".to_owned(), "1.25 ±3%".to_owned()]);
        assert_eq!(table.text(), "| scene |        ± |\n| ----- | -------: |\n| a     | 1.25 ±3% |\n");
    }

    #[test]
    fn scenes_are_called_by_the_end_of_their_paths() {
        let names = [1, 2].map(|parts| tail("a/b/scene.v2.toml@left", parts));
        assert_eq!(names, ["scene.v2@left", "b/scene.v2@left"]);
        assert_eq!([1, 9].map(|parts| tail("box.obj", parts)), ["box", "box"]);
    }

    #[test]
    fn figures_say_how_sure_they_are() {
        let figure = |values: &[f64]| Some(Figure::of(values.to_vec()));
        assert_eq!(seconds(figure(&[2.0, 1.0, 1.9])), "1.90 ±47%");
        assert_eq!(
            (seconds(figure(&[1.0])), seconds(None), whole(figure(&[0.0]))),
            ("1.00".into(), "-".into(), "0".into())
        );
        assert_eq!(
            (percent(figure(&[0.25])), seconds(figure(&[1.0, 1.0, f64::INFINITY]))),
            ("25 %".into(), "1.00".into())
        );
    }
}
