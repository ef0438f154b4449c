//! Vertices whose light is unknown take on what is known around them, so that none is black for want of knowledge.

use glam::Vec3;

/// Weight below which a vertex is unknown: valid ones have 1, those that other geometry covers a little, those without any value 0.
const KNOWN: f32 = 0.5;

/// Light by slot: the sum, and each part of it that is asked for.
#[derive(Clone, Debug, Default)]
pub struct SlotLight {
    /// Weight of interpolation.
    pub weights: Vec<f32>,
    /// D of all light first, W·sr⁻¹·m⁻², then its parts; each by slot.
    pub layers: Vec<Vec<Vec3>>,
}

impl SlotLight {
    /// Fills unknown slots from `triangles`, ring by ring: each takes the mean of what its triangles know. What no ring reaches keeps the
    /// value that it has, if it is covered, or takes the mean of all that is known. Returns how many slots of the triangles were filled.
    pub fn fill(&mut self, triangles: &[[u32; 3]]) -> usize {
        let mut known: Vec<bool> = self.weights.iter().map(|weight| *weight >= KNOWN).collect();
        let mut open: Vec<[u32; 3]> =
            triangles.iter().filter(|t| t.iter().any(|&slot| !known[slot as usize])).copied().collect();
        let mut filled = 0;
        loop {
            let ring = self.next_ring(&open, &known);
            if ring.is_empty() {
                break;
            }
            filled += ring.len();
            ring.iter().for_each(|&slot| known[slot as usize] = true);
            open.retain(|t| t.iter().any(|&slot| !known[slot as usize]));
        }
        filled + self.fill_rest(&open, &known)
    }

    /// Fills unknown slots that have known neighbours; returns which, ascending.
    fn next_ring(&mut self, open: &[[u32; 3]], known: &[bool]) -> Vec<u32> {
        let mut wanted: Vec<(u32, u32)> = Vec::new();
        for triangle in open {
            let (of, to): (Vec<u32>, Vec<u32>) = triangle.iter().partition(|&&slot| known[slot as usize]);
            wanted.extend(to.iter().flat_map(|&to| of.iter().map(move |&of| (to, of))));
        }
        wanted.sort_unstable();
        wanted.dedup();
        let runs: Vec<&[(u32, u32)]> = wanted.chunk_by(|a, b| a.0 == b.0).collect();
        for layer in &mut self.layers {
            for run in &runs {
                let sum: Vec3 = run.iter().map(|&(_, of)| layer[of as usize]).sum();
                layer[run[0].0 as usize] = sum / run.len() as f32;
            }
        }
        runs.iter().map(|run| run[0].0).collect()
    }

    fn fill_rest(&mut self, open: &[[u32; 3]], known: &[bool]) -> usize {
        let mut rest: Vec<usize> = open.iter().flatten().map(|&slot| slot as usize).filter(|&s| !known[s]).collect();
        rest.sort_unstable();
        rest.dedup();
        let all: Vec<usize> = (0..known.len()).filter(|&slot| self.weights[slot] >= KNOWN).collect();
        for layer in &mut self.layers {
            let sum: glam::DVec3 = all.iter().map(|&slot| layer[slot].as_dvec3()).sum();
            let mean = (sum / all.len().max(1) as f64).as_vec3();
            rest.iter().filter(|&&slot| self.weights[slot] == 0.0).for_each(|&slot| layer[slot] = mean);
        }
        rest.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_grow_from_what_is_known() {
        let values = [2.0, 4.0, 0.0, 0.0, 7.0, 9.0, 0.0, 0.0].map(Vec3::splat);
        let weights = [1.0, 1.0, 0.0, 4e-3, 1.0, 4e-3, 0.0, 0.0].to_vec();
        let mut light = SlotLight { weights, layers: vec![values.to_vec(), values.map(|v| v * 10.0).to_vec()] };
        // Slot 2 touches 0 and 1, slot 3 only 2 of those; 5 and 6 touch nothing known, 7 no triangle.
        let filled = light.fill(&[[0, 1, 2], [1, 2, 0], [2, 3, 3], [5, 6, 5]]);
        assert_eq!(filled, 4);
        let mean = (2.0 + 4.0 + 7.0) / 3.0;
        assert_eq!(light.layers[0], [2.0, 4.0, 3.0, 3.0, 7.0, 9.0, mean, 0.0].map(Vec3::splat));
        assert!((light.layers[1][3] - 30.0).length() < 1e-5);
    }
}
