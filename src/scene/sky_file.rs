//! What a scene file says of environments and skies.

use super::environment::{Environment, Picture, north};
use super::environment_file;
use super::light::LightKind;
use super::sky_model::{SUN_HALF_ANGLE, SkyModel};
use super::toml_walk::{At, Table};
use glam::{Mat3, Vec3};
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, RefractionCorrection, SolarPositions, delta_t};
use std::f32::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What shines from all around.
pub(super) struct Sky {
    /// The light of the picture.
    pub environment: LightKind,
    /// The sun, a light of its own.
    pub sun: Option<LightKind>,
    /// The file of the picture.
    pub file: Option<PathBuf>,
}

/// Reads a `[[light]]` of the kind `environment`; its file is relative to `directory`.
pub(super) fn read_environment(t: &mut Table, directory: &Path) -> Option<Sky> {
    let radiance = t.colour("radiance");
    let name = t.string("file");
    let rotation = t.number("rotation").map_or(0.0, |at| at.value.to_radians());
    let up = read_up(t);
    let scale = t.factor("scale").map_or(Vec3::ONE, |at| at.value);
    let file = name.as_ref().map(|at| directory.join(&at.value));
    let picture = match (radiance, name) {
        (Some(radiance), None) => Some(Picture::constant((radiance.value * scale).min(Vec3::splat(MOST)))),
        (None, Some(At { line, .. })) => {
            // A scene that is refused anyway needs no picture, but its faults are told with the others.
            let read = environment_file::read(file.as_deref().unwrap_or(directory), scale);
            let told =
                read.map_err(|why| t.error(line, format!("file: {why}: name a .hdr, .exr, .png or .jpg picture")));
            told.ok().map(|decoded| {
                let path = file.as_deref().unwrap_or(directory).display();
                decoded.warnings.iter().for_each(|warning| t.warn(line, format!("{path}: {warning}")));
                decoded.picture
            })
        }
        (Some(radiance), Some(_)) => {
            t.error(radiance.line, "an environment has either radiance or file: leave one out");
            None
        }
        (None, None) => {
            if !t.has("radiance") && !t.has("file") {
                t.error(t.line, "an environment lacks its light: give radiance = [r, g, b] or file = \"picture.hdr\"");
            }
            None
        }
    };
    let environment = Environment::new(Arc::new(picture?), up?, rotation);
    Some(Sky { environment: LightKind::Environment(Arc::new(environment)), sun: None, file })
}

/// Most radiance, so that sums stay finite, W·sr⁻¹·m⁻².
const MOST: f32 = 1e12;

/// The unit direction upwards.
fn read_up(t: &mut Table) -> Option<Vec3> {
    let Some(up) = t.vector("up") else { return (!t.has("up")).then_some(Vec3::Y) };
    let unit = up.value.as_dvec3().normalize_or_zero().as_vec3();
    if unit == Vec3::ZERO {
        t.error(up.line, "up is zero: give a direction");
        return None;
    }
    Some(unit)
}

/// Reads a `[[light]]` of the kind `sky`.
pub(super) fn read_sky(t: &mut Table) -> Option<Sky> {
    let up = read_up(t);
    let ahead = up.and_then(|up| read_north(t, up));
    let turbidity = t.number_in("turbidity", "from 1 to 10", |x| (1.0..=10.0).contains(&x)).map_or(3.0, |at| at.value);
    let ground = read_ground(t);
    let scale = t.factor("scale").map_or(Vec3::ONE, |at| at.value);
    let with_sun = t.boolean("sun").is_none_or(|at| at.value);
    let to_sun = read_sun(t, up.zip(ahead));
    let (up, ahead, to_sun, ground) = (up?, ahead?, to_sun?, ground?);
    let elevation = to_sun.dot(up).clamp(0.0, 1.0).asin();
    let model = SkyModel { elevation, turbidity, ground };
    let axes = Mat3::from_cols(ahead.cross(up), up, ahead);
    let picture = model.picture(axes.transpose() * to_sun, with_sun)?.times(scale);
    let environment = Environment::facing(Arc::new(picture), up, ahead);
    let irradiance = (model.sun_irradiance() * scale).min(Vec3::splat(MOST));
    let radiance = irradiance / (PI * SUN_HALF_ANGLE.sin().powi(2));
    let sun = with_sun.then_some(LightKind::Sun { direction: to_sun, half_angle: SUN_HALF_ANGLE, radiance });
    Some(Sky { environment: LightKind::Environment(Arc::new(environment)), sun, file: None })
}

/// The unit horizontal direction to the north.
fn read_north(t: &mut Table, up: Vec3) -> Option<Vec3> {
    let Some(given) = t.vector("north") else { return (!t.has("north")).then(|| north(up)) };
    let unit = given.value.as_dvec3().normalize_or_zero().as_vec3();
    let level = (unit - up * unit.dot(up)).normalize_or_zero();
    if level == Vec3::ZERO || unit.cross(up).length() < 1e-3 {
        t.error(given.line, "north is zero or points up: give a horizontal direction");
        return None;
    }
    Some(level)
}

/// Reflectance of the ground.
fn read_ground(t: &mut Table) -> Option<Vec3> {
    const USUAL: f32 = 0.2;
    let Some(ground) = t.factor("ground_albedo") else {
        return (!t.has("ground_albedo")).then_some(Vec3::splat(USUAL));
    };
    if ground.value.max_element() > 1.0 {
        t.error(ground.line, format!("ground_albedo must be from 0 to 1, this is {}", ground.value));
        return None;
    }
    Some(ground.value)
}

/// The unit direction to the sun, told as one, as angles, or by place and time. `frame` is up and north, if those are known.
fn read_sun(t: &mut Table, frame: Option<(Vec3, Vec3)>) -> Option<Vec3> {
    let direction = t.vector("sun_direction");
    let elevation = t.number_in("sun_elevation", "degrees from 0 to 90", |e| (0.0..=90.0).contains(&e));
    let azimuth = t.number("sun_azimuth");
    let date = t.date_or_time("date");
    let time = t.date_or_time("time");
    let latitude = t.number_in("latitude", "degrees from -90 to 90", |a| a.abs() <= 90.0);
    let longitude = t.number_in("longitude", "degrees from -180 to 180", |a| a.abs() <= 180.0);
    let offset = t.number_in("utc_offset", "hours from -14 to 14", |h| h.abs() <= 14.0);
    let by_direction = t.has("sun_direction");
    let by_angles = t.has("sun_elevation") || t.has("sun_azimuth");
    let by_time = ["date", "time", "latitude", "longitude", "utc_offset"].iter().any(|key| t.has(key));
    let ways = [by_direction, by_angles, by_time].into_iter().filter(|&way| way).count();
    if ways != 1 {
        let say = "a sky has its sun either by sun_direction, by sun_elevation and sun_azimuth, or by date, time, latitude and longitude";
        t.error(t.line, if ways == 0 { format!("no sun: {say}") } else { format!("too many suns: {say}") });
        return None;
    }
    if by_direction {
        return checked_direction(t, direction?, frame?.0);
    }
    if by_angles {
        let elevation = t.required("sun_elevation", elevation)?;
        let turn = azimuth.map_or((!t.has("sun_azimuth")).then_some(0.0), |at| Some(at.value))?;
        return Some(towards(frame?, [elevation.value.to_radians(), turn.to_radians()]));
    }
    let date = t.required("date", date);
    let time = t.required("time", time);
    let latitude = t.required("latitude", latitude);
    let longitude = t.required("longitude", longitude);
    let offset = offset.map_or(0.0, |at| f64::from(at.value));
    let (date, time, latitude, longitude) = (date?, time?, latitude?, longitude?);
    let place = Location { latitude: f64::from(latitude.value), longitude: f64::from(longitude.value) };
    let found = sun_at(&date.value, &time.value, offset, place).and_then(above_horizon);
    let told = found.map_err(|why| t.error(time.line, why));
    Some(towards(frame?, told.ok()?.map(|degrees| (degrees as f32).to_radians())))
}

/// A direction to the sun as a unit one.
fn checked_direction(t: &mut Table, At { value, line }: At<Vec3>, up: Vec3) -> Option<Vec3> {
    let unit = value.as_dvec3().normalize_or_zero().as_vec3();
    if unit == Vec3::ZERO || unit.dot(up) < 0.0 {
        let message =
            "sun_direction must lead to the sun, above the horizon: there is no model of the sky after sunset";
        t.error(line, message);
        return None;
    }
    Some(unit)
}

/// Elevation and azimuth of the sun, degrees, by day.
fn above_horizon([elevation, azimuth]: [f64; 2]) -> Result<[f64; 2], String> {
    if elevation >= 0.0 {
        return Ok([elevation, azimuth]);
    }
    let below = -elevation;
    Err(format!(
        "the sun is {below:.1}° below the horizon then, and there is no model of the sky after sunset: choose another time"
    ))
}

/// The unit direction at an elevation and an azimuth, clockwise from north, radians.
fn towards((up, north): (Vec3, Vec3), [elevation, azimuth]: [f32; 2]) -> Vec3 {
    let east = north.cross(up);
    let level = north * azimuth.cos() + east * azimuth.sin();
    (level * elevation.cos() + up * elevation.sin()).normalize()
}

/// Elevation and azimuth of the sun, degrees, refraction included, at a date and a time that is `offset` hours ahead of UTC.
fn sun_at(date: &str, time: &str, offset: f64, place: Location) -> Result<[f64; 2], String> {
    let numbers = |text: &str, separator: char| {
        text.split(separator).map(|n| n.parse::<f64>().ok()).collect::<Option<Vec<f64>>>()
    };
    let [year, month, day] = numbers(date, '-')
        .and_then(|n| <[f64; 3]>::try_from(n).ok())
        .ok_or_else(|| format!("date must be year-month-day, as in 2026-06-21, this is {date}"))?;
    let clock = numbers(time, ':').filter(|n| (2..=3).contains(&n.len()));
    let clock = clock.filter(|n| n[0] < 24.0 && n.iter().all(|&x| (0.0..60.0).contains(&x)));
    let clock = clock.ok_or_else(|| format!("time must be hours:minutes, as in 15:30, this is {time}"))?;
    let years = 1900.0..=2100.0;
    if !years.contains(&year) || year.fract() + month.fract() + day.fract() != 0.0 || !(1.0..=12.0).contains(&month) {
        return Err(format!("date must be a day of the years 1900 to 2100, this is {date}"));
    }
    let say = |error: solar_positioning::Error| format!("date {date}, time {time}: {error}");
    let delta = delta_t::estimate_from_date(year as i32, month as u32).map_err(say)?;
    let midnight = JulianDate::from_utc(year as i32, month as u32, day as u32, 0, 0, 0.0, delta).map_err(say)?;
    let hours = clock.iter().zip([1.0, 60.0, 3600.0]).map(|(n, parts)| n / parts).sum::<f64>() - offset;
    let then = JulianDate::new(midnight.julian_date() + hours / 24.0, delta).map_err(say)?;
    let air = Some(RefractionCorrection::standard());
    let position = SolarPositions::new().at_from_julian(then, place, 0.0, air).map_err(say)?;
    Ok([position.elevation_angle(), position.azimuth()])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Almanacs have the sun over Greenwich in the south at noon, at 90° − latitude ± the tilt of the axis at the solstices.
    #[test]
    fn the_sun_is_where_almanacs_have_it() {
        let greenwich = Location { latitude: 51.4769, longitude: 0.0 };
        let at = |date, time| sun_at(date, time, 0.0, greenwich).expect("a time");
        for (date, elevation) in [("2026-06-21", 61.96), ("2026-12-21", 15.14)] {
            let [found, azimuth] = at(date, "12:02");
            assert!((found - elevation).abs() < 0.1 && (azimuth - 180.0).abs() < 1.5, "{date}: {found} {azimuth}");
        }
        let [east, west] = ["06:00", "18:00"].map(|time| at("2026-03-20", time)[1]);
        assert!((east - 90.0).abs() < 3.0 && (west - 270.0).abs() < 3.0, "{east} {west}");
        let there = Location { latitude: 51.4769, longitude: 15.0 };
        let ahead = sun_at("2026-06-21", "13:30:00", 1.0, there).expect("a time");
        assert!((ahead[0] - sun_at("2026-06-21", "12:30", 0.0, there).expect("a time")[0]).abs() < 1e-6);
        for (date, time) in
            [("2026-02-30", "12:00"), ("21.6.2026", "12:00"), ("2026-06-21", "25:00"), ("2026-06-21", "noon")]
        {
            assert!(sun_at(date, time, 0.0, greenwich).is_err(), "{date} {time}");
        }
    }

    #[test]
    fn azimuths_go_from_north_to_east() {
        for up in [Vec3::Y, Vec3::Z] {
            let frame = (up, north(up));
            let east = towards(frame, [0.0, PI / 2.0]);
            assert!(east.distance(Vec3::X) < 1e-6, "{up}: {east}");
            assert!(towards(frame, [PI / 2.0, 1.0]).distance(up) < 1e-6);
        }
        assert!(towards((Vec3::Y, north(Vec3::Y)), [0.0, 0.0]).distance(Vec3::NEG_Z) < 1e-6);
    }
}
