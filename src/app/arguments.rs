//! Arguments of commands, from words.

use crate::image::FileFormat;
use crate::pass::UpdateMode;
use crate::scene::ToneMapping;
use glam::{DVec3, Vec2};
use std::path::PathBuf;

/// Arguments of a command, each looked at as what it must be.
pub struct Arguments<'a> {
    /// Their names, separated by blanks.
    pub(super) names: &'static str,
    /// A line with the command as somebody would type it.
    pub(super) example: String,
    /// As they were typed.
    pub(super) words: &'a [String],
}

impl Arguments<'_> {
    /// A finite number between two bounds.
    pub(super) fn number_in(&self, index: usize, [least, most]: [f32; 2]) -> Result<f32, String> {
        let word = self.text(index);
        let number = word.parse::<f32>().ok().filter(|value| (least..=most).contains(value));
        number.ok_or_else(|| {
            let expected = match (least, most) {
                (f32::MIN, f32::MAX) => "a number".to_owned(),
                (least, f32::MAX) => format!("a number from {least}"),
                (least, most) => format!("a number from {least} to {most}"),
            };
            format!("{word}: expected {expected} for {}, as in `{}`", self.name(index), self.example)
        })
    }

    /// Finite numbers, from an argument on.
    pub(super) fn numbers<const N: usize>(&self, first: usize) -> Result<[f32; N], String> {
        self.numbers_in(first, [f32::MIN, f32::MAX])
    }

    /// Finite numbers between two bounds, from an argument on.
    pub(super) fn numbers_in<const N: usize>(&self, first: usize, bounds: [f32; 2]) -> Result<[f32; N], String> {
        let mut numbers = [0.0; N];
        for (offset, number) in numbers.iter_mut().enumerate() {
            *number = self.number_in(first + offset, bounds)?;
        }
        Ok(numbers)
    }

    /// Coordinates of a point in the scene's files.
    pub(super) fn point(&self, first: usize) -> Result<DVec3, String> {
        let coordinate = |index: usize| {
            let value = self.text(index).parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| format!("{}: expected a number for {}", self.text(index), self.name(index)))
        };
        Ok(DVec3::new(coordinate(first)?, coordinate(first + 1)?, coordinate(first + 2)?))
    }

    /// A factor more than 0.
    pub(super) fn factor(&self, index: usize) -> Result<f32, String> {
        self.number_in(index, [1e-6, 1e6])
    }

    /// A place of the image.
    pub(super) fn place(&self) -> Result<Vec2, String> {
        Ok(Vec2::new(self.number_in(0, [0.0, 1.0])?, self.number_in(1, [0.0, 1.0])?))
    }

    /// Any word.
    pub(super) fn text(&self, index: usize) -> &str {
        self.words.get(index).map_or("", String::as_str)
    }

    /// A word that may be left out.
    pub(super) fn rest(&self, index: usize) -> Option<String> {
        self.words.get(index).cloned()
    }

    /// `on` or `off`.
    pub(super) fn switch(&self, index: usize) -> Result<bool, String> {
        match self.text(index) {
            "on" => Ok(true),
            "off" => Ok(false),
            other => Err(format!("{other}: expected on or off, as in `{}`", self.example)),
        }
    }

    /// An update mode.
    pub(super) fn update_mode(&self) -> Result<UpdateMode, String> {
        UpdateMode::named(self.text(0)).ok_or_else(|| {
            let names = UpdateMode::ALL.map(UpdateMode::name).join(", ");
            format!("{}: expected one of {names}", self.text(0))
        })
    }

    /// A file that a picture can be written to, if there is one.
    pub(super) fn picture(&self) -> Result<Option<PathBuf>, String> {
        let Some(word) = self.words.first() else { return Ok(None) };
        let path = PathBuf::from(word);
        match FileFormat::of(&path) {
            Some(_) => Ok(Some(path)),
            None => Err(format!("{word}: expected a name that ends in .png or .exr")),
        }
    }

    /// A tone-mapping operator.
    pub(super) fn operator(&self) -> Result<ToneMapping, String> {
        let word = self.text(0);
        let known = ToneMapping::NAMES.iter().find(|(name, _)| *name == word);
        known.map(|(_, operator)| *operator).ok_or_else(|| {
            let names = ToneMapping::NAMES.map(|(name, _)| name).join(", ");
            format!("{word}: expected one of {names}")
        })
    }

    fn name(&self, index: usize) -> &'static str {
        self.names.split(' ').nth(index).unwrap_or_default()
    }
}
