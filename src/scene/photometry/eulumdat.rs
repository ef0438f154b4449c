//! EULUMDAT: one value a line, as Stockmar wrote it down in 1990.

use super::distribution::{Distribution, Symmetry, System};
use super::fault::Fault;
use super::lines::Lines;

/// Most sets of lamps: the format knows 20.
const MAX_SETS: f32 = 20.0;

pub(super) fn parse(text: &str) -> Result<Distribution, Fault> {
    let mut lines = Lines::new(text);
    skip(&mut lines, 1, "the company")?;
    lines
        .number_of_line("the type (line 2)")
        .map_err(|fault| Fault { message: format!("{}: is it an LDT or IES file?", fault.message), ..fault })?;
    let symmetry = lines.number_of_line("the symmetry (line 3)")?;
    let symmetry_line = lines.line;
    let planes = lines.number_of_line("the number of planes (line 4)")?;
    let planes = lines.count(planes, "the number of planes")?;
    lines.number_of_line("the distance of planes (line 5)")?;
    let angles = lines.number_of_line("the number of angles (line 6)")?;
    let angles = lines.count(angles, "the number of angles")?;
    lines.number_of_line("the distance of angles (line 7)")?;
    skip(&mut lines, 16, "the names and sizes")?;
    let conversion = lines.number_of_line("the conversion factor (line 24)")?;
    skip(&mut lines, 1, "the tilt")?;
    let flux = lamps(&mut lines)?;
    skip(&mut lines, 10, "the direct ratios")?;
    let list = |lines: &mut Lines<'_>, count: usize, what: &str| -> Result<Vec<f32>, Fault> {
        (0..count).map(|_| lines.number_of_line(what)).collect()
    };
    let all_planes = list(&mut lines, planes, "the angle of a plane")?;
    let angle_list = list(&mut lines, angles, "an angle")?;
    let angle_line = lines.line;
    let (symmetry, measured) = measured(symmetry, planes).ok_or_else(|| {
        let message = format!(
            "symmetry {symmetry} of {planes} planes: 0 to 4 are known, and their planes come in quarters or halves"
        );
        Fault::new(symmetry_line, message)
    })?;
    let mut candela = list(&mut lines, measured.len() * angles, "an intensity")?;
    // Given for 1,000 lumen of the lamps.
    let factor = if conversion > 0.0 { conversion } else { 1.0 } * flux / 1000.0;
    if candela.iter().any(|&c| c < 0.0 || !(c * factor).is_finite()) {
        return Err(Fault::new(lines.line, "an intensity is negative or too large"));
    }
    candela.iter_mut().for_each(|c| *c *= factor);
    let planes: Vec<f32> = measured.iter().map(|&plane| all_planes[plane]).collect();
    let (planes, candela) = in_order(symmetry, planes, candela, angles);
    Distribution::new(System::C(symmetry), planes, angle_list, candela, angle_line)
}

fn skip(lines: &mut Lines<'_>, count: usize, what: &str) -> Result<(), Fault> {
    for _ in 0..count {
        if lines.next_line().is_none() {
            return Err(Fault::new(lines.line.max(1), format!("the file ends where {what} should stand")));
        }
    }
    Ok(())
}

/// Luminous flux of all lamps of the first set, lumen. A negative number of lamps says that the flux is absolute.
fn lamps(lines: &mut Lines<'_>) -> Result<f32, Fault> {
    let sets = lines.number_of_line("the number of sets of lamps (line 26)")?;
    if !(1.0..=MAX_SETS).contains(&sets) || sets.fract() != 0.0 {
        return Err(Fault::new(
            lines.line,
            format!("the number of sets of lamps is {sets}: 1 to {MAX_SETS} are expected"),
        ));
    }
    let sets = sets as usize;
    lines.number_of_line("the number of lamps")?;
    skip(lines, sets - 1 + sets, "the lamps")?;
    let flux = lines.number_of_line("the luminous flux of the lamps")?;
    if flux <= 0.0 {
        return Err(Fault::new(lines.line, format!("the luminous flux of the lamps is {flux}: it must be above 0")));
    }
    skip(lines, sets - 1 + 3 * sets, "the lamps")?;
    Ok(flux)
}

/// What a symmetry means, and which planes of all are measured.
fn measured(symmetry: f32, planes: usize) -> Option<(Symmetry, Vec<usize>)> {
    let halves = planes.is_multiple_of(2);
    let quarters = planes.is_multiple_of(4);
    Some(match symmetry {
        0.0 => (Symmetry::None, (0..planes).collect()),
        1.0 => (Symmetry::Rotation, vec![0]),
        2.0 if halves && planes > 1 => (Symmetry::About0, (0..=planes / 2).collect()),
        3.0 if quarters => {
            let first = 3 * planes / 4;
            (Symmetry::About90, (0..=planes / 2).map(|i| (first + i) % planes).collect())
        }
        4.0 if quarters => (Symmetry::Quarter, (0..=planes / 4).collect()),
        _ => return None,
    })
}

/// The planes from 270° by 0° to 90° are the mirror images of those from 270° by 180° to 90°: as these, ascending.
fn in_order(symmetry: Symmetry, planes: Vec<f32>, candela: Vec<f32>, angles: usize) -> (Vec<f32>, Vec<f32>) {
    if symmetry != Symmetry::About90 {
        return (planes, candela);
    }
    let mirrored = planes.iter().map(|plane| (180.0 - plane).rem_euclid(360.0)).rev().collect();
    (mirrored, candela.chunks(angles).rev().flatten().copied().collect())
}
