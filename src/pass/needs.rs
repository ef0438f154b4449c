//! What of the shaders a scene needs. A rasteriser on the CPU goes through all of a shader, whatever the conditions in it say, and blends every
//! attachment: pipelines that are made for the scene leave out what no part of it has.

use super::options::RendererOptions;
use super::texture_maps::environment;
use super::update::UpdateMode;
use crate::scene::Scene;
use crate::scene::light::LightKind;
use crate::scene::material::Material;
use crate::scene::texture::{Encoding, Wrap};

/// What some of a scene needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Needs {
    /// Specular luminance.
    pub highlights: bool,
    /// Colours of vertices.
    pub vertex_colours: bool,
    /// Textures of reflectance or emission.
    pub textures: bool,
    /// Textures of emission.
    pub emission_textures: bool,
    /// Textures of high dynamic range.
    pub bright_textures: bool,
    /// Textures whose edge goes on outside of [0, 1].
    pub clamped_textures: bool,
    /// The metallic-roughness model.
    pub metallic_roughness: bool,
    /// Normal maps.
    pub normal_maps: bool,
    /// Textures of numbers.
    pub linear_textures: bool,
    /// Something to be seen where no geometry is.
    pub sky: bool,
}

impl Needs {
    /// What most scenes need some of: pipelines that are made before the scene is known.
    pub(super) const COMMON: Self = Self {
        highlights: true,
        vertex_colours: true,
        textures: true,
        emission_textures: true,
        bright_textures: true,
        clamped_textures: true,
        metallic_roughness: false,
        normal_maps: false,
        linear_textures: false,
        sky: false,
    };

    /// The common ones, and what a scene needs beyond them.
    pub(super) fn at_least(scene: &Scene) -> Self {
        let Self { metallic_roughness, normal_maps, linear_textures, sky, .. } = Self::of(scene);
        Self { metallic_roughness, normal_maps, linear_textures, sky, ..Self::COMMON }
    }

    /// What a scene needs.
    pub(super) fn of(scene: &Scene) -> Self {
        let any = |has: fn(&Material) -> bool| scene.materials.iter().any(has);
        let emission_textures = any(|material| material.map_ke.is_some());
        let mut maps = scene.materials.iter().flat_map(Material::maps);
        Self {
            highlights: any(Material::is_glossy),
            vertex_colours: !scene.colours.is_empty(),
            textures: emission_textures || any(|material| material.map_kd.is_some()),
            emission_textures,
            bright_textures: environment(scene).is_some()
                || scene.textures.iter().any(|texture| texture.encoding() == Encoding::SharedExponent),
            sky: scene
                .lights
                .iter()
                .any(|light| matches!(light.kind, LightKind::Environment(_) | LightKind::Sun { .. })),
            clamped_textures: maps.any(|map| map.wrap != [Wrap::Repeat; 2]),
            metallic_roughness: any(Material::is_metallic_roughness),
            normal_maps: any(|material| material.map_normal.is_some()),
            linear_textures: scene.textures.iter().any(|texture| texture.encoding() == Encoding::Linear),
        }
    }

    /// Values of the specialisation constants of all shaders, by their numbers.
    pub(super) fn constants(self, options: &RendererOptions) -> Constants {
        let of_scene = [
            self.highlights,
            self.vertex_colours,
            self.textures,
            self.emission_textures,
            self.bright_textures,
            self.clamped_textures,
            self.metallic_roughness,
            self.normal_maps,
            self.linear_textures,
            self.sky,
        ];
        let mut constants = [0; CONSTANTS];
        constants[0] = u32::from(options.texel_buffers);
        // Number 1 is the tone-mapping operator, 2 a debug view: the passes that have them say which.
        constants.iter_mut().skip(3).zip(of_scene).for_each(|(constant, is)| *constant = u32::from(is));
        constants
    }

    /// Whether the luminance pass draws S: not where there is none, unless a shader is used that comes with it only.
    pub(super) fn draws_specular(self, options: &RendererOptions) -> bool {
        let others = [UpdateMode::StencilExport, UpdateMode::Lookup];
        self.highlights
            || self.normal_maps
            || options.atomic_counts
            || others.iter().any(|mode| options.modes.contains(mode))
    }
}

/// Specialisation constants of all shaders, by their numbers.
pub(super) type Constants = [u32; CONSTANTS];
const CONSTANTS: usize = 13;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::material::Material;
    use crate::scene::material::Model;
    use crate::scene::texture::TextureId;
    use glam::Vec3;

    #[test]
    fn a_scene_needs_what_any_of_its_materials_does() {
        let grey = Material::grey("grey");
        let bare = Needs::of(&Scene::default());
        let of = |material: Material| Needs::of(&Scene { materials: vec![grey.clone(), material], ..Scene::default() });
        let map = Some(TextureId(0).into());
        assert_eq!(of(grey.clone()), bare);
        assert_eq!(
            of(Material { model: Model::phong(Vec3::X, 0.0), ..grey.clone() }),
            Needs { highlights: true, ..bare }
        );
        assert_eq!(of(Material { map_kd: map, ..grey.clone() }), Needs { textures: true, ..bare });
        let emission = Needs { textures: true, emission_textures: true, ..bare };
        assert_eq!(of(Material { map_ke: map, ..grey.clone() }), emission);
        let coloured = Scene { colours: vec![[Vec3::ONE; 3]], ..Scene::default() };
        assert_eq!(Needs::of(&coloured), Needs { vertex_colours: true, ..bare });
    }
}
