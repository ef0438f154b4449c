//! Numbers with commas, as spreadsheets and programs of many languages write them.

use super::text::{self, Warnings};
use std::borrow::Cow;

/// What the commas of a statement stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Commas {
    /// Separators: `0, 1, 2` or `0,1,2`.
    Between,
    /// Decimal points: `0,5 1,25`.
    Decimal,
}

/// The numbers of a statement without commas; says once a file what they were taken for. Where that is not certain, the statement
/// stays as it is.
pub(super) fn without<'r>(rest: &'r [u8], line: u32, warnings: &mut Warnings) -> Cow<'r, [u8]> {
    let Some((commas, plain)) = made_out(rest) else { return Cow::Borrowed(rest) };
    match commas {
        Commas::Between => {
            warnings.once("commas between numbers", line, || "commas between numbers are read as blanks".into());
        }
        Commas::Decimal => warnings.once("decimal commas", line, || {
            "decimal commas (as in 0,5) are read as decimal points: better export with points".into()
        }),
    }
    Cow::Owned(plain)
}

/// `None` without commas, and where they could mean either.
fn made_out(rest: &[u8]) -> Option<(Commas, Vec<u8>)> {
    memchr::memchr(b',', rest)?;
    let words: Vec<&[u8]> = text::words(rest).collect();
    let mut plain = Vec::with_capacity(rest.len());
    let mut commas = Commas::Between;
    for word in &words {
        let word = word.strip_suffix(b",").unwrap_or(word);
        let inner = memchr::memchr_iter(b',', word).count();
        let replaced = match inner {
            0 => b',',
            // One word alone is a list.
            2.. if words.len() == 1 => b' ',
            1 => {
                commas = Commas::Decimal;
                b'.'
            }
            _ => return None,
        };
        let start = plain.len();
        plain.extend(word.iter().map(|&b| if b == b',' { replaced } else { b }));
        if !text::words(&plain[start..]).all(|number| text::number(number).is_some()) {
            return None;
        }
        plain.push(b' ');
    }
    Some((commas, plain))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_are_made_out_where_they_can_only_mean_one_thing() {
        let numbers = |text: &str| {
            made_out(text.as_bytes()).map(|(commas, plain)| {
                (commas, String::from_utf8_lossy(&plain).split_whitespace().collect::<Vec<_>>().join(" "))
            })
        };
        let between = |text: &str| Some((Commas::Between, text.to_owned()));
        let decimal = |text: &str| Some((Commas::Decimal, text.to_owned()));
        assert_eq!(numbers("0, -1.5, 2"), between("0 -1.5 2"));
        assert_eq!(numbers("0,1.5,2"), between("0 1.5 2"));
        assert_eq!(numbers("1 , 2 , 3"), between("1 2 3"));
        assert_eq!(numbers("0,5 -1,25 3"), decimal("0.5 -1.25 3"));
        assert_eq!(numbers("0,5, 1,5, 2,5"), decimal("0.5 1.5 2.5"));
        assert_eq!(numbers("0 1 2"), None, "there is none");
        for unclear in ["0,5,1 2", "1,x 2", "a, b"] {
            assert_eq!(numbers(unclear), None, "{unclear}");
        }
    }
}
