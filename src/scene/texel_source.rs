//! From decoded images to texels: what a material asks of an image, and what that means for this one.

use super::map_options::{Channel, MapOptions};
use super::mipmap;
use super::texel::{Encoding, SRGB, of_srgb, shared_exponent, srgb_code};
use super::texture::Texture;
use glam::Vec3;
use image::DynamicImage;
use rayon::prelude::*;

/// What an image is for: one file may be both a colour and a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// A reflectance: RGB up to 1.
    Colour,
    /// A radiance: RGB of any brightness.
    Emission,
    /// A mask: one channel, by default alpha where it says something, else luminance.
    Mask,
    /// Numbers, not a colour: RGB from 0 to 1, linear.
    Data,
    /// A mask: alpha, where some of it lies below the threshold of cut-outs.
    Cut,
    /// The mask of a material that names none: alpha, where that is on both sides of the threshold of cut-outs.
    CutOut,
}

/// What a material asks of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Recipe {
    role: Role,
    channel: Option<Channel>,
    levels: Levels,
}

impl Recipe {
    /// What a texture statement with these options asks of its image.
    pub(super) fn new(role: Role, options: &MapOptions) -> Self {
        let levels = Levels { base: options.base, gain: options.gain };
        match role {
            Role::Colour | Role::Emission | Role::Data => Self { role, channel: None, levels },
            Role::Cut => Self { role, channel: None, levels },
            Role::Mask => Self { role, channel: options.channel.filter(|&c| c != Channel::Z), levels },
            // The options are those of the colour.
            Role::CutOut => Self { role, channel: None, levels: Levels::AS_THEY_ARE },
        }
    }

    /// What the texels hold; `None` where the image has nothing to say.
    fn content(self, image: &DynamicImage) -> Option<Content> {
        match self.role {
            Role::Emission if is_float(image) || self.levels != Levels::AS_THEY_ARE => {
                Some(Content::Bright(self.levels))
            }
            Role::Colour | Role::Emission => Some(Content::Colour(self.levels)),
            Role::Data => Some(Content::Data),
            Role::Mask => {
                let says_something = || alpha_range(image).is_some_and(|[low, high]| low != high);
                let usual = || if says_something() { Channel::M } else { Channel::L };
                Some(Content::Scalar(self.channel.unwrap_or_else(usual), self.levels))
            }
            Role::Cut => {
                let content = Content::Scalar(Channel::M, self.levels);
                alpha_range(image).filter(|range| self.levels.code(range[0]) < OPAQUE).map(|_| content)
            }
            Role::CutOut => {
                let [low, high] = alpha_range(image)?;
                let cuts = low < OPAQUE && high >= OPAQUE;
                cuts.then_some(Content::Scalar(Channel::M, self.levels))
            }
        }
    }
}

/// Least code that is opaque.
const OPAQUE: u8 = 128;

/// `-mm`: texels are base + gain · value, colours in linear light.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Levels {
    base: f32,
    gain: f32,
}

impl Levels {
    const AS_THEY_ARE: Self = Self { base: 0.0, gain: 1.0 };

    fn of(self, colour: Vec3) -> Vec3 {
        colour * self.gain + self.base
    }

    /// What a code of a mask becomes.
    fn code(self, code: u8) -> u8 {
        let value = self.of(Vec3::splat(f32::from(code) / 255.0)).x;
        (value.clamp(0.0, 1.0) * 255.0).round() as u8
    }
}

/// What texels hold.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Content {
    /// sRGB, alpha 1.
    Colour(Levels),
    /// By shared exponent.
    Bright(Levels),
    /// Linear, alpha 1.
    Data,
    /// White, with the mask in alpha.
    Scalar(Channel, Levels),
}

impl Content {
    const fn encoding(self) -> Encoding {
        match self {
            Self::Bright(_) => Encoding::SharedExponent,
            Self::Data => Encoding::Linear,
            Self::Colour(_) | Self::Scalar(..) => Encoding::Srgb,
        }
    }
}

/// The textures that `recipes` make of an image, and the one of each recipe. Recipes that come to the same share one.
pub(super) fn textures(name: &str, image: DynamicImage, recipes: &[Recipe]) -> (Vec<Texture>, Vec<Option<usize>>) {
    let extent = [image.width(), image.height()];
    let mut contents: Vec<Content> = Vec::new();
    let of_recipe = recipes.iter().map(|recipe| {
        let content = recipe.content(&image)?;
        Some(contents.iter().position(|&known| known == content).unwrap_or_else(|| {
            contents.push(content);
            contents.len() - 1
        }))
    });
    let of_recipe = of_recipe.collect();
    let room = mipmap::chain_length(&mipmap::extents(extent[0], extent[1]));
    let texels: Vec<_> = contents.iter().map(|&content| (content, texels(&image, content, room))).collect();
    // Before the mip chains are made: it may take a gigabyte.
    drop(image);
    let texture =
        |(content, texels): (Content, _)| Texture::encoded(name.to_owned(), extent, texels, content.encoding());
    (texels.into_iter().map(texture).collect(), of_recipe)
}

fn texels(image: &DynamicImage, content: Content, room: usize) -> Vec<[u8; 4]> {
    match content {
        Content::Colour(levels) if is_float(image) => from_floats(image, room, |c| {
            let [r, g, b] = levels.of(c).to_array().map(srgb_code);
            [r, g, b, 255]
        }),
        Content::Data | Content::Colour(Levels::AS_THEY_ARE) => from_bytes(image, room, |[r, g, b, _]| [r, g, b, 255]),
        Content::Colour(levels) => {
            let codes: [u8; 256] = std::array::from_fn(|i| srgb_code(levels.of(Vec3::splat(SRGB[i])).x));
            let code = |c: u8| codes[c as usize];
            from_bytes(image, room, |[r, g, b, _]| [code(r), code(g), code(b), 255])
        }
        Content::Bright(levels) if is_float(image) => from_floats(image, room, |c| shared_exponent(levels.of(c))),
        Content::Bright(levels) => from_bytes(image, room, |t| shared_exponent(levels.of(of_srgb(t, &SRGB)))),
        Content::Scalar(channel, levels) => {
            from_bytes(image, room, |texel| [255, 255, 255, levels.code(scalar(texel, channel))])
        }
    }
}

/// One channel of an RGBA texel; codes count as linear.
fn scalar([r, g, b, a]: [u8; 4], channel: Channel) -> u8 {
    match channel {
        Channel::R => r,
        Channel::G => g,
        Channel::B => b,
        Channel::M => a,
        Channel::L | Channel::Z => {
            // Rec. 709.
            let sum = 2126 * u32::from(r) + 7152 * u32::from(g) + 722 * u32::from(b);
            ((sum + 5_000) / 10_000) as u8
        }
    }
}

const fn is_float(image: &DynamicImage) -> bool {
    matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_))
}

/// Smallest and largest code of alpha; `None` without.
fn alpha_range(image: &DynamicImage) -> Option<[u8; 2]> {
    if !image.color().has_alpha() {
        return None;
    }
    let range = |bytes: &[u8], channels: usize| {
        let alphas = bytes.par_chunks_exact(channels).with_min_len(MIN_PIXELS).map(|pixel| pixel[channels - 1]);
        alphas.map(|a| [a, a]).reduce(|| [255, 0], |a, b| [a[0].min(b[0]), a[1].max(b[1])])
    };
    Some(match image {
        DynamicImage::ImageRgba8(rgba) => range(rgba, 4),
        DynamicImage::ImageLumaA8(grey) => range(grey, 2),
        other => range(&other.to_rgba8(), 4),
    })
}

/// Pixels that a worker takes at least.
const MIN_PIXELS: usize = 1 << 14;

/// Texels from the pixels as RGBA of eight bits, with room for `room` texels.
fn from_bytes(image: &DynamicImage, room: usize, texel: impl Fn([u8; 4]) -> [u8; 4] + Sync + Send) -> Vec<[u8; 4]> {
    let all = |bytes: &[u8], channels, rgba: fn(&[u8]) -> [u8; 4]| each(bytes, channels, room, |p| texel(rgba(p)));
    match image {
        DynamicImage::ImageLuma8(grey) => all(grey, 1, |p| [p[0], p[0], p[0], 255]),
        DynamicImage::ImageLumaA8(grey) => all(grey, 2, |p| [p[0], p[0], p[0], p[1]]),
        DynamicImage::ImageRgb8(rgb) => all(rgb, 3, |p| [p[0], p[1], p[2], 255]),
        DynamicImage::ImageRgba8(rgba) => all(rgba, 4, |p| [p[0], p[1], p[2], p[3]]),
        other => all(&other.to_rgba8(), 4, |p| [p[0], p[1], p[2], p[3]]),
    }
}

/// Texels from linear pixels; black where the image has none.
fn from_floats(image: &DynamicImage, room: usize, texel: impl Fn(Vec3) -> [u8; 4] + Sync + Send) -> Vec<[u8; 4]> {
    let all = |floats: &[f32], channels| each(floats, channels, room, |p| texel(Vec3::from_slice(p)));
    match image {
        DynamicImage::ImageRgba32F(rgba) => all(rgba, 4),
        DynamicImage::ImageRgb32F(rgb) => all(rgb, 3),
        other => all(&other.to_rgb32f(), 3),
    }
}

fn each<T: Sync>(
    pixels: &[T],
    channels: usize,
    room: usize,
    texel: impl Fn(&[T]) -> [u8; 4] + Sync + Send,
) -> Vec<[u8; 4]> {
    let mut texels = Vec::with_capacity(room);
    pixels.par_chunks_exact(channels).with_min_len(MIN_PIXELS).map(texel).collect_into_vec(&mut texels);
    texels
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two texels, their alpha on either side of the threshold.
    fn image() -> DynamicImage {
        image::RgbaImage::from_vec(2, 1, vec![10, 20, 30, 40, 50, 60, 70, 240]).map(Into::into).expect("two texels")
    }

    fn texels_of(role: Role, options: MapOptions) -> (Encoding, Vec<[u8; 4]>) {
        let (textures, of_recipe) = textures("a", image(), &[Recipe::new(role, &options)]);
        assert_eq!(of_recipe, [Some(0)]);
        (textures[0].encoding(), textures[0].texels()[..2].to_vec())
    }

    #[test]
    fn a_mask_is_the_channel_that_is_asked_for() {
        use Channel::{B, G, L, M, R, Z};
        let luminances = [19, 59];
        for (channel, expected) in [
            (Some(R), [10, 50]),
            (Some(G), [20, 60]),
            (Some(B), [30, 70]),
            (Some(M), [40, 240]),
            (Some(L), luminances),
            (Some(Z), [40, 240]),
            (None, [40, 240]),
        ] {
            let (_, texels) = texels_of(Role::Mask, MapOptions { channel, ..MapOptions::default() });
            assert_eq!(texels.iter().map(|t| t[3]).collect::<Vec<_>>(), expected, "{channel:?}");
        }
        let grey = DynamicImage::from(image::GrayImage::from_pixel(1, 1, image::Luma([77])));
        let (grey, _) = textures("a", grey, &[Recipe::new(Role::Mask, &MapOptions::default())]);
        assert_eq!(grey[0].texels()[0][3], 77, "without alpha, luminance");
    }

    #[test]
    fn base_and_gain_are_in_linear_light() {
        let options = MapOptions { base: 0.1, gain: 0.5, ..MapOptions::default() };
        let (_, colours) = texels_of(Role::Colour, options);
        for (changed, plain) in colours[1].iter().zip([50, 60, 70]) {
            let expected = 0.1 + 0.5 * SRGB[plain];
            assert!((SRGB[*changed as usize] - expected).abs() < 3e-3, "{plain}: {changed}");
        }
        let (_, masks) = texels_of(Role::Mask, MapOptions { channel: Some(Channel::M), ..options });
        assert_eq!(masks[1][3], (25.5_f32 + 120.0).round() as u8);
        // Emission may exceed 1.
        let (encoding, bright) = texels_of(Role::Emission, MapOptions { gain: 100.0, ..MapOptions::default() });
        assert_eq!(encoding, Encoding::SharedExponent);
        let found = super::super::texel::of_shared_exponent(bright[1]);
        assert!((found.x - 100.0 * SRGB[50]).abs() < 0.02, "{found}");
    }

    #[test]
    fn what_comes_to_the_same_is_one_texture() {
        let recipe = |role| Recipe::new(role, &MapOptions::default());
        let roles = [Role::Colour, Role::Emission, Role::Mask, Role::CutOut].map(recipe);
        let (made, of_recipe) = textures("a", image(), &roles);
        assert_eq!((made.len(), of_recipe), (2, vec![Some(0), Some(0), Some(1), Some(1)]));
    }
}
