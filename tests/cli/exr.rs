//! EXR files as other programs see them: read back with the `exr` crate, channel by channel.

use exr::prelude::*;
use glam::{Vec3, Vec4};
use penombre::image::exr::{
    Altered, Provenance, ReferenceLayers, RenderLayers, read_rgb, write_reference, write_render,
};
use penombre::scene::camera::{Camera, ImageSize};
use std::path::{Path, PathBuf};

/// Owned pixels of a render whose every channel differs.
struct Pixels {
    size: ImageSize,
    combined: Vec<Vec4>,
    colours: [Vec<Vec3>; 5],
    ids: [Vec<u32>; 2],
}

impl Pixels {
    fn new(width: u32, height: u32) -> Self {
        let size = ImageSize { width, height };
        // A cheap hash: noise that neither compresses away nor hides an exchange of channels.
        let noise = |i: usize, k: usize| ((i * 97 + k * 1013).wrapping_mul(2_654_435_761) % 4096) as f32 / 512.0;
        let colour =
            |k: usize| (0..size.pixels()).map(move |i| Vec3::new(noise(i, k), noise(i, k + 1), noise(i, k + 2)));
        Self {
            size,
            combined: colour(0).map(|c| c.extend(1.0)).collect(),
            colours: [3, 6, 9, 12, 15].map(|k| colour(k).collect()),
            // Beyond what half and float hold exactly.
            ids: [0, 1].map(|k| (0..size.pixels() as u32).map(|i| i * 3 + k + 33_554_433).collect()),
        }
    }

    fn layers(&self) -> RenderLayers<'_> {
        let [kd, ks, diffuse, specular, emitted] = &self.colours;
        let [face_id, level] = &self.ids;
        RenderLayers { size: self.size, combined: &self.combined, kd, ks, diffuse, specular, emitted, face_id, level }
    }
}

fn provenance() -> Provenance {
    let camera = Camera {
        position: Vec3::new(1.0, 2.0, 3.0),
        look_at: Vec3::new(1.0, 2.0, 0.0),
        up: Vec3::Y,
        vertical_fov: 90.0,
    };
    Provenance { comments: "penombre render a.toml --seed 1".into(), camera: Some(camera), origin: glam::DVec3::ZERO }
}

fn at(folder: &tempfile::TempDir, name: &str) -> PathBuf {
    folder.path().join(name)
}

fn read_all(path: &Path) -> FlatImage {
    read_all_flat_layers_from_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn a_render_reads_back_with_names_types_and_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = at(&folder, "a.exr");
    let pixels = Pixels::new(37, 21);
    assert_eq!(write_render(&path, &pixels.layers(), &provenance()).unwrap(), Altered::default());

    let image = read_all(&path);
    assert_eq!(image.layer_data.len(), 1, "one part");
    let layer = &image.layer_data[0];
    assert_eq!(layer.size, Vec2(37, 21));
    let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    #[rustfmt::skip]
    assert_eq!(names, [
        "A", "B", "D.B", "D.G", "D.R", "G", "Le.B", "Le.G", "Le.R", "R", "S.B", "S.G", "S.R",
        "face.id", "kd.B", "kd.G", "kd.R", "ks.B", "ks.G", "ks.R", "level",
    ]);
    let samples = |name: &str| &layer.channel_data.list.iter().find(|c| c.name == *name).unwrap().sample_data;
    for name in names.iter().filter(|n| !["face.id", "level"].contains(&n.as_str())) {
        assert!(matches!(samples(name), FlatSamples::F16(_)), "{name}");
    }
    assert_eq!(samples("face.id"), &FlatSamples::U32(pixels.ids[0].clone()));
    assert_eq!(samples("level"), &FlatSamples::U32(pixels.ids[1].clone()));
    let same = |name: &str, values: &mut dyn Iterator<Item = f32>| {
        for (i, (read, value)) in samples(name).values_as_f32().zip(values).enumerate() {
            assert!((read - value).abs() <= value.abs() / 2048.0, "{name} {i}: {read} {value}");
        }
    };
    for (k, layer) in ["kd", "ks", "D", "S", "Le"].into_iter().enumerate() {
        for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
            same(&format!("{layer}.{channel}"), &mut pixels.colours[k].iter().map(|p| p[c]));
        }
    }
    for (c, channel) in ["R", "G", "B", "A"].into_iter().enumerate() {
        same(channel, &mut pixels.combined.iter().map(|p| p[c]));
    }
}

#[test]
fn attributes_say_how_the_image_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = at(&folder, "a.exr");
    write_render(&path, &Pixels::new(4, 2).layers(), &provenance()).unwrap();
    let attributes = read_all(&path).layer_data[0].attributes.clone();
    assert!(attributes.software_name.unwrap().to_string().starts_with("penombre "));
    assert_eq!(attributes.comments.unwrap().to_string(), "penombre render a.toml --seed 1");
    assert_eq!(attributes.capture_date, None);
    assert_eq!(attributes.vertical_field_of_view, Some(90.0));
    assert!((attributes.horizontal_field_of_view.unwrap() - 126.869_9).abs() < 1e-3, "2 atan 2");
    let m = attributes.world_to_camera.unwrap();
    let apply = |p: [f32; 3]| [0, 1, 2].map(|j| m[12 + j] + (0..3).map(|i| p[i] * m[i * 4 + j]).sum::<f32>());
    assert_eq!(apply([1.0, 2.0, 3.0]), [0.0; 3], "the eye");
    assert_eq!(apply([2.0, 4.0, -2.0]), [1.0, 2.0, 5.0], "right, up, forward");
}

#[test]
fn bytes_do_not_depend_on_run_or_name() {
    let folder = tempfile::tempdir().unwrap();
    let pixels = Pixels::new(300, 200);
    let bytes: Vec<Vec<u8>> = (0..4)
        .map(|i| {
            let path = at(&folder, &format!("{i}.exr"));
            write_render(&path, &pixels.layers(), &provenance()).unwrap();
            std::fs::read(path).unwrap()
        })
        .collect();
    assert!(bytes.iter().all(|b| *b == bytes[0]));

    // The writer compresses with a pool of its own; the same image compressed on one thread is the check on it.
    let serial = at(&folder, "serial.exr");
    let again = read_all(&at(&folder, "0.exr"));
    again.write().non_parallel().to_file(&serial).unwrap();
    assert_eq!(std::fs::read(serial).unwrap(), bytes[0]);
}

#[test]
fn what_half_cannot_hold_is_altered_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = at(&folder, "a.exr");
    let mut pixels = Pixels::new(2, 2);
    pixels.combined[0] = Vec4::new(1e6, -70_000.0, 65_504.0, 1.0);
    pixels.colours[2][1] = Vec3::new(f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
    let altered = write_render(&path, &pixels.layers(), &Provenance::default()).unwrap();
    assert_eq!(altered, Altered { clamped: 2, infinite: 2, nan: 1 });
    let warning = altered.warning().unwrap();
    assert!(warning.contains("2 beyond half range") && warning.contains("1 not a number"), "{warning}");
    assert_eq!(Altered::default().warning(), None);

    assert_eq!(read_rgb(&path).unwrap().rgb[0], Vec3::new(65_504.0, -65_504.0, 65_504.0));
    let image = read_all(&path);
    let value = |name: &str| {
        let list = &image.layer_data[0].channel_data.list;
        list.iter().find(|c| c.name == *name).unwrap().sample_data.value_by_flat_index(1).to_f32()
    };
    assert_eq!(["D.R", "D.G", "D.B"].map(value), [0.0, 65_504.0, -65_504.0]);
}

#[test]
fn a_reference_keeps_32_bits_variance_and_mask() {
    let folder = tempfile::tempdir().unwrap();
    let path = at(&folder, "ref.exr");
    let mean = [Vec4::new(0.1, 1e7, 1e-20, 1.0), Vec4::new(f32::NAN, 0.0, 0.0, 0.0)];
    let variance = [Vec3::new(1e-12, 2.0, 3.0), Vec3::ZERO];
    let size = ImageSize { width: 1, height: 2 };
    let mut layers =
        ReferenceLayers { size, mean: &mean, variance: &variance, mask: Some(&[true, false]), sampled: None };
    let altered = write_reference(&path, &layers, &provenance()).unwrap();
    assert_eq!(altered, Altered { nan: 1, ..Default::default() });
    let read = read_rgb(&path).unwrap();
    assert_eq!(read.size, size);
    assert_eq!(read.rgb[0], mean[0].truncate(), "not a bit lost");
    assert!(read.rgb[1].x.is_nan(), "a fault stays visible");
    assert_eq!((read.counted(), &read.sampled), (read.mask.clone(), &None));
    assert_eq!(read.variance.unwrap(), variance);
    assert_eq!(read.mask.unwrap(), [true, false]);

    layers.mask = Some(&[true, true]);
    layers.sampled = Some(&[false, true]);
    write_reference(&path, &layers, &provenance()).unwrap();
    let read = read_rgb(&path).unwrap();
    assert_eq!((read.counted(), read.sampled), (Some(vec![false, true]), Some(vec![false, true])));

    (layers.mask, layers.sampled) = (None, None);
    write_reference(&path, &layers, &provenance()).unwrap();
    let read = read_rgb(&path).unwrap();
    assert_eq!((read.counted(), read.mask), (None, None));
}

#[test]
fn any_flat_exr_with_rgb_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = at(&folder, "other.exr");
    // Tiles, RLE, mixed types: as another program might write.
    let pixel = |Vec2(x, y): Vec2<usize>| (f16::from_f32(x as f32), y as f32, f16::from_f32(0.5), 1.0_f32);
    let channels = SpecificChannels::build()
        .with_channel("G")
        .with_channel("R")
        .with_channel("B")
        .with_channel("Z")
        .with_pixel_fn(pixel);
    Image::from_encoded_channels((70, 66), Encoding::FAST_LOSSLESS, channels).write().to_file(&path).unwrap();
    let read = read_rgb(&path).unwrap();
    assert_eq!(read.size, ImageSize { width: 70, height: 66 });
    assert_eq!(read.rgb[65 * 70 + 3], Vec3::new(65.0, 3.0, 0.5));
    assert_eq!((read.variance, read.mask), (None, None));
}

#[test]
fn files_that_cannot_be_used_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, why: &str| {
        let error = read_rgb(&at(&folder, name)).unwrap_err();
        assert_eq!(error.exit_status(), 2);
        let text = error.to_string();
        assert!(text.contains(name) && text.contains(why) && text.lines().count() == 1, "{text}");
    };
    refused("absent.exr", "cannot read");

    std::fs::write(at(&folder, "text.exr"), "not an image").unwrap();
    refused("text.exr", "cannot be read as an EXR image");
    std::fs::write(at(&folder, "empty.exr"), "").unwrap();
    refused("empty.exr", "cannot be read as an EXR image");

    let grey = AnyChannels::sort([AnyChannel::new("Y", FlatSamples::F32(vec![0.0; 4]))].into_iter().collect());
    Image::from_channels((2, 2), grey).write().to_file(at(&folder, "grey.exr")).unwrap();
    refused("grey.exr", "needs the channels R, G and B, has Y");

    write_render(&at(&folder, "whole.exr"), &Pixels::new(64, 64).layers(), &provenance()).unwrap();
    let whole = std::fs::read(at(&folder, "whole.exr")).unwrap();
    for cut in [8, 100, 700, whole.len() / 2, whole.len() - 1] {
        std::fs::write(at(&folder, "cut.exr"), &whole[..cut]).unwrap();
        refused("cut.exr", "cannot be read as an EXR image");
    }
}

#[test]
fn a_header_that_claims_a_huge_image_is_refused_before_allocation() {
    let folder = tempfile::tempdir().unwrap();
    let path = at(&folder, "huge.exr");
    write_render(&path, &Pixels::new(4, 4).layers(), &provenance()).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let key = b"dataWindow\0box2i\0";
    let start = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len() + 4;
    let mut claim = |right: i32, bottom: i32, why: &str| {
        bytes[start + 8..start + 12].copy_from_slice(&right.to_le_bytes());
        bytes[start + 12..start + 16].copy_from_slice(&bottom.to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        let text = read_rgb(&path).unwrap_err().to_string();
        assert!(text.contains("huge.exr") && text.contains(why), "{text}");
    };
    claim(99_999, 3, "100000x4");
    claim(16_383, 16_383, "cut off or damaged");
    claim(i32::MAX, i32::MAX, "huge.exr");
    claim(-5, -5, "huge.exr");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_and_a_missing_folder_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let pixels = Pixels::new(64, 64);
    let full = at(&folder, "full.exr");
    std::os::unix::fs::symlink("/dev/full", &full).unwrap();
    let text = write_render(&full, &pixels.layers(), &provenance()).unwrap_err().to_string();
    assert!(text.contains("full.exr: cannot write"), "{text}");
    let text = write_render(&at(&folder, "no/a.exr"), &pixels.layers(), &provenance()).unwrap_err().to_string();
    assert!(text.contains("a.exr: cannot write"), "{text}");
}

#[test]
fn damaged_files_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = at(&folder, "a.exr");
    write_render(&path, &Pixels::new(16, 20).layers(), &provenance()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    // SplitMix64, a fixed seed.
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB) >> 33) as usize
    };
    let mut refused = 0;
    for _ in 0..600 {
        let mut bytes = whole.clone();
        for _ in 0..1 + random() % 4 {
            // Headers are where most harm can be done.
            let range = if random() % 4 == 0 { bytes.len() } else { 1400 };
            let i = random() % range.min(bytes.len());
            bytes[i] = random() as u8;
        }
        std::fs::write(&path, &bytes).unwrap();
        refused += usize::from(read_rgb(&path).is_err());
    }
    assert!(refused > 300, "{refused}");
}
