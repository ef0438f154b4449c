//! The text of a glTF file: JSON, bare or as the first chunk of a binary file.

use super::named_extensions::NamedExtensions;
use crate::scene::memory;
use ::gltf::json::Root;
use std::ops::Range;

/// Chunk types of binary files.
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;
/// Memory that an object of the text and a value in it take once parsed, bytes, roughly but not less.
const OBJECT: u64 = 800;
const VALUE: u64 = 48;

/// Where the parts of a file are.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Container {
    /// The text.
    pub json: Range<usize>,
    /// The first buffer.
    pub bin: Option<Range<usize>>,
    /// Whether lines of the text are lines of the file.
    pub is_text: bool,
}

/// A fault of the text: its line, where that is one of the file, and what is wrong.
pub(super) type TextFault = (Option<u32>, String);

impl Container {
    /// Finds the parts of a file, or says what it is instead.
    pub(super) fn of(bytes: &[u8]) -> Result<Self, String> {
        if bytes.trim_ascii().is_empty() {
            return Err("is empty".into());
        }
        if !bytes.starts_with(b"glTF") {
            let start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
            return Ok(Self { json: start..bytes.len(), bin: None, is_text: true });
        }
        let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?));
        let (Some(version), Some(length)) = (word(4), word(8)) else {
            return Err("is a binary glTF file that ends within its header".into());
        };
        if version != 2 {
            return Err(format!("is binary glTF of version {version}: export it as glTF 2.0"));
        }
        let length = length as usize;
        if length > bytes.len() {
            return Err(format!("is cut off: {} of {length} bytes are there", bytes.len()));
        }
        let mut found: [Option<Range<usize>>; 2] = [None, None];
        let mut at = 12;
        while at + 8 <= length {
            let (Some(size), Some(kind)) = (word(at), word(at + 4)) else { break };
            let chunk = at + 8..(at + 8).saturating_add(size as usize);
            if chunk.end > length {
                return Err(format!("has a chunk at byte {at} that goes beyond its end"));
            }
            at = chunk.end;
            match kind {
                JSON => found[0].get_or_insert(chunk),
                BIN => found[1].get_or_insert(chunk),
                _ => continue,
            };
        }
        let [json, bin] = found;
        let json = json.ok_or("is a binary glTF file without a JSON chunk")?;
        Ok(Self { json, bin, is_text: false })
    }

    /// What the text says, and which extensions it names.
    pub(super) fn parse(&self, bytes: &[u8]) -> Result<(Root, NamedExtensions), TextFault> {
        let text = &bytes[self.json.clone()];
        let text = &text[..text.iter().rposition(|&b| b != 0 && b != b' ').map_or(0, |last| last + 1)];
        let count = |byte| memchr::memchr_iter(byte, text).count() as u64;
        let need = 2 * text.len() as u64 + OBJECT * count(b'{') + VALUE * count(b',');
        if let Some(there) = memory::available().filter(|&there| need > there) {
            let [need, there] = [need, there].map(memory::figure);
            return Err((None, format!("its text needs {need} of memory and {there} are free")));
        }
        let fault = |error: serde_json::Error| {
            let (line, column) = (error.line() as u32, error.column());
            match self.is_text {
                // Its message ends with the place.
                true => (Some(line), format!("is no valid glTF: {}, column {column}", plain(&error))),
                false => (None, format!("its JSON is no valid glTF: {error}")),
            }
        };
        let root = Root::from_slice(text).map_err(fault)?;
        version_fault(&root).map_or(Ok(()), |why| Err((None, why)))?;
        let names = serde_json::from_slice(text).map_err(fault)?;
        Ok((root, names))
    }
}

/// The message without the place.
fn plain(error: &serde_json::Error) -> String {
    let message = error.to_string();
    message.split(" at line ").next().unwrap_or(&message).to_owned()
}

fn version_fault(root: &Root) -> Option<String> {
    let version = &root.asset.version;
    let minimum = root.asset.min_version.as_deref().filter(|minimum| *minimum != "2.0");
    match minimum {
        _ if version.split('.').next() != Some("2") => Some(format!("is glTF {version}: export it as glTF 2.0")),
        Some(minimum) => Some(format!("needs a reader of glTF {minimum}: export it as glTF 2.0")),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(version: u32, length: u32, chunks: &[(u32, u32, &[u8])]) -> Vec<u8> {
        let mut out = b"glTF".to_vec();
        out.extend(version.to_le_bytes());
        out.extend(length.to_le_bytes());
        for (size, kind, content) in chunks {
            out.extend(size.to_le_bytes());
            out.extend(kind.to_le_bytes());
            out.extend_from_slice(content);
        }
        out
    }

    #[test]
    fn chunks_are_found_and_others_skipped() {
        let bytes = glb(2, 48, &[(4, JSON, b"{}  "), (4, 7, b"what"), (4, BIN, b"1234")]);
        let found = Container::of(&bytes).expect("sound");
        assert_eq!(found, Container { json: 20..24, bin: Some(44..48), is_text: false });
        assert_eq!(Container::of(b"\xef\xbb\xbf{}").expect("text").json, 3..5);
    }

    #[test]
    fn broken_containers_say_what_is_wrong() {
        let says = |bytes: &[u8], what: &str| {
            let why = Container::of(bytes).expect_err("broken");
            assert!(why.contains(what), "{why}");
        };
        says(b" \n", "is empty");
        says(b"glTF\x02\0\0", "ends within its header");
        says(&glb(1, 12, &[]), "version 1");
        says(&glb(2, 99, &[]), "12 of 99 bytes");
        says(&glb(2, 24, &[(5, JSON, b"{}  ")]), "at byte 12 that goes beyond");
        says(&glb(2, 24, &[(4, BIN, b"{}  ")]), "without a JSON chunk");
        // A length that is less than the header's.
        says(&glb(2, 3, &[(4, JSON, b"{}  ")]), "without a JSON chunk");
    }
}
