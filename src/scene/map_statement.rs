//! Texture statements of an MTL file: a file's name and options, which exporters write before it or after.

use super::map_options::{Channel, MapOptions};
use super::text;

/// A texture statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MapStatement {
    /// Names that the file may have, in the order in which they are tried. Two where the end may be a comment.
    pub names: Vec<String>,
    /// Its line.
    pub line: u32,
    /// What the options say.
    pub options: MapOptions,
    /// Options that would change the picture and are not used.
    pub unused: Vec<&'static str>,
}

impl MapStatement {
    /// Reads what follows the keyword; `None` without a file name.
    pub(super) fn read(rest: &[u8], line: u32) -> Option<Self> {
        let mut statement = Self { names: Vec::new(), line, options: MapOptions::default(), unused: Vec::new() };
        let rest = statement.leading_options(rest.trim_ascii());
        let whole = statement.trailing_options(rest);
        let whole_name = unquoted(&text::decode(whole)).to_owned();
        if let Some(plain) = text::uncommented(&text::decode(whole)) {
            let plain = statement.trailing_options(plain.as_bytes());
            statement.names.push(unquoted(&text::decode(plain)).to_owned());
        }
        statement.names.insert(0, whole_name);
        statement.names.retain(|name| !name.is_empty());
        (!statement.names.is_empty()).then_some(statement)
    }

    /// Takes the options that stand before the name; the rest of the line.
    fn leading_options<'r>(&mut self, mut rest: &'r [u8]) -> &'r [u8] {
        while let Some(Given { option, values, after }) = option_at(rest, true) {
            // What is left must hold the name.
            if after.is_empty() {
                break;
            }
            self.take(option, &values);
            rest = after;
        }
        rest
    }

    /// Takes the options that stand after the name; what stands before them.
    fn trailing_options<'r>(&mut self, rest: &'r [u8]) -> &'r [u8] {
        let starts = (1..rest.len()).filter(|&at| rest[at] == b'-' && rest[at - 1].is_ascii_whitespace());
        for start in starts {
            let (mut found, mut tail) = (Vec::new(), &rest[start..]);
            while let Some(Given { option, values, after }) = option_at(tail, false) {
                found.push((option, values));
                tail = after;
            }
            if tail.is_empty() {
                found.iter().for_each(|(option, values)| self.take(option, values));
                return rest[..start].trim_ascii_end();
            }
        }
        rest
    }

    fn take(&mut self, option: &'static KnownOption, values: &[&[u8]]) {
        let number = |k: usize| values.get(k).and_then(|value| text::number(value));
        let all = |neutral: f32| values.iter().all(|value| text::number(value) == Some(neutral));
        let word = values.first().map(|value| value.to_ascii_lowercase()).unwrap_or_default();
        let options = &mut self.options;
        let is_used = match option.name {
            "-s" => {
                options.scale = [0, 1].map(|k| number(k).unwrap_or(1.0));
                true
            }
            "-o" => {
                options.offset = [0, 1].map(|k| number(k).unwrap_or(0.0));
                true
            }
            "-mm" => {
                (options.base, options.gain) = (number(0).unwrap_or(0.0), number(1).unwrap_or(1.0));
                true
            }
            "-clamp" => {
                options.clamp = word == b"on";
                true
            }
            "-imfchan" => {
                options.channel = channel(&word);
                options.channel != Some(Channel::Z)
            }
            "-t" | "-boost" => all(0.0),
            "-bm" => all(1.0),
            "-blendu" | "-blendv" => word == b"on",
            "-cc" => word == b"off",
            // How many texels are wanted: all are used.
            "-texres" => true,
            "-colorspace" => word == b"srgb",
            _ => false,
        };
        if !is_used && !self.unused.contains(&option.name) {
            self.unused.push(option.name);
        }
    }
}

fn channel(word: &[u8]) -> Option<Channel> {
    match word {
        b"r" => Some(Channel::R),
        b"g" => Some(Channel::G),
        b"b" => Some(Channel::B),
        b"m" => Some(Channel::M),
        b"l" => Some(Channel::L),
        b"z" => Some(Channel::Z),
        _ => None,
    }
}

/// A name without the quotes around it.
fn unquoted(name: &str) -> &str {
    name.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(name)
}

/// An option of texture statements.
struct KnownOption {
    name: &'static str,
    /// Fewest and most values.
    values: (usize, usize),
    /// What the values are.
    kind: Values,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Values {
    Numbers,
    /// `on` or `off`.
    Switch,
    /// A word.
    Word,
}

/// All options there are.
static OPTIONS: [KnownOption; 14] = {
    const fn option(name: &'static str, values: (usize, usize), kind: Values) -> KnownOption {
        KnownOption { name, values, kind }
    }
    use Values::{Numbers, Switch, Word};
    [
        option("-o", (1, 3), Numbers),
        option("-s", (1, 3), Numbers),
        option("-t", (1, 3), Numbers),
        option("-mm", (2, 2), Numbers),
        option("-bm", (1, 1), Numbers),
        option("-boost", (1, 1), Numbers),
        option("-texres", (1, 2), Numbers),
        option("-blendu", (1, 1), Switch),
        option("-blendv", (1, 1), Switch),
        option("-cc", (1, 1), Switch),
        option("-clamp", (1, 1), Switch),
        option("-imfchan", (1, 1), Word),
        option("-type", (1, 1), Word),
        option("-colorspace", (1, 1), Word),
    ]
};

/// An option as it is given.
struct Given<'r> {
    option: &'static KnownOption,
    values: Vec<&'r [u8]>,
    /// The rest of the line.
    after: &'r [u8],
}

/// The option at the start of `rest`; `None` where there is none that is complete.
///
/// Before the name, a number that could be a value is the name where nothing else is left.
fn option_at(rest: &[u8], before_the_name: bool) -> Option<Given<'_>> {
    let (word, mut after) = text::keyword(rest);
    let option = OPTIONS.iter().find(|option| word.eq_ignore_ascii_case(option.name.as_bytes()))?;
    let (least, most) = option.values;
    let mut values = Vec::new();
    while values.len() < most {
        let (value, next) = text::keyword(after);
        let fits = match option.kind {
            Values::Numbers => text::number(value).is_some(),
            Values::Switch => [&b"on"[..], b"off"].iter().any(|switch| value.eq_ignore_ascii_case(switch)),
            Values::Word => !value.is_empty(),
        };
        if !fits || (before_the_name && values.len() >= least && next.is_empty()) {
            break;
        }
        values.push(value);
        after = next;
    }
    // A wrong value before the name is left out with its option.
    if values.len() < least && before_the_name {
        let (value, next) = text::keyword(after);
        if !value.is_empty() && !next.is_empty() {
            values.push(value);
            after = next;
        }
    }
    (values.len() >= least).then_some(Given { option, values, after })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> MapStatement {
        MapStatement::read(line.as_bytes(), 1).unwrap_or_else(|| panic!("{line}: no name"))
    }

    #[test]
    fn names_are_told_from_options() {
        for (line, name) in [
            ("a b.png", "a b.png"),
            ("-texres 512 input.jpg", "input.jpg"),
            ("-s 1 1 1 -o 0 0 x y.png", "x y.png"),
            ("-clamp off -imfchan r 12", "12"),
            ("-s 2 2 7", "7"),
            ("\"quoted name.png\"", "quoted name.png"),
            ("-bm 0.5 \"quoted name.png\" -clamp on", "quoted name.png"),
            ("-odd.png", "-odd.png"),
            ("- a.png", "- a.png"),
            ("a.png -s 2 2 2", "a.png"),
            ("my file.png -bm 1 -clamp on", "my file.png"),
            ("-s 2 2 a.png -o 1", "a.png"),
            ("wall -s 1.png", "wall -s 1.png"),
            ("wall -o", "wall -o"),
            ("-blendu off -blendv on -cc off a.png", "a.png"),
        ] {
            assert_eq!(read(line).names, [name], "{line}");
        }
        assert_eq!(MapStatement::read(b"  ", 1), None);
    }

    #[test]
    fn comments_are_told_from_names_by_the_files_there_are() {
        assert_eq!(read("tex.png # diffuse").names, ["tex.png # diffuse", "tex.png"]);
        assert_eq!(read("tex.png -s 2 2 #old").names, ["tex.png -s 2 2 #old", "tex.png"]);
        assert_eq!(read("tex.png -s 2 2 #old").options.scale, [2.0, 2.0]);
        assert_eq!(read("a#b.png").names, ["a#b.png"]);
        assert_eq!(read("Map #3.png").names, ["Map #3.png"]);
    }

    #[test]
    fn options_count_on_both_sides_of_the_name() {
        for line in [
            "-s 4 2 1 -o 0.5 -1 -clamp on -imfchan g -mm 0.25 0.5 a.png",
            "a.png -s 4 2 1 -o 0.5 -1 -clamp on -imfchan g -mm 0.25 0.5",
        ] {
            let found = read(line);
            let channel = Some(Channel::G);
            let expected =
                MapOptions { scale: [4.0, 2.0], offset: [0.5, -1.0], clamp: true, channel, base: 0.25, gain: 0.5 };
            assert_eq!((found.options, found.unused), (expected, vec![]), "{line}");
        }
        assert_eq!(read("-s 3 a.png").options.scale, [3.0, 1.0], "what is not named is 1");
    }

    #[test]
    fn what_is_neutral_needs_no_word() {
        let neutral = "-bm 1 -blendu on -blendv on -cc off -texres 512 -boost 0 -t 0 0 0 a.png";
        assert_eq!(read(neutral).unused, [""; 0]);
        let active = "-bm 2 -blendu off -cc on -boost 3 -t 1 -type sphere -imfchan z a.png -t 1 2 3";
        assert_eq!(read(active).unused, ["-bm", "-blendu", "-cc", "-boost", "-t", "-type", "-imfchan"]);
    }
}
