//! What `penombre diff` found, for people and for programs, and the limits it is held to.

use super::args::LimitArgs;
use crate::error::{Error, Result};
use crate::image::metrics::ZTest;
use crate::scene::{Display, ToneMapping};
use serde::Serialize;

/// All measures of one comparison; the JSON of `--json` has these names.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Path of the image.
    pub image: String,
    /// Path of the reference.
    pub reference: String,
    /// Width and height of both, pixels.
    pub size: [u32; 2],
    /// Pixels compared.
    pub counted: usize,
    /// Pixels left out by masks.
    pub masked: usize,
    /// Pixels left out since one of the images has no value of them.
    pub not_sampled: usize,
    /// Whose masks: `--mask`, `reference`.
    pub masks: Vec<&'static str>,
    /// Pixels left out since a channel is NaN or infinite in either image.
    pub not_finite: usize,
    /// Root mean square error over pixels and channels.
    pub rmse: f64,
    /// The same over the reference's mean; `null` if that is black.
    pub rmse_over_mean: Option<f64>,
    /// Mean of d²/(r² + ε); `null` in JSON if infinite (a black reference).
    pub relmse: f64,
    /// The ε of it.
    pub relmse_epsilon: f64,
    /// relMSE that the reference's noise alone makes, from its variance.
    pub own_relmse: Option<f64>,
    /// Mean FLIP error of the displayed images; `null` where one has only a part of the pixels.
    pub flip: Option<f64>,
    /// How radiance was displayed for it; `null` for PNG images.
    pub shown: Option<Shown>,
    /// Largest difference of a channel.
    pub max: f64,
    /// Mean of image − reference.
    pub mean_shift: f64,
    /// Mean of the reference.
    pub reference_mean: f64,
    /// Differences against the images' noise; `null` without variances.
    pub z: Option<Z>,
    /// Names of the limits that are exceeded.
    pub exceeded: Vec<&'static str>,
}

/// How radiance was displayed.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Shown {
    /// Stops.
    pub exposure: f32,
    /// Name of the tone-mapping operator.
    pub tone_mapping: &'static str,
}

impl Shown {
    /// The names of a display's settings.
    #[must_use]
    pub fn new(display: &Display) -> Self {
        let name = ToneMapping::NAMES.iter().find(|(_, operator)| *operator == display.tone_mapping);
        Self { exposure: display.exposure, tone_mapping: name.map_or("", |(name, _)| name) }
    }
}

/// Differences against the images' noise.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Z {
    /// Values (pixels × channels) with a variance.
    pub values: usize,
    /// Share of them that differ by more than 3 standard deviations.
    pub share_beyond_3: f64,
    /// What that share is when both images estimate the same.
    pub expected: f64,
}

impl From<ZTest> for Z {
    fn from(z: ZTest) -> Self {
        Self { values: z.values, share_beyond_3: z.share, expected: ZTest::EXPECTED }
    }
}

impl Verdict {
    /// The limits with what they are held against, by the name of the option.
    fn limited(&self, limits: &LimitArgs) -> [(&'static str, Option<f64>, f64); 4] {
        [
            ("rmse", limits.max_rmse, self.rmse),
            ("relmse", limits.max_relmse, self.relmse),
            ("flip", limits.max_flip, self.flip.unwrap_or(f64::INFINITY)),
            ("mean_shift", limits.max_mean_shift, self.mean_shift.abs()),
        ]
    }

    /// Names of the exceeded limits. A value that is no number exceeds any limit.
    #[must_use]
    pub fn exceeded_of(&self, limits: &LimitArgs) -> Vec<&'static str> {
        let limited = self.limited(limits);
        let mut names: Vec<_> =
            limited.iter().filter(|(_, limit, value)| limit.is_some_and(|l| *value > l)).map(|(n, ..)| *n).collect();
        if self.not_finite > 0 && limited.iter().any(|(_, limit, _)| limit.is_some()) {
            names.push("not_finite");
        }
        names
    }

    /// A line for each exceeded limit, and one for values that are no numbers.
    #[must_use]
    pub fn complaints(&self, limits: &LimitArgs) -> Vec<String> {
        let mut lines = Vec::new();
        if self.not_finite > 0 {
            lines.push(format!("left out, NaN or infinite in one of the images: {} pixels", self.not_finite));
        }
        for (name, limit, value) in self.limited(limits) {
            if let Some(limit) = limit.filter(|l| value > *l) {
                lines.push(format!("--max-{} {limit} is exceeded: {value:.5e}", name.replace('_', "-")));
            }
        }
        lines
    }

    /// As JSON, with a line end.
    ///
    /// # Errors
    /// [`Error::Internal`] if it cannot be written as JSON.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map(|text| text + "\n").map_err(|e| Error::Internal(e.to_string()))
    }

    /// As a table.
    #[must_use]
    pub fn text(&self) -> String {
        let [width, height] = self.size;
        let masks = if self.masks.is_empty() { "no mask".to_owned() } else { self.masks.join(" and ") };
        let of_mean = |value: f64| match self.reference_mean {
            mean if mean > 0.0 => format!("   {:.3} % of the mean {mean:.5e}", value / mean * 100.0),
            _ => String::new(),
        };
        let own = self.own_relmse.map_or_else(String::new, |own| format!("   the reference's own noise {own:.5e}"));
        let not_sampled =
            if self.not_sampled > 0 { format!(", {} not sampled", self.not_sampled) } else { String::new() };
        let flip = self.flip.map_or_else(|| "not known of some pixels only".to_owned(), |flip| format!("{flip:.5}"));
        let shown = self
            .shown
            .filter(|_| self.flip.is_some())
            .map_or_else(String::new, |s| format!("   at {:.2} stops, {}", s.exposure, s.tone_mapping));
        let z = self.z.map_or_else(String::new, |z| {
            let (share, expected) = (z.share_beyond_3 * 100.0, z.expected * 100.0);
            format!("|z| > 3      {share:.3} %   of {} values; {expected:.3} % if only noise differs\n", z.values)
        });
        format!(
            "{} against {}, {width}x{height}\npixels       {} compared, {} masked ({masks}){not_sampled}\nRMSE         {:.5e}{}\n\
             relMSE       {:.5e}{own}\nFLIP         {flip}{shown}\nmax          {:.5e}\nmean shift   {:+.5e}{}\n{z}",
            self.image,
            self.reference,
            self.counted,
            self.masked,
            self.rmse,
            of_mean(self.rmse),
            self.relmse,
            self.max,
            self.mean_shift,
            of_mean(self.mean_shift),
        )
    }
}
