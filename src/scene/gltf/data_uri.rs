//! Data in the place of a file's name.

use base64::Engine;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Where the bytes of a URI are.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// Here.
    Bytes(Vec<u8>),
    /// In a file beside the one that names it.
    File,
}

/// What a URI means, or why it cannot be used.
pub(super) fn content(uri: &str) -> Result<Content, String> {
    let has_scheme = |scheme: &str| uri.get(..scheme.len()).is_some_and(|start| start.eq_ignore_ascii_case(scheme));
    if has_scheme("data:") {
        return decode(&uri["data:".len()..]).map(Content::Bytes);
    }
    match ["http:", "https:", "ftp:", "blob:"].into_iter().find(|scheme| has_scheme(scheme)) {
        Some(scheme) => {
            Err(format!("is on the network ({scheme}), which is never asked: put the file beside this one"))
        }
        None if uri.is_empty() => Err("has an empty name".into()),
        None => Ok(Content::File),
    }
}

fn decode(data: &str) -> Result<Vec<u8>, String> {
    let (kind, data) = data.split_once(',').ok_or("is a data URI without a comma")?;
    if !kind.trim_end().to_ascii_lowercase().ends_with(";base64") {
        return Ok(percent_decode_str(data).collect());
    }
    let text = if data.contains(['\n', '\r', ' ', '%']) {
        let decoded: Vec<u8> = percent_decode_str(data).filter(|b| !b.is_ascii_whitespace()).collect();
        return BASE64.decode(decoded).map_err(|error| format!("is no valid base64: {error}"));
    } else {
        data
    };
    BASE64.decode(text).map_err(|error| format!("is no valid base64: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_is_decoded_and_the_network_is_not_asked() {
        let bytes = |text: &str| Ok(Content::Bytes(text.as_bytes().to_vec()));
        assert_eq!(content("data:application/octet-stream;base64,aGFsbG8="), bytes("hallo"));
        assert_eq!(content("DATA:;base64,aGFs\nbG8"), bytes("hallo"));
        assert_eq!(content("data:text/plain,a%20b"), bytes("a b"));
        assert_eq!(content("my%20file.bin"), Ok(Content::File));
        for (uri, what) in [
            ("data:;base64", "without a comma"),
            ("data:;base64,a*b=", "no valid base64"),
            ("https://a.b/c.bin", "on the network"),
            ("", "empty name"),
        ] {
            assert!(content(uri).expect_err(uri).contains(what), "{uri}");
        }
    }
}
