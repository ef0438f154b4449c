//! A block as it lies in the file: version and checksum, then the caller's bytes.

use twox_hash::XxHash3_64;

/// Which block: what its values depend on, and where in the scene they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockKey {
    /// The layer, by a hash of all that its values depend on.
    pub layer: u64,
    /// The cluster of faces.
    pub cluster: u32,
}

/// The largest block, bytes: more is a fault.
pub const MAX_BLOCK: usize = 64 << 20;

/// What precedes the bytes of a block: version (4), nothing (4), checksum (8).
const HEAD: usize = 16;

/// Version of this layout.
const VERSION: u32 = 1;

/// What is wrong with a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Damage {
    /// Its bytes are not those that were written.
    Checksum,
    /// It is of a version that this program does not read.
    Version,
}

/// A block's checksum, of its key, too: one that came to lie under another's is not believed.
fn checksum(key: BlockKey, bytes: &[u8]) -> u64 {
    let seed = key.layer.rotate_left(17) ^ u64::from(key.cluster) ^ u64::from(VERSION) << 48;
    XxHash3_64::oneshot_with_seed(seed, bytes)
}

/// The block as it is kept.
pub(super) fn sealed(key: BlockKey, bytes: &[u8]) -> Vec<u8> {
    let mut sealed = Vec::with_capacity(HEAD + bytes.len());
    sealed.extend_from_slice(&VERSION.to_le_bytes());
    sealed.extend_from_slice(&[0; 4]);
    sealed.extend_from_slice(&checksum(key, bytes).to_le_bytes());
    sealed.extend_from_slice(bytes);
    sealed
}

/// The caller's bytes of a kept block.
///
/// # Errors
/// What is wrong with it: then nothing of it is to be believed.
pub(super) fn opened(key: BlockKey, sealed: &[u8]) -> Result<&[u8], Damage> {
    let (head, bytes) = sealed.split_first_chunk::<HEAD>().ok_or(Damage::Checksum)?;
    let [a, b, c, d, .., e, f, g, h, i, j, k, l] = *head;
    if u32::from_le_bytes([a, b, c, d]) != VERSION {
        return Err(Damage::Version);
    }
    let is_whole = u64::from_le_bytes([e, f, g, h, i, j, k, l]) == checksum(key, bytes);
    if is_whole { Ok(bytes) } else { Err(Damage::Checksum) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: BlockKey = BlockKey { layer: 0x0123_4567_89ab_cdef, cluster: 7 };

    #[test]
    fn a_block_comes_back_and_any_flipped_bit_is_found() {
        let bytes: Vec<u8> = (0..300u32).map(|i| (i * 7) as u8).collect();
        let mut kept = sealed(KEY, &bytes);
        assert_eq!(opened(KEY, &kept), Ok(&bytes[..]));
        // The four bytes that mean nothing may be anything.
        for bit in (0..kept.len() * 8).filter(|bit| !(32..64).contains(bit)) {
            kept[bit / 8] ^= 1 << (bit % 8);
            assert!(opened(KEY, &kept).is_err(), "bit {bit}");
            kept[bit / 8] ^= 1 << (bit % 8);
        }
        for length in 0..kept.len() {
            assert!(opened(KEY, &kept[..length]).is_err(), "cut to {length}");
        }
    }

    #[test]
    fn a_block_under_another_key_or_of_another_version_is_not_believed() {
        let kept = sealed(KEY, b"light");
        assert_eq!(opened(BlockKey { cluster: 8, ..KEY }, &kept), Err(Damage::Checksum));
        assert_eq!(opened(BlockKey { layer: 1, ..KEY }, &kept), Err(Damage::Checksum));
        let mut newer = kept;
        newer[0] += 1;
        assert_eq!(opened(KEY, &newer), Err(Damage::Version));
    }

    /// What is in users' directories: the checksum must stay what it is on every machine and in every version.
    #[test]
    fn the_layout_is_fixed() {
        let kept = sealed(KEY, b"light");
        assert_eq!(kept.len(), 21);
        assert_eq!(kept[..8], [1, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(u64::from_le_bytes(kept[8..16].try_into().unwrap()), 0x2ca7_9791_13ef_d221);
    }
}
