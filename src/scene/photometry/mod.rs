//! Lamps as they were measured: luminous intensity by direction, from IES LM-63 or EULUMDAT files.

mod distribution;
mod eulumdat;
mod fault;
mod ies;
mod lamp;
mod lines;
#[cfg(test)]
mod tests;

pub use distribution::{Distribution, frame};
pub use fault::Fault;
pub use lamp::{EFFICACY, Hanging, Lamp};

use std::path::Path;

/// Largest file, bytes.
const MAX_FILE: u64 = 4 << 20;

/// Reads the lamp at `path`: IES by its first word or its extension, EULUMDAT otherwise.
///
/// # Errors
/// What is wrong, with the line in front where there is one.
pub fn read(path: &Path) -> Result<Distribution, String> {
    let say = |error: std::io::Error| format!("{}: cannot be read: {error}", path.display());
    let data = std::fs::metadata(path).map_err(say)?;
    if !data.is_file() || data.len() > MAX_FILE {
        return Err(format!(
            "{}: is no file of at most {} MiB: name an IES or LDT file",
            path.display(),
            MAX_FILE >> 20
        ));
    }
    let bytes = std::fs::read(path).map_err(say)?;
    let is_ldt = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ldt"));
    parse(&bytes, is_ldt).map_err(|Fault { line, message }| format!("{}:{line}: {message}", path.display()))
}

/// The distribution that a file holds; `is_ldt` by its name, which its content overrides.
///
/// # Errors
/// The first fault.
pub fn parse(bytes: &[u8], is_ldt: bool) -> Result<Distribution, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let starts = text.trim_start_matches(['\u{feff}', ' ', '\r', '\n']).starts_with("IESNA");
    let has_tilt = || text.lines().any(|line| line.trim_start().starts_with("TILT="));
    if starts || (!is_ldt && has_tilt()) { ies::parse(&text) } else { eulumdat::parse(&text) }
}
