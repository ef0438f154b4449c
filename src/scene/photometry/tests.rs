use super::*;
use glam::Vec3;
use std::f32::consts::PI;

/// An IES file of these planes and angles.
fn ies(tilt: &str, kind: u32, planes: &[f32], angles: &[f32], candela: impl Fn(f32, f32) -> f32) -> String {
    let list = |numbers: &[f32]| numbers.iter().map(|n| format!("{n}")).collect::<Vec<_>>().join(" ");
    let (v, h) = (angles.len(), planes.len());
    let mut text = format!("IESNA:LM-63-2002\r\n[TEST] a lamp\r\n[MANUFAC] nobody\r\nTILT={tilt}\r\n");
    text += &format!("1 1000 2.0 {v} {h} {kind} 2 -0.1 -0.1 0\r\n0.5 1 60\r\n{}\r\n{}\r\n", list(angles), list(planes));
    for &plane in planes {
        let row: Vec<f32> = angles.iter().map(|&angle| candela(plane, angle)).collect();
        // Lines break anywhere.
        text += &row.chunks(4).map(|part| list(part) + "\r\n").collect::<String>();
    }
    text
}

fn steps(from: f32, to: f32, step: f32) -> Vec<f32> {
    (0..=((to - from) / step).round() as u32).map(|i| from + step * i as f32).collect()
}

fn direction(plane: f32, angle: f32) -> Vec3 {
    let (c, g) = (plane.to_radians(), angle.to_radians());
    Vec3::new(g.sin() * c.cos(), g.sin() * c.sin(), g.cos())
}

#[test]
fn flux_is_the_integral() {
    let even = parse(ies("NONE", 1, &[0.0], &steps(0.0, 180.0, 10.0), |_, _| 100.0).as_bytes(), false).expect("read");
    assert!((even.flux() / (4.0 * PI * 100.0) - 1.0).abs() < 1e-4, "{}", even.flux());
    let cosine = |_, angle: f32| 300.0 * angle.to_radians().cos().max(0.0);
    let lambert = parse(ies("NONE", 1, &[0.0], &steps(0.0, 90.0, 2.5), cosine).as_bytes(), false).expect("read");
    assert!((lambert.flux() / (300.0 * PI) - 1.0).abs() < 1e-3, "{}", lambert.flux());
    assert_eq!((lambert.peak(), lambert.candela(Vec3::NEG_Z), lambert.at_tilt(50.0)), (300.0, 0.0, 1.0));
}

/// A lamp that differs in each octant, measured whole or by its symmetric part.
#[test]
fn what_is_not_measured_follows_by_symmetry() {
    let angles = steps(0.0, 180.0, 15.0);
    let halves = |plane: f32| 2.0 + plane.to_radians().cos();
    let others = |plane: f32| 2.0 + plane.to_radians().sin();
    let quarters = |plane: f32| 2.0 + (2.0 * plane.to_radians()).cos();
    for (planes, of_plane) in [
        (steps(0.0, 180.0, 15.0), &halves as &dyn Fn(f32) -> f32),
        (steps(90.0, 270.0, 15.0), &others),
        (steps(0.0, 90.0, 15.0), &quarters),
        (steps(0.0, 360.0, 15.0), &others),
        (steps(0.0, 345.0, 15.0), &others),
    ] {
        let of = |plane: f32, angle: f32| of_plane(plane) * (1.0 + angle / 90.0);
        let lamp = parse(ies("NONE", 1, &planes, &angles, of).as_bytes(), false).expect("read");
        for plane in steps(0.0, 345.0, 15.0) {
            for angle in [15.0, 60.0, 105.0] {
                let (found, expected) = (lamp.candela(direction(plane, angle)), of(plane, angle));
                assert!((found / expected - 1.0).abs() < 1e-3, "{planes:?} {plane} {angle}: {found} {expected}");
            }
        }
    }
}

/// Planes that turn about the lamp's length, or its upright.
#[test]
fn floodlights_have_planes_that_turn_sideways() {
    for (kind, plane_of, within) in [(2, Vec3::Y, Vec3::X), (3, Vec3::X, Vec3::Y)] {
        let (planes, angles) = (steps(-90.0, 90.0, 10.0), steps(-90.0, 90.0, 10.0));
        let text = ies("NONE", kind, &planes, &angles, |plane, angle| 100.0 + plane + 0.1 * angle);
        let lamp = parse(text.as_bytes(), false).expect("read");
        let at = |v: Vec3| lamp.candela(v.normalize());
        assert!((at(Vec3::Z) - 100.0).abs() < 1e-3);
        assert!((at(Vec3::Z + plane_of) - 145.0).abs() < 1e-2, "{kind}: {}", at(Vec3::Z + plane_of));
        assert!((at(Vec3::Z + within) - 104.5).abs() < 1e-2, "{kind}: {}", at(Vec3::Z + within));
        assert_eq!(at(Vec3::NEG_Z), 0.0, "behind it was not measured");
    }
}

#[test]
fn tilts_are_factors() {
    let text = ies("INCLUDE\r\n1\r\n3\r\n0 45 90\r\n1 0.9 0.5", 1, &[0.0], &[0.0, 90.0], |_, _| 10.0);
    let lamp = parse(text.as_bytes(), false).expect("read");
    assert_eq!([lamp.at_tilt(0.0), lamp.at_tilt(45.0), lamp.at_tilt(120.0)], [1.0, 0.9, 0.5]);
    assert!((lamp.at_tilt(67.5) - 0.7).abs() < 1e-6);
}

/// An EULUMDAT file of `planes` planes all round, of which those are written that the symmetry asks for.
fn ldt(symmetry: u32, planes: usize, angles: &[f32], value: impl Fn(f32, f32) -> f32) -> String {
    let angle_of = |plane: usize| plane as f32 * 360.0 / planes as f32;
    let written: Vec<usize> = match symmetry {
        0 => (0..planes).collect(),
        1 => vec![0],
        2 => (0..=planes / 2).collect(),
        3 => (0..=planes / 2).map(|i| (3 * planes / 4 + i) % planes).collect(),
        _ => (0..=planes / 4).collect(),
    };
    let mut lines = vec!["nobody".to_owned(), "1".into(), symmetry.to_string(), planes.to_string()];
    lines.extend([format!("{}", 360.0 / planes as f32), angles.len().to_string(), "0".into()]);
    lines.extend((8..=12).map(|_| "a name".to_owned()));
    lines.extend((13..=21).map(|_| "100".to_owned()));
    lines.extend(["100", "80", "1,0", "0", "1", "1", "LED", "2000", "4000 K", "80", "20"].map(str::to_owned));
    lines.extend((0..10).map(|_| "0.5".to_owned()));
    lines.extend((0..planes).map(|plane| angle_of(plane).to_string()));
    lines.extend(angles.iter().map(|a| a.to_string()));
    for plane in written {
        lines.extend(angles.iter().map(|&angle| format!("{}", value(angle_of(plane), angle)).replace('.', ",")));
    }
    lines.join("\r\n")
}

#[test]
fn eulumdat_symmetries() {
    let angles = steps(0.0, 180.0, 15.0);
    let even = |_: f32| 1.0;
    let halves = |plane: f32| 2.0 + plane.to_radians().cos();
    let others = |plane: f32| 2.0 + plane.to_radians().sin();
    let quarters = |plane: f32| 2.0 + (2.0 * plane.to_radians()).cos();
    let cases: [(u32, &dyn Fn(f32) -> f32); 5] = [(0, &others), (1, &even), (2, &halves), (3, &others), (4, &quarters)];
    for (symmetry, of_plane) in cases {
        let of = |plane: f32, angle: f32| 100.0 * of_plane(plane) * (1.0 + angle / 90.0);
        let lamp = parse(ldt(symmetry, 24, &angles, of).as_bytes(), true).expect("read");
        for plane in steps(0.0, 345.0, 15.0) {
            let (found, expected) = (lamp.candela(direction(plane, 60.0)), 2.0 * of(plane, 60.0));
            assert!((found / expected - 1.0).abs() < 1e-3, "{symmetry} {plane}: {found} {expected}");
        }
    }
}

/// Each with the line that is at fault.
#[test]
fn broken_files_say_where() {
    let good = ies("NONE", 1, &[0.0], &[0.0, 45.0, 90.0], |_, _| 1.0);
    let changed = |from: &str, to: &str| good.replacen(from, to, 1);
    let cases = [
        (String::new(), 1, false),
        ("IESNA:LM-63-2002\nTILT=NONE\n".into(), 2, false),
        ("IESNA\nhello\n".into(), 2, false),
        (changed("TILT=NONE", "TILT=other.txt"), 4, false),
        (changed("1 1000 2.0 3 1 1", "1 1000 2.0 3 1 7"), 5, false),
        (changed("1 1000 2.0 3 1 1", "1 1000 2.0 3.5 1 1"), 5, false),
        (changed("1 1000 2.0 3 1 1", "1 1000 2.0 4000000000 1 1"), 5, false),
        (changed("1 1000 2.0 3 1 1", "1 1000 0 3 1 1"), 6, false),
        (changed("1 1000 2.0 3 1 1", "1 1000 nan 3 1 1"), 5, false),
        (changed("0 45 90", "0 90 45"), 8, false),
        (changed("0 45 90", "0 x 45"), 7, false),
        (changed("1 1 1\r\n", "1 1"), 9, false),
        (changed("1 1 1\r\n", "1 -1 1\r\n"), 9, false),
        ("company\n1\n9\n4\n90\n".into(), 5, true),
        (ldt(1, 24, &[0.0, 90.0], |_, _| 1.0).replacen("\r\n1\r\n24", "\r\n9\r\n24", 1), 3, true),
        (ldt(4, 22, &[0.0, 90.0], |_, _| 1.0), 3, true),
        (ldt(0, 4, &[0.0, 90.0], |_, _| 1.0).replacen("2000", "-2000", 1), 29, true),
        ("\u{0}\u{1}".repeat(100), 1, true),
    ];
    for (index, (text, line, is_ldt)) in cases.into_iter().enumerate() {
        let fault = parse(text.as_bytes(), is_ldt).expect_err("broken");
        assert_eq!(fault.line, line, "{index}: {}", fault.message);
        assert!(fault.message.len() > 10);
    }
}

/// No change of bytes makes it panic, hang, or return what is not finite.
#[test]
fn no_file_breaks_the_reader() {
    let files = [
        (ies("NONE", 1, &steps(0.0, 90.0, 45.0), &steps(0.0, 90.0, 30.0), |p, a| p + a), false),
        (ldt(2, 8, &steps(0.0, 90.0, 30.0), |p, a| p + a), true),
    ];
    let mut state = 7_u64;
    let mut random = || {
        state = crate::math::mix(state.wrapping_add(0x9e37_79b9));
        state as usize
    };
    for round in 0..20_000 {
        let (text, is_ldt) = &files[round % 2];
        let mut bytes = text.clone().into_bytes();
        for _ in 0..=random() % 4 {
            let at = random() % bytes.len().max(1);
            match random() % 4 {
                0 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = random() as u8),
                1 => drop(bytes.drain(at..(at + random() % 9).min(bytes.len()))),
                2 => bytes.splice(at..at, *b"99999999").for_each(drop),
                _ => bytes.truncate(at.max(1)),
            }
        }
        if let Ok(lamp) = parse(&bytes, *is_ldt) {
            let seen = lamp.candela(Vec3::new(0.3, 0.5, 0.8).normalize());
            assert!(seen.is_finite() && seen >= 0.0, "{seen}");
        }
    }
}
