//! How much memory the light of a view will take: a forecast before it is computed.

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
