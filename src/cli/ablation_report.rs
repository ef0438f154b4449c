//! What `bench ablate` found: tables, JSON.

use super::args::ablate::AblateArgs;
use super::values::AblatedScene;
use crate::bench::ablation::{Measured, Spread};
use crate::bench::reference_pixels::ReferencePixels;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::session::thread_count;
use serde::Serialize;

/// All that was found; the JSON of `--json` has these names.
#[derive(Clone, Debug, Serialize)]
pub struct Document {
    device: String,
    threads: usize,
    /// The first seed, and how many there are.
    seed: u64,
    seeds: u64,
    /// Whether indirect light was shown filtered.
    filtered: bool,
    /// Share of the pixels that trimmed errors leave out.
    trim: f64,
    /// Scene by scene.
    pub scenes: Vec<SceneDocument>,
}

/// What was found in a scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneDocument {
    scene: String,
    reference: String,
    size: [u32; 2],
    triangles: usize,
    /// Pixels compared.
    compared: usize,
    /// relMSE that the reference's own noise makes, by its variance; taken off all errors.
    own_relmse: f64,
    /// By number of rays.
    tables: Vec<Table>,
}

/// What was found after some rays.
#[derive(Clone, Debug, Serialize)]
struct Table {
    rays: u64,
    /// With all pieces.
    with_all: Figures,
    pieces: Vec<PieceDocument>,
}

/// Errors over the seeds, and each.
#[derive(Clone, Debug, Serialize)]
struct Figures {
    relmse: Spread,
    trimmed: Spread,
    mean_shift: Spread,
    runs: Vec<Measured>,
}

/// What a piece does.
#[derive(Clone, Debug, Serialize)]
struct PieceDocument {
    piece: &'static str,
    /// Error without the piece over that with it, of the same seed; `null` where the latter is lost in the reference's noise.
    relmse: Option<Spread>,
    trimmed: Option<Spread>,
    /// Without the piece.
    mean_shift: Spread,
    with: Vec<Measured>,
    without: Vec<Measured>,
}

/// The runs with a piece and without it, by seed, then by number of rays.
pub struct Row {
    /// Name of the piece.
    pub piece: &'static str,
    /// With it.
    pub with: Vec<Vec<Measured>>,
    /// Without it.
    pub without: Vec<Vec<Measured>>,
}

impl Document {
    /// Nothing measured yet.
    #[must_use]
    pub fn new(args: &AblateArgs, device: &str) -> Self {
        Self {
            device: device.to_owned(),
            threads: thread_count(args.cpu.threads),
            seed: args.cpu.seed,
            seeds: args.seeds,
            filtered: args.filtered,
            trim: args.trim,
            scenes: Vec::new(),
        }
    }

    /// As JSON, with a line end.
    ///
    /// # Errors
    /// [`Error::Internal`] if it cannot be written as JSON.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map(|text| text + "\n").map_err(|e| Error::Internal(e.to_string()))
    }

    /// As tables.
    #[must_use]
    pub fn text(&self) -> String {
        let filter = if self.filtered { "filtered" } else { "without filter" };
        let mut text = format!(
            "error of the light engine without a piece over that with it, at equal rays: median (least .. greatest) of {} seeds from \
             {}, {filter}\n",
            self.seeds, self.seed
        );
        for scene in &self.scenes {
            text += &scene.text(self.trim);
        }
        text
    }
}

impl SceneDocument {
    /// Puts together what was measured in a scene.
    #[must_use]
    pub fn new(
        (name, asked): (String, &AblatedScene),
        scene: &Scene,
        reference_pixels: &ReferencePixels,
        rays: Vec<u64>,
        with_all: &[Vec<Measured>],
        rows: Vec<Row>,
    ) -> Self {
        let table = |(index, rays)| Table {
            rays,
            with_all: Figures::of(column(with_all, index)),
            pieces: rows.iter().map(|row| PieceDocument::new(row, index)).collect(),
        };
        let size = reference_pixels.image().size;
        Self {
            scene: name,
            reference: asked.reference.display().to_string(),
            size: [size.width, size.height],
            triangles: scene.triangles.len(),
            compared: reference_pixels.counted(),
            own_relmse: reference_pixels.own_relmse(),
            tables: rays.into_iter().enumerate().map(table).collect(),
        }
    }

    fn text(&self, trim: f64) -> String {
        let Self { scene, size: [width, height], triangles, compared, own_relmse, .. } = self;
        let mut text = format!(
            "\n{scene}: {triangles} triangles, {width}x{height}, {compared} pixels compared, the reference's own relMSE {own_relmse:.1e} \
             taken off\n"
        );
        let trimmed = format!("worst {} % left out", trim * 100.0);
        for table in &self.tables {
            let heading = format!("{} rays", table.rays);
            text += &format!("\n  {heading:<18}  {:<32}  {trimmed:<32}  mean shift\n", "relMSE");
            text += &table.text();
        }
        text
    }
}

impl Table {
    fn text(&self) -> String {
        let Figures { relmse, trimmed, mean_shift, .. } = &self.with_all;
        let absolute = |spread: &Spread| show(spread, |value| format!("{value:.2e}"));
        let mut text = row("all pieces", [absolute(relmse), absolute(trimmed)], mean_shift);
        for piece in &self.pieces {
            let ratio = |spread: Option<Spread>| {
                spread.map_or_else(|| "noise".to_owned(), |spread| show(&spread, |value| format!("{value:.3}")))
            };
            text += &row(piece.piece, [ratio(piece.relmse), ratio(piece.trimmed)], &piece.mean_shift);
        }
        text
    }
}

fn row(name: &str, [whole, trimmed]: [String; 2], mean_shift: &Spread) -> String {
    format!("  {name:<18}  {whole:<32}  {trimmed:<32}  {:+.2} %\n", mean_shift.median * 100.0)
}

fn show(spread: &Spread, number: impl Fn(f64) -> String) -> String {
    let Spread { median, least, greatest } = *spread;
    format!("{} ({} .. {})", number(median), number(least), number(greatest))
}

/// What each seed found after the `index`-th number of rays.
fn column(runs: &[Vec<Measured>], index: usize) -> Vec<Measured> {
    runs.iter().filter_map(|run| run.get(index).copied()).collect()
}

fn values(runs: &[Measured], of: fn(&Measured) -> f64) -> Vec<f64> {
    runs.iter().map(of).collect()
}

impl Figures {
    fn of(runs: Vec<Measured>) -> Self {
        Self {
            relmse: Spread::of(&values(&runs, |run| run.relmse)),
            trimmed: Spread::of(&values(&runs, |run| run.trimmed)),
            mean_shift: Spread::of(&values(&runs, |run| run.mean_shift)),
            runs,
        }
    }
}

impl PieceDocument {
    fn new(row: &Row, index: usize) -> Self {
        let (with, without) = (column(&row.with, index), column(&row.without, index));
        let ratios = |of: fn(&Measured) -> f64| Spread::of_ratios(&values(&without, of), &values(&with, of));
        Self {
            piece: row.piece,
            relmse: ratios(|run| run.relmse),
            trimmed: ratios(|run| run.trimmed),
            mean_shift: Spread::of(&values(&without, |run| run.mean_shift)),
            with,
            without,
        }
    }
}
