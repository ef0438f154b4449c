//! The pixel that is explained.

use crate::error::{Error, Result};
use crate::image::atomic;
use crate::scene::camera::ImageSize;
use crate::session::{Probe, Session};
use glam::Vec2;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// What is asked, known and to be written of a pixel.
#[derive(Default)]
pub struct Explained {
    /// The pixel that is asked about.
    asked: Option<[u32; 2]>,
    known: Option<Probe>,
    /// Where the answer is to be written.
    to_save: Vec<PathBuf>,
}

impl Explained {
    /// What is known of the pixel.
    #[must_use]
    pub const fn probe(&self) -> Option<&Probe> {
        self.known.as_ref()
    }

    /// Whether an answer waits for a picture.
    #[must_use]
    pub const fn is_asked(&self) -> bool {
        self.asked.is_some()
    }

    /// Asks about the pixel at a place of an image; the one that is explained is closed instead.
    pub(super) fn ask(&mut self, place: Vec2, size: ImageSize) {
        let pixel = pixel_at(place, size);
        let shown = self.known.take().map(|probe| probe.pixel);
        self.asked = Some(pixel).filter(|_| shown != Some(pixel));
    }

    /// Closes it; whether there was anything to close.
    pub(super) fn close(&mut self) -> bool {
        self.known.take().is_some()
    }

    /// Writes what is known, now or when it is; whether it is written.
    ///
    /// # Errors
    /// [`Error::Usage`] if nothing is asked, [`Error::Io`] naming the file.
    pub(super) fn save(&mut self, path: &Path) -> Result<bool> {
        match &self.known {
            _ if self.asked.is_some() => self.to_save.push(path.to_owned()),
            Some(probe) => write(probe, path)?,
            None => {
                return Err(Error::Usage("pixel.save: no pixel is explained; choose one by pixel.explain".to_owned()));
            }
        }
        Ok(!self.is_asked())
    }

    /// Answers what is asked by what a session's picture shows, and writes what was to be; the files.
    ///
    /// # Errors
    /// As [`Session::probe`]; [`Error::Io`] naming a file.
    pub(super) fn answer(&mut self, session: &mut Session) -> Result<Vec<PathBuf>> {
        let Some([x, y]) = self.asked.take() else { return Ok(Vec::new()) };
        let last = session.size();
        let probe = self.known.insert(session.probe([x.min(last.width - 1), y.min(last.height - 1)])?);
        let files = std::mem::take(&mut self.to_save);
        files.iter().try_for_each(|path| write(probe, path))?;
        Ok(files)
    }
}

/// The pixel at a place in shares of width and height.
fn pixel_at(place: Vec2, ImageSize { width, height }: ImageSize) -> [u32; 2] {
    [(place.x, width), (place.y, height)].map(|(share, count)| ((share * count as f32) as u32).min(count - 1))
}

fn write(probe: &Probe, path: &Path) -> Result<()> {
    let json = probe.json()?;
    atomic::write(path, |file| file.write_all(json.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_pixel_and_the_last_one_is_in_the_image() {
        let size = ImageSize { width: 64, height: 48 };
        let pixels = [Vec2::ZERO, Vec2::splat(0.5), Vec2::ONE].map(|place| pixel_at(place, size));
        assert_eq!(pixels, [[0, 0], [32, 24], [63, 47]]);
    }

    #[test]
    fn nothing_is_saved_of_a_pixel_that_nobody_asked_about() {
        let mut explained = Explained::default();
        assert!(explained.save(Path::new("a.json")).unwrap_err().to_string().contains("pixel.explain"));
        explained.ask(Vec2::ZERO, ImageSize { width: 2, height: 2 });
        assert!(!explained.save(Path::new("a.json")).unwrap() && explained.is_asked(), "once it is known");
    }
}
