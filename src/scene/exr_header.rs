//! What the header of an EXR file claims, before anything of that size is allocated: a few bytes can claim any number of pixels.

use exr::prelude::MetaData;
use std::io::{Read, Seek, SeekFrom};

/// Bytes of pixels that a byte of a file can hold: deflate makes at most 1032 of one.
pub const MOST_OF_A_BYTE: u64 = 1100;
/// Length that a shorter file counts as: headers of small tiles.
const LEAST: u64 = 1 << 16;

/// Looks at a whole file, and goes back to its beginning.
///
/// # Errors
/// If it cannot be read, or claims more pixels, in all or in a tile, than it has bytes for.
pub fn check(file: &mut (impl Read + Seek)) -> Result<(), String> {
    let length = file.seek(SeekFrom::End(0)).map_err(|fault| fault.to_string())?;
    file.rewind().map_err(|fault| fault.to_string())?;
    let claimed = claimed(&mut *file).map_err(|fault| fault.to_string())?;
    file.rewind().map_err(|fault| fault.to_string())?;
    match claimed {
        Some(bytes) if bytes <= MOST_OF_A_BYTE * length.max(LEAST) => Ok(()),
        _ => Err(format!("its {length} bytes cannot hold the pixels that it claims to have: it is cut off or damaged")),
    }
}

/// Bytes of pixels that a header claims; `None` if they are not to be counted.
fn claimed(file: impl Read) -> exr::error::Result<Option<u64>> {
    let meta = MetaData::read_from_buffered(std::io::BufReader::new(file), false)?;
    let mut sum = Some(0_u64);
    for header in &meta.headers {
        let pixel = header.channels.bytes_per_pixel as u64;
        let bytes = |width: usize, height: usize| (width as u64).checked_mul(height as u64)?.checked_mul(pixel);
        let tile = match header.blocks {
            exr::meta::BlockDescription::Tiles(tiles) => bytes(tiles.tile_size.width(), tiles.tile_size.height()),
            exr::meta::BlockDescription::ScanLines => Some(0),
        };
        let all = bytes(header.layer_size.width(), header.layer_size.height());
        sum = sum.zip(tile).zip(all).and_then(|((sum, tile), all)| sum.checked_add(tile.max(all)));
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::*;
    use std::io::Cursor;

    /// An image of 64 × 64 pixels, and where its data window ends in the file.
    fn file() -> Vec<u8> {
        let image =
            Image::from_channels((64, 64), SpecificChannels::rgb(|_: Vec2<usize>| (0.5_f32, 0.25_f32, 1.0_f32)));
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).expect("in memory");
        bytes.into_inner()
    }

    #[test]
    fn a_file_holds_no_more_than_it_has_bytes_for() {
        let sound = file();
        assert_eq!(check(&mut Cursor::new(&sound)), Ok(()));
        let name = b"dataWindow\0box2i\0";
        let at = sound.windows(name.len()).position(|window| window == name).expect("a data window") + name.len() + 4;
        let mut claims = sound;
        claims[at + 8..at + 12].copy_from_slice(&60_000_i32.to_le_bytes());
        claims[at + 12..at + 16].copy_from_slice(&60_000_i32.to_le_bytes());
        let fault = check(&mut Cursor::new(&claims)).expect_err("3.6 G pixels in a few bytes");
        assert!(fault.contains("cannot hold"), "{fault}");
    }
}
