//! Lines of commands cut into words, and words put into lines.

/// The words of a line. They are separated by blanks; one in double quotes may hold blanks, `\"` and `\\` stand for the mark itself
/// there. What follows a word that starts with `#` is a comment.
///
/// # Errors
/// A quote that is not closed.
pub fn split(line: &str) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let mut rest = line.trim_start();
    while !rest.is_empty() && !rest.starts_with('#') {
        let (word, after) = match rest.strip_prefix('"') {
            Some(inside) => quoted_word(inside)?,
            None => {
                let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
                (rest[..end].to_owned(), &rest[end..])
            }
        };
        words.push(word);
        rest = after.trim_start();
    }
    Ok(words)
}

/// A word up to its closing quote, and what follows.
fn quoted_word(inside: &str) -> Result<(String, &str), String> {
    let mut word = String::new();
    let mut characters = inside.char_indices();
    while let Some((at, character)) = characters.next() {
        match character {
            '"' => return Ok((word, &inside[at + 1..])),
            '\\' => word.extend(characters.next().map(|(_, character)| character)),
            other => word.push(other),
        }
    }
    Err(format!("the quote in front of {inside:?} is not closed"))
}

/// A word as it is written in a line.
#[must_use]
pub fn quoted(word: &str) -> String {
    let plain = !word.is_empty() && !word.starts_with(['#', '"']) && !word.contains(char::is_whitespace);
    if plain { word.to_owned() } else { format!("\"{}\"", word.replace('\\', "\\\\").replace('"', "\\\"")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_as_they_were() {
        for word in ["lamp", "light 1", "a\"b", "a \"b\" \\ c", "", "#1", "C:\\x", "ä b", "\"q"] {
            assert_eq!(split(&format!(" x  {} y", quoted(word))).unwrap(), ["x", word, "y"]);
        }
    }

    #[test]
    fn comments_and_blanks_are_no_words() {
        assert_eq!(split("  # all of it").unwrap(), [""; 0]);
        assert_eq!(split("1 light.toggle a#b # on").unwrap(), ["1", "light.toggle", "a#b"]);
        assert!(split("light.toggle \"light 1").unwrap_err().contains("not closed"));
    }
}
