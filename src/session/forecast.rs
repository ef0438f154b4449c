//! How much memory the light of a view will take: a forecast before it is computed.

use super::Session;
use crate::scene::FaceId;

/// Bytes of a face in view that is not split, and of each pixel where light is refined to the end: measured (docs/results).
const A_FACE: u64 = 900;
const A_PIXEL: u64 = 120;
/// Bytes whatever is in view: what the radiance grid grows to.
const ANY: u64 = 4 << 20;

/// What the light of a view that shows these faces will take, bytes: within a factor of two.
pub(super) fn of_view(faces: &[(FaceId, u32)]) -> u64 {
    let pixels: u64 = faces.iter().map(|(_, pixels)| u64::from(*pixels)).sum();
    ANY + faces.len() as u64 * A_FACE + pixels * A_PIXEL
}

impl Session {
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
}
