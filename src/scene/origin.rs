//! Scenes far from the origin, as map coordinates are: moved there in double precision before single precision begins.

use super::text::{self, Lines};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Positions looked at in each file, at most, spread evenly over it.
const SAMPLES: usize = 1 << 16;
/// Distance of the middle from the origin, against the size of the bulk, beyond which a scene is moved: nearer, f32 resolves
/// a millionth of the bulk.
const FAR: f64 = 8.0;

/// The point that becomes the origin: zero unless the scene lies far away. It is round, since people read it. `others` are samples
/// of the positions of files that are no OBJ.
pub(super) fn find(files: &[Vec<u8>], others: &[DVec3]) -> DVec3 {
    let mut samples: Vec<DVec3> = files.par_iter().flat_map_iter(|bytes| sample(bytes)).collect();
    samples.extend_from_slice(others);
    choose(samples)
}

/// Whether all positions could be read in single precision and lie where it is fine enough, so that no other origin need be looked for.
pub(super) fn is_here(files: &[Vec<Vec3>], others: &[DVec3]) -> bool {
    let sample = |positions: &Vec<Vec3>| {
        let mut sample = Sample::default();
        positions.iter().for_each(|p| sample.offer(|| Some(p.as_dvec3())));
        sample.found
    };
    let readable = files.par_iter().all(|positions| positions.iter().all(|p| p.is_finite()));
    let mut samples: Vec<DVec3> = files.par_iter().flat_map_iter(sample).collect();
    samples.extend_from_slice(others);
    // So small and far that single precision makes one point of it.
    let is_point = samples.len() > 1 && samples.iter().all(|p| *p == samples[0] && *p != DVec3::ZERO);
    readable && !is_point && choose(samples) == DVec3::ZERO
}

fn choose(mut samples: Vec<DVec3>) -> DVec3 {
    let Some(last) = samples.len().checked_sub(1) else { return DVec3::ZERO };
    // The middle half of the positions, along each axis: strays decide nothing.
    let mut quantile =
        |axis: usize, at: usize| samples.select_nth_unstable_by(at, |a, b| a[axis].total_cmp(&b[axis])).1[axis];
    let mut along = |axis: usize| [last / 4, last / 2, last - last / 4].map(|at| quantile(axis, at));
    let [x, y, z] = [along(0), along(1), along(2)];
    let bulk = DVec3::new(x[2] - x[0], y[2] - y[0], z[2] - z[0]).length();
    let middle = DVec3::new(x[1], y[1], z[1]);
    if middle.abs().max_element() <= FAR * bulk || bulk == 0.0 {
        return DVec3::ZERO;
    }
    let step = 10_f64.powf(bulk.log10().ceil());
    (middle / step).round() * step
}

/// Some of many positions, spread evenly over them.
pub(super) struct Sample {
    /// Those that were taken.
    pub found: Vec<DVec3>,
    /// Every so many are taken.
    stride: usize,
    count: usize,
}

impl Default for Sample {
    fn default() -> Self {
        Self { found: Vec::new(), stride: 1, count: 0 }
    }
}

impl Sample {
    /// The next position, which is read only where it is taken.
    pub(super) fn offer(&mut self, position: impl FnOnce() -> Option<DVec3>) {
        self.count += 1;
        if self.count.is_multiple_of(self.stride) {
            self.found.extend(position().filter(|p| p.is_finite()));
        }
        if self.found.len() == SAMPLES {
            // Every other one, and from here on half as many.
            let mut keep = false;
            self.found.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride *= 2;
        }
    }
}

/// Positions of an OBJ file's text.
fn sample(bytes: &[u8]) -> Vec<DVec3> {
    let mut sample = Sample::default();
    let mut lines = Lines::new(bytes);
    while let Some(line) = lines.next() {
        if let Ok((_, line)) = line
            && let (b"v", rest) = text::keyword(line)
        {
            sample.offer(|| text::position(rest));
        }
    }
    sample.found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn house(at: DVec3, size: f64) -> Vec<DVec3> {
        let corner = |i: u32| at + DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into()) * size;
        (0..8).map(corner).collect()
    }

    #[test]
    fn only_what_is_far_is_moved() {
        assert_eq!(choose(Vec::new()), DVec3::ZERO);
        assert_eq!(choose(house(DVec3::new(-2.0, 0.0, 5.0), 4.0)), DVec3::ZERO);
        let far = DVec3::new(412_345.25, 36.5, -5_412_345.75);
        assert_eq!(choose(house(far, 4.0)), DVec3::new(412_350.0, 40.0, -5_412_350.0));
        let in_millimetres = choose(house(far * 1e3, 4e3));
        assert_eq!(in_millimetres, DVec3::new(412_350e3, 40e3, -5_412_350e3));
    }

    #[test]
    fn what_single_precision_cannot_tell_is_looked_at_again() {
        let single = |points: Vec<DVec3>| points.into_iter().map(DVec3::as_vec3).collect::<Vec<Vec3>>();
        let near = single(house(DVec3::new(-2.0, 0.0, 5.0), 4.0));
        let far = single(house(DVec3::splat(1e6), 4.0));
        let unreadable = vec![Vec3::NAN; 3];
        assert!(!is_here(&[single(house(DVec3::splat(1e8), 0.4))], &[]));
        assert!(is_here(std::slice::from_ref(&near), &[]) && is_here(&[], &[]));
        assert!(!is_here(&[far], &[]) && !is_here(&[near.clone(), unreadable], &[]));
        assert!(!is_here(&[], &house(DVec3::splat(1e6), 4.0)) && is_here(&[near], &house(DVec3::ZERO, 4.0)));
    }

    #[test]
    fn strays_do_not_matter() {
        let far = DVec3::splat(1e6);
        let with_stray = house(far, 1.0).into_iter().chain([DVec3::ZERO]).collect();
        assert!(choose(with_stray).distance(far) < 20.0);
    }

    #[test]
    fn a_sample_of_a_long_file_is_spread_over_it() {
        let text: String = (0..200_000).map(|i| format!("v {i} 0 0\nvt 0 0\n")).collect();
        let found = sample(text.as_bytes());
        assert!(found.len() < SAMPLES && found.len() >= SAMPLES / 2);
        let middle = found[found.len() / 2].x;
        assert!((middle - 1e5).abs() < 2e3, "{middle}");
        assert!(found.windows(2).all(|pair| pair[0].x < pair[1].x));
    }
}
