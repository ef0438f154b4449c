//! What a run did, up to now.

use super::clock::Moment;
use super::{EndedBy, Session};
use crate::log::summary::AheadPictures;
use crate::refine::update::{EngineStats, MemoryStats};
use crate::store::page_file::PageFile;
use std::time::Duration;

/// Totals of a run.
#[derive(Clone, Copy, Debug)]
pub struct Totals {
    /// Frames drawn.
    pub frames: u64,
    /// Pictures made before the engine had answered.
    pub ahead: AheadPictures,
    /// The engine's totals as the last of them shows them.
    pub engine: EngineStats,
    /// When the first picture was made.
    pub first_picture: Option<Moment>,
    /// When the first picture was made after the first light was found.
    pub lit_picture: Option<Moment>,
    /// When the first picture was made in which every visible vertex has a value.
    pub complete_picture: Option<Moment>,
    /// When the last picture was made.
    pub last_picture: Option<Moment>,
    /// Since the first frame began.
    pub elapsed: Duration,
}

impl Session {
    /// What was done up to now.
    #[must_use]
    pub fn totals(&self) -> Totals {
        Totals {
            frames: self.frames,
            ahead: self.ahead,
            engine: self.stats,
            first_picture: self.clock.first_picture,
            lit_picture: self.clock.lit_picture,
            complete_picture: self.clock.complete_picture,
            last_picture: self.clock.last_picture,
            elapsed: self.clock.since_first_frame(),
        }
    }

    /// What the light of the present view takes, refined to the end, bytes: a forecast.
    #[must_use]
    pub const fn forecast(&self) -> u64 {
        self.forecast
    }

    /// What is to be said before a view is lit that is forecast to take more than there is.
    #[must_use]
    pub fn short_forecast(&self) -> Option<String> {
        let (forecast, budget) = (self.forecast, self.options.memory?);
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        (forecast > budget).then(|| {
            format!(
                "light of this view takes about {} MiB when it is refined to the end, and --memory allows {}: it will be coarser, unless \
                 the run ends before",
                mib(forecast),
                mib(budget)
            )
        })
    }

    /// What is to be said of a run for which there was too little memory.
    #[must_use]
    pub fn memory_doubt(&self) -> Option<String> {
        let MemoryStats { budget, held, short, cannot_spill, evicted, .. } = self.stats.memory;
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        if short {
            let (held, budget) = (mib(held), mib(budget));
            return Some(format!(
                "light is coarser than it would be: it takes {held} MiB of --memory {budget}; a higher --memory lets it be refined \
                 further"
            ));
        }
        let lost = cannot_spill && evicted > 0;
        lost.then(|| {
            let folder = PageFile::usual_folder();
            format!(
                "light of {evicted} faces did not fit into --memory {} and could not be written to {}: it is computed again where it is \
                 seen again",
                mib(budget),
                folder.display()
            )
        })
    }

    /// What is to be said of a picture that is left, because of `by`, before every vertex that it shows has a value.
    #[must_use]
    pub fn unfinished(&self, by: EndedBy) -> Option<String> {
        let EngineStats { unlit, visible, complete, .. } = self.stats;
        if complete {
            return None;
        }
        Some(if self.generation.is_none() {
            "the run ended before the ray hierarchy was built: there is no light in the picture".to_owned()
        } else {
            let (by, share) = (by.name(), (unlit * 100).div_ceil(visible.max(1)));
            format!(
                "the run ended ({by}) before every visible vertex had a value: {unlit} of {visible} ({share} %) have none, and \
                 are black or guessed from others; give it more time"
            )
        })
    }
}
