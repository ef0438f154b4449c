//! What of a scene changed since an earlier run, and what that means for the light that was kept.

use super::content::{Content, Part};
use std::collections::HashMap;

/// Names that a line holds at most.
const MOST_NAMES: usize = 3;

impl Content {
    /// How much of the scene is as it was: parts of the same content. Of several earlier scenes the one with the most is meant.
    #[must_use]
    pub fn in_common(&self, before: &Self) -> usize {
        let same = |now: &[Part], before: &[Part]| {
            let paired = paired(now, before);
            paired.iter().filter(|(now, before)| before.is_some_and(|b| b.hash == now.hash)).count()
        };
        let parts =
            [(&self.materials, &before.materials), (&self.textures, &before.textures), (&self.lights, &before.lights)];
        // The geometry counts more than all else.
        let geometry = if self.geometry == before.geometry { 1 << 32 } else { 0 };
        geometry + parts.iter().map(|(now, before)| same(now, before)).sum::<usize>()
    }

    /// What was changed since the scene was as `before`, a line each kind of change, with what it means for the light that was kept; none
    /// if all of that holds.
    #[must_use]
    pub fn changes(&self, before: &Self) -> Vec<String> {
        if self.geometry != before.geometry {
            let count = |content: &Self| content.triangles;
            let counts = if count(self) == count(before) {
                String::new()
            } else {
                format!(" ({} triangles, now {})", count(before), count(self))
            };
            return vec![format!("geometry: changed{counts}; all light is computed anew")];
        }
        let mut lines = self.changed_lights(before);
        if self.surfaces != before.surfaces {
            let changed = |now: &[Part], before: &[Part]| -> Vec<String> {
                let paired = paired(now, before);
                let differs = |(now, before): &(&Part, Option<&Part>)| before.is_none_or(|b| b.hash != now.hash);
                paired.iter().filter(|pair| differs(pair)).map(|(now, _)| now.name.clone()).collect()
            };
            let textures = named("texture", &changed(&self.textures, &before.textures));
            let materials = named("material", &changed(&self.materials, &before.materials));
            // A material is changed by its texture, too: that is what to name.
            let what = textures.or(materials).unwrap_or_else(|| "what surfaces look like".to_owned());
            lines.push(format!("{what}: changed; indirect light is computed anew"));
        }
        lines
    }

    fn changed_lights(&self, before: &Self) -> Vec<String> {
        let paired = paired(&self.lights, &before.lights);
        let names = |wanted: &dyn Fn(&Part, Option<&Part>) -> bool| -> Vec<String> {
            paired.iter().filter(|(now, before)| wanted(now, *before)).map(|(now, _)| now.name.clone()).collect()
        };
        let moved = names(&|now, before| before.is_some_and(|b| b.place != now.place));
        let power = names(&|now, before| before.is_some_and(|b| b.place == now.place && b.hash != now.hash));
        let new = names(&|_, before| before.is_none());
        let gone: Vec<String> = self::paired(&before.lights, &self.lights)
            .iter()
            .filter(|(_, now)| now.is_none())
            .map(|(before, _)| before.name.clone())
            .collect();
        let lines = [
            (moved, "changed; its direct light and indirect light are computed anew"),
            (power, "another power; direct light is used, indirect light is computed anew"),
            (new, "new; indirect light is computed anew"),
            (gone, "gone; indirect light is computed anew"),
        ];
        lines.iter().filter_map(|(names, what)| named("light", names).map(|who| format!("{who}: {what}"))).collect()
    }
}

/// Names in quotes after their kind; none if there are none.
fn named(kind: &str, names: &[String]) -> Option<String> {
    let quoted: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("'{name}'")).collect();
    let kind = if names.len() > 1 { format!("{kind}s") } else { kind.to_owned() };
    let more = match names.len().saturating_sub(MOST_NAMES) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!names.is_empty()).then(|| format!("{kind} {}{more}", quoted.join(", ")))
}

/// Each part with its like in another list, which is taken once: that of the same name and content, else of the same content, else of the
/// same name.
fn paired<'a>(parts: &'a [Part], others: &'a [Part]) -> Vec<(&'a Part, Option<&'a Part>)> {
    let mut likes: Vec<Option<&Part>> = vec![None; parts.len()];
    let mut taken = vec![false; others.len()];
    for (by_name, by_hash) in [(true, true), (false, true), (true, false)] {
        let key = |part: &'a Part| (by_name.then_some(&*part.name), by_hash.then_some(part.hash));
        let mut open: HashMap<_, Vec<usize>> = HashMap::new();
        let left = others.iter().enumerate().rev().filter(|(at, _)| !taken[*at]);
        left.for_each(|(at, other)| open.entry(key(other)).or_default().push(at));
        for (part, like) in parts.iter().zip(&mut likes).filter(|(_, like)| like.is_none()) {
            if let Some(at) = open.get_mut(&key(part)).and_then(Vec::pop) {
                (*like, taken[at]) = (Some(&others[at]), true);
            }
        }
    }
    parts.iter().zip(likes).collect()
}
