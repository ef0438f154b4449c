//! IES LM-63, of 1986 to 2019.

use super::distribution::{Distribution, Symmetry, System};
use super::fault::Fault;
use super::lines::Lines;

/// Most pairs of a tilt.
const MAX_TILTS: f32 = 1000.0;

pub(super) fn parse(text: &str) -> Result<Distribution, Fault> {
    let mut lines = Lines::new(text);
    let tilt = tilt(&mut lines)?;
    let [_lamps, _lumens, factor] = header(&mut lines, ["number of lamps", "lumens per lamp", "the multiplier"])?;
    let [vertical, horizontal, kind] =
        header(&mut lines, ["number of vertical angles", "number of horizontal angles", "the photometric type"])?;
    let (vertical, horizontal) =
        (lines.count(vertical, "number of vertical angles")?, lines.count(horizontal, "number of horizontal angles")?);
    let kind_line = lines.line;
    header(&mut lines, ["the unit", "the width", "the length", "the height"])?;
    let [ballast, lamp_ballast, _watts] =
        header(&mut lines, ["the ballast factor", "the ballast-lamp factor", "the watts"])?;
    // Of 1995, "for future use", and 0 where nobody thought of it.
    let lamp_ballast = if lamp_ballast > 0.0 { lamp_ballast } else { 1.0 };
    let factor = factor * ballast * lamp_ballast;
    if factor <= 0.0 || !factor.is_finite() {
        return Err(Fault::new(
            lines.line,
            "the multiplier times the ballast factors is not above 0: nothing would shine",
        ));
    }
    let angles = lines.numbers(vertical, "a vertical angle")?;
    let planes = lines.numbers(horizontal, "a horizontal angle")?;
    let angle_line = lines.line;
    let mut candela = lines.numbers(vertical * horizontal, "an intensity")?;
    if candela.iter().any(|&c| c < 0.0) {
        return Err(Fault::new(lines.line, "an intensity is negative"));
    }
    candela.iter_mut().for_each(|c| *c *= factor);
    if !candela.iter().all(|c| c.is_finite()) {
        return Err(Fault::new(lines.line, "an intensity times the multiplier is too large"));
    }
    let (system, planes, candela) = symmetry(kind, kind_line, (planes, angle_line), candela)?;
    Ok(Distribution::new(system, planes, angles, candela, angle_line)?.with_tilt(tilt))
}

fn header<const N: usize>(lines: &mut Lines<'_>, what: [&str; N]) -> Result<[f32; N], Fault> {
    let mut numbers = [0.0; N];
    for (number, what) in numbers.iter_mut().zip(what) {
        *number = lines.number(what)?;
    }
    Ok(numbers)
}

/// Reads up to the line of the tilt, and what follows of it.
fn tilt(lines: &mut Lines<'_>) -> Result<Vec<[f32; 2]>, Fault> {
    let value = loop {
        let Some(line) = lines.next_line() else {
            return Err(Fault::new(lines.line.max(1), "there is no line TILT=: is it an IES file?"));
        };
        if let Some(value) = line.strip_prefix("TILT=") {
            break value.trim();
        }
    };
    match value {
        "NONE" => Ok(Vec::new()),
        "INCLUDE" => {
            lines.number("the lamp's geometry")?;
            let count = lines.number("the number of tilts")?;
            if !(1.0..=MAX_TILTS).contains(&count) {
                return Err(Fault::new(
                    lines.line,
                    format!("the number of tilts is {count}: 1 to {MAX_TILTS} are expected"),
                ));
            }
            let angles = lines.numbers(count as usize, "an angle of the tilt")?;
            let factors = lines.numbers(count as usize, "a factor of the tilt")?;
            Ok(angles.into_iter().zip(factors).map(|(angle, factor)| [angle, factor.max(0.0)]).collect())
        }
        file => {
            let message = format!(
                "TILT={file}: factors in another file are not read: write them here, TILT=INCLUDE, or TILT=NONE"
            );
            Err(Fault::new(lines.line, message))
        }
    }
}

type Planes = (System, Vec<f32>, Vec<f32>);

/// What the horizontal angles say of symmetry. A last plane that is the first again goes.
fn symmetry(
    kind: f32,
    line: u32,
    (mut planes, angle_line): (Vec<f32>, u32),
    mut candela: Vec<f32>,
) -> Result<Planes, Fault> {
    let (first, last) = (planes.first().copied().unwrap_or(0.0), planes.last().copied().unwrap_or(0.0));
    let system = match kind {
        2.0 => System::B,
        3.0 => System::A,
        1.0 => System::C(match (first, last) {
            _ if planes.len() == 1 => Symmetry::Rotation,
            (0.0, 90.0) => Symmetry::Quarter,
            (0.0, 180.0) => Symmetry::About0,
            (90.0, 270.0) => Symmetry::About90,
            (0.0, 360.0) => {
                planes.pop();
                candela.truncate(candela.len() / (planes.len() + 1) * planes.len());
                Symmetry::None
            }
            (0.0, last) if (180.0..360.0).contains(&last) => Symmetry::None,
            _ => {
                let message = format!(
                    "horizontal angles go from {first} to {last}: 0, 0 to 90, 0 to 180, 90 to 270 and 0 to 360 are known"
                );
                return Err(Fault::new(angle_line, message));
            }
        }),
        _ => return Err(Fault::new(line, format!("photometric type {kind}: 1 (C), 2 (B) and 3 (A) are known"))),
    };
    Ok((system, planes, candela))
}
