//! A clear sky and its sun: sky radiance after Hošek and Wilkie \[HW12\] (the crate `hw-skymodel` has their tables), the sun's through the
//! atmosphere of Preetham, Shirley and Smits \[PSS99\].
//!
//! Both are tristimulus values in Rec.709 of spectral radiance, ∫ L_λ x̄(λ) dλ and so on without a factor: 683 lm·W⁻¹ times the luminance of a
//! colour is what a photometer measures, cd·m⁻².

use super::environment::Picture;
use crate::math::luminance;
use glam::Vec3;
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use rayon::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI};

/// What a sky depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SkyModel {
    /// Elevation of the sun over the horizon, radians, from 0 to π/2.
    pub elevation: f32,
    /// Haze, 1 (none) to 10.
    pub turbidity: f32,
    /// Reflectance of the ground, by channel.
    pub ground: Vec3,
}

/// Columns and rows of the picture of a sky: a third of a degree each.
const SIZE: [u32; 2] = [1024, 512];

/// Half of the angle that the sun takes, radians: 0.53° across.
pub(super) const SUN_HALF_ANGLE: f32 = 0.265 * PI / 180.0;

impl SkyModel {
    /// The sky with the sun in the direction `sun` of the picture's own frame, and below the horizon the ground that sky and sun shine on.
    /// `None` outside of the model's range.
    pub(super) fn picture(&self, sun: Vec3, with_sun: bool) -> Option<Picture> {
        let Self { elevation, turbidity, ground } = *self;
        let elevation = elevation.clamp(0.0, FRAC_PI_2);
        let state = SkyState::new(&SkyParams { elevation, turbidity, albedo: ground.to_array() }).ok()?;
        let [width, height] = SIZE;
        let direction = |row: u32, column: u32| {
            let (sin_down, cos_down) = ((row as f32 + 0.5) * PI / height as f32).sin_cos();
            let turn = ((column as f32 + 0.5) / width as f32 - 0.5) * 2.0 * PI;
            Vec3::new(sin_down * turn.sin(), cos_down, sin_down * turn.cos())
        };
        let row_of_sky = |row: u32| (0..width).map(move |column| sky(&state, direction(row, column), sun));
        let mut texels: Vec<Vec3> = (0..height / 2).into_par_iter().flat_map_iter(row_of_sky).collect();
        let cosine = |row: usize| ((row as f32 + 0.5) * PI / height as f32).cos();
        let solid_angle = |row: usize| {
            2.0 * ((row as f32 + 0.5) * PI / height as f32).sin() * (PI / (2 * height) as f32).sin() * 2.0 * PI
        };
        let rows = texels.chunks(width as usize).enumerate();
        let of_row = |(row, texels): (usize, &[Vec3])| {
            texels.iter().sum::<Vec3>() / width as f32 * solid_angle(row) * cosine(row)
        };
        let from_sun = if with_sun { self.sun_irradiance() * elevation.sin() } else { Vec3::ZERO };
        let ground = ground * (rows.map(of_row).sum::<Vec3>() + from_sun) / PI;
        texels.resize((width * height) as usize, ground);
        Some(Picture::new(SIZE, texels))
    }

    /// Irradiance of the sun on a plane facing it, W·m⁻² weighed as above.
    pub(super) fn sun_irradiance(&self) -> Vec3 {
        let xyz: Vec3 = SOLAR.iter().map(|band| matching(band.0) * (band.1 * self.transmittance(band) * STEP)).sum();
        let rgb = Vec3::new(
            3.240_97 * xyz.x - 1.537_38 * xyz.y - 0.498_61 * xyz.z,
            -0.969_24 * xyz.x + 1.875_97 * xyz.y + 0.041_56 * xyz.z,
            0.055_63 * xyz.x - 0.203_98 * xyz.y + 1.056_97 * xyz.z,
        );
        // A low red sun is more saturated than Rec.709 can be: what is negative is cut off, the luminance stays.
        let inside = rgb.max(Vec3::ZERO);
        inside * (xyz.y / luminance(inside).max(f32::MIN_POSITIVE))
    }

    /// Share of the sun's light of a band that arrives, \[PSS99\] appendix A.1.
    fn transmittance(&self, &(nanometres, _, ozone, water): &Band) -> f32 {
        let (elevation, micrometres) = (self.elevation.clamp(0.0, FRAC_PI_2), nanometres / 1000.0);
        let zenith = 90.0 - elevation.to_degrees();
        let mass = 1.0 / (elevation.sin() + 0.15 * (93.885 - zenith).powf(-1.253));
        let rayleigh = 0.008_735 * micrometres.powf(-4.08);
        let aerosols = (0.046_083_66 * self.turbidity - 0.045_860_26).max(0.0) * micrometres.powf(-1.3);
        let vapour = water * VAPOUR * mass;
        let depth = mass * (rayleigh + aerosols + ozone * OZONE) + 0.2385 * vapour / (1.0 + 20.07 * vapour).powf(0.45);
        (-depth).exp()
    }
}

/// Sky radiance in a direction above the horizon, W·sr⁻¹·m⁻² weighed as above.
fn sky(state: &SkyState, direction: Vec3, sun: Vec3) -> Vec3 {
    let theta = direction.y.clamp(0.0, 1.0).acos();
    let gamma = direction.dot(sun).clamp(-1.0, 1.0).acos();
    let [r, g, b] = [Channel::R, Channel::G, Channel::B].map(|channel| state.radiance(theta, gamma, channel));
    // Colours that Rec.709 does not hold have negative channels.
    Vec3::new(r, g, b).max(Vec3::ZERO)
}

/// Ozone and water vapour in the air, cm.
const OZONE: f32 = 0.35;
const VAPOUR: f32 = 2.0;
/// Width of a band, nm.
const STEP: f32 = 10.0;

/// Wavelength, nm; the sun's irradiance before the atmosphere, W·m⁻²·nm⁻¹; absorption by ozone and by water vapour, cm⁻¹.
type Band = (f32, f32, f32, f32);

/// Solid angle by which the table of \[PSS99\] holds the sun's radiance, sr, for cm⁻² µm⁻¹ in W·m⁻²·nm⁻¹.
const fn band(nanometres: f32, radiance: f32, ozone: f32, water: f32) -> Band {
    const SOLID_ANGLE: f32 = 6.7443e-5;
    (nanometres, radiance * SOLID_ANGLE, ozone, water)
}

/// The visible sun, \[PSS99\] table 2. Mixed gases absorb beyond 750 nm only.
const SOLAR: [Band; 38] = [
    band(380.0, 16559.0, 0.0, 0.0),
    band(390.0, 16233.7, 0.0, 0.0),
    band(400.0, 21127.5, 0.0, 0.0),
    band(410.0, 25888.2, 0.0, 0.0),
    band(420.0, 25829.1, 0.0, 0.0),
    band(430.0, 24232.3, 0.0, 0.0),
    band(440.0, 26760.5, 0.0, 0.0),
    band(450.0, 29658.3, 0.003, 0.0),
    band(460.0, 30545.4, 0.006, 0.0),
    band(470.0, 30057.5, 0.009, 0.0),
    band(480.0, 30663.7, 0.014, 0.0),
    band(490.0, 28830.4, 0.021, 0.0),
    band(500.0, 28712.1, 0.03, 0.0),
    band(510.0, 27825.0, 0.04, 0.0),
    band(520.0, 27100.6, 0.048, 0.0),
    band(530.0, 27233.6, 0.063, 0.0),
    band(540.0, 26361.3, 0.075, 0.0),
    band(550.0, 25503.8, 0.085, 0.0),
    band(560.0, 25060.2, 0.103, 0.0),
    band(570.0, 25311.6, 0.12, 0.0),
    band(580.0, 25355.9, 0.12, 0.0),
    band(590.0, 25134.2, 0.115, 0.0),
    band(600.0, 24631.5, 0.125, 0.0),
    band(610.0, 24173.2, 0.12, 0.0),
    band(620.0, 23685.3, 0.105, 0.0),
    band(630.0, 23212.1, 0.09, 0.0),
    band(640.0, 22827.7, 0.079, 0.0),
    band(650.0, 22339.8, 0.067, 0.0),
    band(660.0, 21970.2, 0.057, 0.0),
    band(670.0, 21526.7, 0.048, 0.0),
    band(680.0, 21097.9, 0.036, 0.0),
    band(690.0, 20728.3, 0.028, 0.016),
    band(700.0, 20240.4, 0.023, 0.024),
    band(710.0, 19870.8, 0.018, 0.0125),
    band(720.0, 19427.2, 0.014, 1.0),
    band(730.0, 19072.4, 0.011, 0.87),
    band(740.0, 18628.9, 0.01, 0.061),
    band(750.0, 18259.2, 0.009, 0.001),
];

/// Colour-matching functions of CIE 1931 at a wavelength, nm, by the sums of lobes of \[WSS13\].
fn matching(nanometres: f32) -> Vec3 {
    let lobe = |height: f32, middle: f32, left: f32, right: f32| {
        let t = (nanometres - middle) / if nanometres < middle { left } else { right };
        height * (-0.5 * t * t).exp()
    };
    Vec3::new(
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) - lobe(0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(elevation: f32, turbidity: f32) -> SkyModel {
        SkyModel { elevation: elevation.to_radians(), turbidity, ground: Vec3::splat(0.2) }
    }

    /// Illuminance in klx of light given as colours.
    fn kilolux(irradiance: Vec3) -> f32 {
        luminance(irradiance) * 0.683
    }

    #[test]
    fn the_sun_is_as_bright_as_measured() {
        let above_the_air: f32 = SOLAR.iter().map(|band| band.1 * matching(band.0).y * STEP).sum();
        assert!(
            (125.0..140.0).contains(&(above_the_air * 0.683)),
            "solar illuminance constant 133 klx: {above_the_air}"
        );
        let [noon, evening] = [60.0, 5.0].map(|elevation| model(elevation, 2.5).sun_irradiance());
        assert!((80.0..115.0).contains(&kilolux(noon)), "{noon}");
        assert!((5.0..35.0).contains(&kilolux(evening)), "{evening}");
        let redness = |c: Vec3| c.x / c.z;
        assert!(redness(evening) > 3.0 * redness(noon) && noon.min_element() > 0.0, "{noon} {evening}");
    }

    #[test]
    fn the_sky_is_blue_above_and_as_bright_as_measured() {
        let sky = model(45.0, 2.5);
        let sun = Vec3::new(0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt());
        let picture = sky.picture(sun, true).expect("in range");
        let [width, height] = picture.size();
        let at = |row: u32, column: u32| picture.texels()[(row * width + column) as usize];
        let zenith = at(0, 0);
        assert!(zenith.z > 1.5 * zenith.x, "{zenith}");
        let row = |row: u32| (0..width).map(|column| at(row, column)).sum::<Vec3>() * picture.solid_angle(row);
        let middle = |row: u32| (picture.cosine(row) + picture.cosine(row + 1)) * 0.5;
        let horizontal: Vec3 = (0..height / 2).map(|y| row(y) * middle(y)).sum();
        // Clear skies measure 10 to 20 klx of diffuse light at that elevation.
        assert!((7.0..25.0).contains(&kilolux(horizontal)), "{horizontal}");
        let ground = (horizontal + sky.sun_irradiance() * 0.5_f32.sqrt()) * 0.2 / PI;
        assert!((at(height - 1, 0) / ground - 1.0).abs().max_element() < 1e-3, "{ground}");
        assert!(
            at(height / 2 - 1, width / 2) != ground && at(height / 2, width / 2) == at(height - 1, 0),
            "the horizon"
        );
    }
}
