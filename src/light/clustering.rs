//! Which lights share a group: small ones near each other.
//!
//! The visible fraction of a group is sampled at points of all its members, so what sharing costs grows with how far the members
//! lie apart and with how much light each of a pair sends: cost = ½ ΣΣ w_i w_j |a_i − a_j|² over points a_i of light i, w its power.
//! The part whose best cut lowers that most is cut next, along an axis. (Lightcuts bound the error of a cluster by its power and
//! extent likewise, from the bottom up [WFABDG05]; cutting from the top takes n log n.)

use glam::DVec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A light that may share a group.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Middle of a sphere that holds it.
    pub centre: DVec3,
    /// Radius of that sphere.
    pub radius: f64,
    /// Luminance of what it sends in all directions, W.
    pub power: f64,
    /// Whether one ray tells all about it: such lights are kept apart from the others, since few rays tell all about a group of them.
    pub is_delta: bool,
}

/// Lights above which cuts that leave less than [`SMALLEST_SHARE`] on a side are not considered, so that no scene takes long.
const MANY: usize = 4096;
const SMALLEST_SHARE: usize = 16;

/// Divides lights into `parts` groups (fewer if there are not so many; one of each kind at least), each a list of indices in
/// ascending order, ordered by their first.
#[must_use]
pub fn divide(lights: &[Candidate], parts: usize) -> Vec<Vec<usize>> {
    let mut done: Vec<Vec<usize>> = Vec::new();
    let mut open = BinaryHeap::new();
    let offer = |part: Vec<usize>, done: &mut Vec<Vec<usize>>, open: &mut BinaryHeap<Cut>| match Cut::best(lights, part)
    {
        Ok(cut) => open.push(cut),
        Err(single) => done.push(single),
    };
    let (deltas, others): (Vec<usize>, Vec<usize>) = (0..lights.len()).partition(|&i| lights[i].is_delta);
    for part in [deltas, others] {
        if !part.is_empty() {
            offer(part, &mut done, &mut open);
        }
    }
    while done.len() + open.len() < parts {
        let Some(Cut { mut part, at, .. }) = open.pop() else { break };
        let rest = part.split_off(at);
        offer(part, &mut done, &mut open);
        offer(rest, &mut done, &mut open);
    }
    done.extend(open.into_iter().map(|cut| cut.part));
    done.iter_mut().for_each(|part| part.sort_unstable());
    done.sort_unstable_by_key(|part| part[0]);
    done
}

/// The best cut of a part in two.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Cut {
    /// What it saves, as the bits of an f64 that is not negative, which order alike.
    saving: u64,
    /// Breaks ties: the part that was first.
    first: Reverse<usize>,
    /// Where the second half begins.
    at: usize,
    /// The part, in order along the axis of the cut.
    part: Vec<usize>,
}

impl Cut {
    /// The cut of a part that saves most; the part itself if it is a single light.
    fn best(lights: &[Candidate], part: Vec<usize>) -> Result<Self, Vec<usize>> {
        if part.len() < 2 {
            return Err(part);
        }
        let origin = lights[part[0]].centre;
        let first = Reverse(part.iter().copied().min().unwrap_or(0));
        let of = |order: &[usize]| order.iter().map(|&i| Moments::of(&lights[i], origin)).collect::<Vec<_>>();
        let mut best: Option<Self> = None;
        for axis in 0..3 {
            let mut order = part.clone();
            order.sort_unstable_by(|&a, &b| lights[a].centre[axis].total_cmp(&lights[b].centre[axis]).then(a.cmp(&b)));
            let (saving, at) = best_place(&of(&order));
            let saving = saving.max(0.0).to_bits();
            if best.as_ref().is_none_or(|b| saving > b.saving) {
                best = Some(Self { saving, first, at, part: order });
            }
        }
        best.ok_or(part)
    }
}

/// Where to cut a sequence, and what that saves.
fn best_place(moments: &[Moments]) -> (f64, usize) {
    let count = moments.len();
    let least = if count > MANY { count / SMALLEST_SHARE } else { 1 };
    let all = moments.iter().copied().fold(Moments::default(), Moments::plus);
    let (mut left, mut best) = (Moments::default(), (f64::NEG_INFINITY, least));
    for (i, &moment) in moments.iter().enumerate() {
        if i >= least && i <= count - least {
            let saving = all.cost() - left.cost() - all.minus(left).cost();
            if saving > best.0 {
                best = (saving, i);
            }
        }
        left = left.plus(moment);
    }
    best
}

/// Sums over lights that their cost follows from.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    /// Σ w.
    power: f64,
    /// Σ w p.
    position: DVec3,
    /// Σ w (|p|² + r²).
    square: f64,
    /// Σ w² r²: a light does not cost anything by itself.
    own: f64,
}

impl Moments {
    fn of(light: &Candidate, origin: DVec3) -> Self {
        let (p, w) = (light.centre - origin, light.power);
        let radius = light.radius * light.radius;
        Self { power: w, position: p * w, square: w * (p.length_squared() + radius), own: w * w * radius }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            power: self.power + other.power,
            position: self.position + other.position,
            square: self.square + other.square,
            own: self.own + other.own,
        }
    }

    fn minus(self, other: Self) -> Self {
        Self {
            power: self.power - other.power,
            position: self.position - other.position,
            square: self.square - other.square,
            own: self.own - other.own,
        }
    }

    /// Σ over pairs of w_i w_j (|p_i − p_j|² + r_i² + r_j²).
    fn cost(self) -> f64 {
        self.power * self.square - self.position.length_squared() - self.own
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sequence::Sequence;

    fn at(position: [f64; 3], radius: f64, power: f64) -> Candidate {
        Candidate { centre: DVec3::from(position), radius, power, is_delta: true }
    }

    #[test]
    fn the_cost_is_that_of_all_pairs() {
        let sequence = Sequence::new(3);
        let lights: Vec<Candidate> = (0..9)
            .map(|i| {
                let [x, y, z, r] = sequence.point(i).map(f64::from);
                at([x, y, z], r, x + z)
            })
            .collect();
        let moments = lights.iter().map(|l| Moments::of(l, DVec3::splat(0.3))).fold(Moments::default(), Moments::plus);
        let mut pairs = 0.0;
        for (i, a) in lights.iter().enumerate() {
            for b in &lights[..i] {
                let apart = a.centre.distance_squared(b.centre) + a.radius.powi(2) + b.radius.powi(2);
                pairs += a.power * b.power * apart;
            }
        }
        assert!((moments.cost() - pairs).abs() < 1e-9 * pairs, "{} {pairs}", moments.cost());
    }

    #[test]
    fn clusters_stay_together_and_strong_and_large_lights_alone() {
        // Two clusters of weak lights, a strong one inside the first, a large one inside the second.
        let near = |i: usize| at([0.1 * i as f64, 0.02 * (i * i % 7) as f64, 0.0], 0.01, 1.0);
        let far = |i: usize| at([50.0, 0.1 * i as f64, 3.0], 0.01, 1.0);
        let mut lights: Vec<Candidate> = (0..8).map(near).chain((0..8).map(far)).collect();
        lights.push(at([0.35, 0.0, 0.0], 0.01, 500.0));
        lights.push(at([50.0, 0.35, 3.0], 9.0, 1.0));
        let two = divide(&lights, 2);
        assert_eq!(two, [(0..8).chain([16]).collect::<Vec<_>>(), (8..16).chain([17]).collect()]);
        let many = divide(&lights, 6);
        assert!(many.contains(&vec![16]) && many.contains(&vec![17]), "{many:?}");
        assert_eq!(many.len(), 6);
        assert_eq!(divide(&lights, 100).len(), lights.len());
        assert!(divide(&[], 3).is_empty());
        // Never those of both kinds.
        lights.iter_mut().step_by(2).for_each(|light| light.is_delta = false);
        assert_eq!(divide(&lights, 2), [0, 1].map(|kind| (kind..lights.len()).step_by(2).collect::<Vec<_>>()));
    }

    #[test]
    fn lights_in_one_place_are_divided_all_the_same() {
        let lights = vec![at([1.0, 2.0, 3.0], 0.0, 0.0); 10_000];
        let parts = divide(&lights, 128);
        assert_eq!(parts.len(), 128);
        assert_eq!(parts.iter().map(Vec::len).sum::<usize>(), 10_000);
    }
}
