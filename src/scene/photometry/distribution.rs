//! Luminous intensity by direction.

use super::fault::Fault;
use crate::math::content_hash::ContentHash;
use glam::{Mat3, Vec3};
use std::f32::consts::{PI, TAU};

/// Steps of half a degree of the integral over all directions.
const STEPS: [u32; 2] = [720, 360];

/// Luminous intensity by direction, as measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    system: System,
    /// Angles of the planes, degrees, ascending; of the first kind of angle.
    planes: Vec<f32>,
    /// Angles within a plane, degrees, ascending.
    angles: Vec<f32>,
    /// Candela, plane after plane.
    candela: Vec<f32>,
    /// What is emitted at tilts of the lamp, as factors by degrees; empty if that makes no difference.
    tilt: Vec<[f32; 2]>,
}

/// How angles are counted (CIE 121). In the lamp's frame z is the way that it shines (nadir of a ceiling lamp), x lies in the plane of 0°.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum System {
    /// Planes turn about z; angles from z.
    C(Symmetry),
    /// Planes turn about x from z; angles within from the plane of y and z towards x.
    B,
    /// Planes turn about y from z; angles within from the plane of x and z towards y.
    A,
}

/// Which planes stand for others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Symmetry {
    /// All are measured.
    None,
    /// One stands for all.
    Rotation,
    /// Those from 0° to 180° for the other half.
    About0,
    /// Those from 90° to 270° for the other half.
    About90,
    /// Those from 0° to 90° for the other quarters.
    Quarter,
}

impl Distribution {
    /// Checks what was read, and takes it.
    pub(super) fn new(
        system: System,
        planes: Vec<f32>,
        angles: Vec<f32>,
        candela: Vec<f32>,
        line: u32,
    ) -> Result<Self, Fault> {
        let ascends = |list: &[f32]| list.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascends(&planes) || !ascends(&angles) {
            return Err(Fault::new(line, "angles do not ascend: each must be larger than the one before"));
        }
        if planes.len() * angles.len() != candela.len() || candela.is_empty() {
            return Err(Fault::new(line, "there are not as many intensities as angles"));
        }
        Ok(Self { system, planes, angles, candela, tilt: Vec::new() })
    }

    /// Adds what was measured to a hash.
    pub(super) fn add_to(&self, hash: &mut ContentHash) {
        hash.number(match self.system {
            System::C(Symmetry::None) => 0,
            System::C(Symmetry::Rotation) => 1,
            System::C(Symmetry::About0) => 2,
            System::C(Symmetry::About90) => 3,
            System::C(Symmetry::Quarter) => 4,
            System::B => 5,
            System::A => 6,
        });
        [&self.planes, &self.angles, &self.candela].into_iter().for_each(|list| hash.floats(list));
        hash.floats(self.tilt.as_flattened());
    }

    /// The same with factors by tilt, degrees.
    pub(super) fn with_tilt(self, tilt: Vec<[f32; 2]>) -> Self {
        Self { tilt, ..self }
    }

    /// Luminous intensity in a direction of the lamp's frame, candela: z is the way that it shines.
    #[must_use]
    pub fn candela(&self, direction: Vec3) -> f32 {
        let (plane, angle) = self.system.angles(direction, &self.planes);
        let Some((row, across)) = place(&self.planes, plane, self.is_closed()) else { return 0.0 };
        let Some((column, along)) = place(&self.angles, angle, false) else { return 0.0 };
        let (count, next) = (self.angles.len(), (row + 1) % self.planes.len());
        let at = |row: usize| {
            let [low, high] = [column, (column + 1).min(count - 1)].map(|column| self.candela[row * count + column]);
            low + (high - low) * along
        };
        at(row) + (at(next) - at(row)) * across
    }

    /// Whether the last plane is followed by the first.
    fn is_closed(&self) -> bool {
        matches!(self.system, System::C(Symmetry::None)) && self.planes.len() > 1
    }

    /// The largest intensity, candela.
    #[must_use]
    pub fn peak(&self) -> f32 {
        self.candela.iter().fold(0.0, |most, &c| most.max(c))
    }

    /// Luminous flux, lumen: the integral over all directions.
    #[must_use]
    pub fn flux(&self) -> f32 {
        let [turns, rings] = STEPS;
        let mut sum = 0.0_f64;
        for ring in 0..rings {
            let [low, high] = [ring, ring + 1].map(|edge| (edge as f32 * PI / rings as f32).cos());
            let (z, solid) = (0.5 * (low + high), f64::from((low - high) * TAU / turns as f32));
            let sine = (1.0 - z * z).max(0.0).sqrt();
            for turn in 0..turns {
                let (y, x) = ((turn as f32 + 0.5) * TAU / turns as f32).sin_cos();
                sum += f64::from(self.candela(Vec3::new(x * sine, y * sine, z))) * solid;
            }
        }
        sum as f32
    }

    /// What it emits with its axis `degrees` from straight down, against upright: lamps of metal vapour depend on that.
    #[must_use]
    pub fn at_tilt(&self, degrees: f32) -> f32 {
        let angles: Vec<f32> = self.tilt.iter().map(|[angle, _]| *angle).collect();
        match (place(&angles, degrees, false), self.tilt.last()) {
            (Some((i, share)), _) => {
                let [low, high] = [i, (i + 1).min(angles.len() - 1)].map(|i| self.tilt[i][1]);
                low + (high - low) * share
            }
            (None, last) => last.map_or(1.0, |[_, factor]| *factor),
        }
    }
}

/// The frame of a lamp that shines in the unit direction `axis`: x, in whose plane angles start, nearest to the unit `start` turned about
/// the axis by `turn` degrees.
#[must_use]
pub fn frame(axis: Vec3, start: Vec3, turn: f32) -> Mat3 {
    let x = (start - axis * axis.dot(start)).try_normalize().unwrap_or_else(|| axis.any_orthonormal_vector());
    let y = axis.cross(x);
    let (sin, cos) = turn.to_radians().sin_cos();
    Mat3::from_cols(x * cos + y * sin, y * cos - x * sin, axis)
}

/// Cell and place in it among ascending angles; beyond the ends none, but between the last and the first where they go round.
fn place(list: &[f32], at: f32, is_closed: bool) -> Option<(usize, f32)> {
    /// Rounding of angles that are computed.
    const SLACK: f32 = 1e-3;
    let (first, last) = (*list.first()?, *list.last()?);
    if list.len() == 1 {
        return Some((0, 0.0));
    }
    if is_closed && (at > last || at < first) {
        let (width, beyond) = (first + 360.0 - last, (at - last).rem_euclid(360.0));
        return (width > SLACK && beyond <= width).then_some((list.len() - 1, beyond / width));
    }
    if at < first - SLACK || at > last + SLACK {
        return None;
    }
    let cell = list.partition_point(|&angle| angle <= at).clamp(1, list.len() - 1) - 1;
    Some((cell, ((at - list[cell]) / (list[cell + 1] - list[cell])).clamp(0.0, 1.0)))
}

impl System {
    /// Angle of the plane, and within it, of a direction, degrees.
    fn angles(self, direction: Vec3, planes: &[f32]) -> (f32, f32) {
        let Vec3 { x, y, z } = direction;
        match self {
            Self::C(symmetry) => {
                let around = y.atan2(x).to_degrees().rem_euclid(360.0);
                (symmetry.fold(around, planes), x.hypot(y).atan2(z).to_degrees())
            }
            Self::B => (side(y.atan2(z).to_degrees(), planes), x.atan2(y.hypot(z)).to_degrees()),
            Self::A => (side(x.atan2(z).to_degrees(), planes), y.atan2(x.hypot(z)).to_degrees()),
        }
    }
}

/// The angle of a plane of types A and B, whose two sides are alike where one is measured.
fn side(angle: f32, planes: &[f32]) -> f32 {
    if planes.first().is_some_and(|&first| first >= 0.0) { angle.abs() } else { angle }
}

impl Symmetry {
    /// The angle that stands for another, degrees in [0, 360).
    fn fold(self, around: f32, planes: &[f32]) -> f32 {
        match self {
            Self::None => around,
            Self::Rotation => planes[0],
            Self::About0 => around.min(360.0 - around),
            Self::About90 => {
                let back = if (90.0..=270.0).contains(&around) { around } else { 180.0 - around };
                back.rem_euclid(360.0)
            }
            Self::Quarter => {
                let half = around.min(360.0 - around);
                half.min(180.0 - half)
            }
        }
    }
}
