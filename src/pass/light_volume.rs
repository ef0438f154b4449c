//! Light by place and direction, coarsely: what surfaces near a point show that look the same way [Greger98]. Directions are the six
//! along the axes, of which any other is a mixture by the squares of its coordinates [McTaggart06].

use crate::scene::{FaceId, Scene, TriangleId};
use glam::{IVec3, Vec3};
use rustc_hash::{FxBuildHasher, FxHashMap};

/// Smallest cells along the scene's extent: about a step of stairs in a house.
const CELLS: f32 = 256.0;
/// Bits of a cell's coordinate in its key, and sizes of cells, each twice the one before: the largest holds all.
const BITS: u32 = 20;
/// Coordinate of the scene's origin: a third of all, so that cells of all sizes do not end there together.
const ORIGIN: i32 = (1 << BITS) / 3;

/// What a piece of surface shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Where it is, scene units.
    pub position: Vec3,
    /// Which way it looks.
    pub direction: Direction,
    /// Diffuse luminance D, W·sr⁻¹·m⁻².
    pub diffuse: Vec3,
    /// Specular luminance S, W·sr⁻¹·m⁻², if it is glossy.
    pub specular: Option<Vec3>,
    /// What it counts.
    pub weight: f32,
}

/// The axis that a normal is nearest to: 0 to 5 for +x, −x, +y, −y, +z, −z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Direction(u8);

impl Direction {
    const ALL: [Self; 6] = [Self(0), Self(1), Self(2), Self(3), Self(4), Self(5)];

    /// That of a normal of any length.
    fn of(normal: Vec3) -> Self {
        Self::along(normal.abs().max_position(), normal)
    }

    fn along(axis: usize, normal: Vec3) -> Self {
        Self(2 * axis as u8 + u8::from(normal[axis] < 0.0))
    }

    /// Of the other side.
    const fn opposite(self) -> Self {
        Self(self.0 ^ 1)
    }
}

/// What a sample of a triangle's light tells besides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    front: Direction,
    pub glossy: bool,
}

impl Look {
    /// That of each triangle.
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let triangles = (0..scene.triangles.len() as u32).map(TriangleId);
        let front = |triangle| Direction::of(scene.area_vector(triangle));
        triangles.map(|t| Self { front: front(t), glossy: scene.material(t).is_glossy() }).collect()
    }

    /// Which way a face of the triangle looks.
    pub(super) const fn direction(self, face: FaceId) -> Direction {
        if face.is_back() { self.front.opposite() } else { self.front }
    }
}

/// Sums over samples.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    diffuse: Vec3,
    weight: f32,
    specular: Vec3,
    /// Weight of those that are glossy.
    glossy: f32,
}

impl Cell {
    fn of(sample: &Sample) -> Self {
        let glossy = if sample.specular.is_some() { sample.weight } else { 0.0 };
        Self {
            diffuse: sample.diffuse * sample.weight,
            weight: sample.weight,
            specular: sample.specular.unwrap_or_default() * glossy,
            glossy,
        }
    }

    fn add(&mut self, other: &Self) {
        self.diffuse += other.diffuse;
        self.weight += other.weight;
        self.specular += other.specular;
        self.glossy += other.glossy;
    }

    fn light(&self) -> Option<Light> {
        let diffuse = (self.weight > 0.0).then(|| self.diffuse / self.weight)?;
        // A broad lobe gathers about what a diffuse surface does.
        let specular = if self.glossy > 0.0 { self.specular / self.glossy } else { diffuse };
        Some(Light { diffuse, specular })
    }
}

/// What is to be expected at a place, W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Light {
    /// D.
    pub diffuse: Vec3,
    /// S of a glossy surface.
    pub specular: Vec3,
}

/// The volume.
pub(super) struct LightVolume {
    /// Size of the smallest cells, scene units.
    cell: f32,
    /// By size of the cells.
    levels: Vec<FxHashMap<u64, Cell>>,
}

impl LightVolume {
    /// The volume of samples in a scene of that extent; empty of those that count nothing.
    pub(super) fn new(extent: f32, samples: impl Iterator<Item = Sample>) -> Self {
        let cell = (extent / CELLS).max(f32::MIN_POSITIVE);
        const EXPECTED: usize = 1 << 13;
        let mut finest = FxHashMap::with_capacity_and_hasher(EXPECTED, FxBuildHasher);
        for sample in samples.filter(|sample| sample.weight > 0.0) {
            let cell: &mut Cell = finest.entry(key(coordinates(sample.position, cell), sample.direction)).or_default();
            cell.add(&Cell::of(&sample));
        }
        let mut levels = vec![finest];
        for _ in 0..BITS {
            let mut coarser: FxHashMap<u64, Cell> = FxHashMap::default();
            let finer = levels.last().into_iter().flatten();
            finer.for_each(|(&key, cell)| coarser.entry(parent(key)).or_default().add(cell));
            levels.push(coarser);
        }
        Self { cell, levels }
    }

    /// What a surface at a place that looks along a normal may show, from the smallest cells that tell; `None` if nothing is known of
    /// the light anywhere.
    pub(super) fn at(&self, position: Vec3, normal: Vec3) -> Option<Light> {
        let place = coordinates(position, self.cell);
        let mut sum = Light::default();
        let mut found = 0.0;
        let unit = normal.normalize_or_zero();
        for axis in 0..3 {
            let share = unit[axis] * unit[axis];
            let direction = Direction::along(axis, unit);
            let Some(light) = self.smallest(place, &[direction]).filter(|_| share > 0.0) else { continue };
            sum.diffuse += light.diffuse * share;
            sum.specular += light.specular * share;
            found += share;
        }
        if found > 0.0 {
            return Some(Light { diffuse: sum.diffuse / found, specular: sum.specular / found });
        }
        // Nothing looks that way.
        self.smallest(place, &Direction::ALL)
    }

    /// The light of the smallest cell around a place that has any, of such directions.
    fn smallest(&self, place: IVec3, directions: &[Direction]) -> Option<Light> {
        self.levels.iter().zip(0..).find_map(|(cells, level)| {
            let mut sum = Cell::default();
            let keys = directions.iter().map(|&direction| key(place >> level, direction));
            keys.filter_map(|key| cells.get(&key)).for_each(|cell| sum.add(cell));
            sum.light()
        })
    }
}

/// The cell of a place; the outermost for what lies beyond.
fn coordinates(position: Vec3, cell: f32) -> IVec3 {
    let last = (1 << BITS) - 1;
    ((position / cell).floor().as_ivec3().saturating_add(IVec3::splat(ORIGIN))).clamp(IVec3::ZERO, IVec3::splat(last))
}

fn key(place: IVec3, direction: Direction) -> u64 {
    let [x, y, z] = place.to_array().map(|coordinate| coordinate as u64);
    ((u64::from(direction.0) << BITS | x) << BITS | y) << BITS | z
}

/// The key of the cell twice as large.
const fn parent(key: u64) -> u64 {
    const LOW: u64 = 1 | 1 << BITS | 1 << (2 * BITS);
    let places = (1 << (3 * BITS)) - 1;
    key & !places | (key & places & !LOW) >> 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(position: Vec3, normal: Vec3, value: f32) -> Sample {
        Sample { position, direction: Direction::of(normal), diffuse: Vec3::splat(value), specular: None, weight: 1.0 }
    }

    fn diffuse(volume: &LightVolume, position: Vec3, normal: Vec3) -> Option<f32> {
        volume.at(position, normal).map(|light| light.diffuse.x)
    }

    #[test]
    fn what_looks_the_same_way_counts_before_what_is_nearer() {
        let samples = [
            sample(Vec3::ZERO, Vec3::Y * 7.0, 1.0),
            sample(Vec3::X * 10.0, Vec3::Y, 3.0),
            sample(Vec3::X * 10.0, Vec3::NEG_X, 8.0),
        ];
        let volume = LightVolume::new(20.0, samples.into_iter());
        let at = |position, normal| diffuse(&volume, position, normal);
        assert_eq!((at(Vec3::X * 0.01, Vec3::Y), at(Vec3::X * 9.99, Vec3::Y)), (Some(1.0), Some(3.0)));
        assert_eq!(at(Vec3::ZERO, Vec3::NEG_X), Some(8.0), "far off, but the only one of its direction");
        let tilted = Vec3::new(-3.0, 1.0, 0.0);
        assert!((at(Vec3::X * 10.0, tilted).unwrap() - (0.9 * 8.0 + 0.1 * 3.0)).abs() < 1e-5);
        assert_eq!(at(Vec3::X * 10.0, Vec3::NEG_Y), Some(5.5), "nothing looks down: the mean of what is there");
    }

    #[test]
    fn cells_grow_until_one_tells_and_samples_count_by_their_weights() {
        let volume = LightVolume::new(
            100.0,
            [(-30.0, 1.0, 1.0), (-31.0, 0.0, 50.0), (33.0, 3.0, 2.0), (34.0, 1.0, 6.0)]
                .into_iter()
                .map(|(x, weight, value)| Sample { weight, ..sample(Vec3::new(x, 1.0, 1.0), Vec3::Z, value) }),
        );
        let at = |x: f32| diffuse(&volume, Vec3::new(x, 1.0, 1.0), Vec3::Z).unwrap();
        assert_eq!((at(-30.0), at(-31.0)), (1.0, 1.0), "what has no value counts nothing");
        assert_eq!((at(33.0), at(34.0)), (2.0, 6.0));
        assert_eq!(at(40.0), 3.0, "of both, by their weights");
        assert!(LightVolume::new(1.0, std::iter::empty()).at(Vec3::ZERO, Vec3::Z).is_none());
    }

    #[test]
    fn specular_light_is_that_of_glossy_surfaces_or_else_as_diffuse_light() {
        let dull = sample(Vec3::ZERO, Vec3::Y, 2.0);
        let glossy = Sample { diffuse: Vec3::splat(4.0), specular: Some(Vec3::splat(9.0)), ..dull };
        let specular = |samples: &[Sample]| {
            LightVolume::new(1.0, samples.iter().copied()).at(Vec3::ZERO, Vec3::Y).unwrap().specular.x
        };
        assert_eq!((specular(&[dull]), specular(&[dull, glossy])), (2.0, 9.0));
    }
}
