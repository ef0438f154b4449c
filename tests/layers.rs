//! Holds the house rules that the compiler does not: which room may use which, how long a file may be, and that every
//! source cited in a comment is listed.

use std::fs;
use std::path::{Path, PathBuf};

/// What each room of `src` may name with `crate::`, besides itself. `refine::update` is a part of a room.
///
/// This is `math ← scene ← geom ← bsdf, light ← estimate ← cache ← refine` and `vk ← pass`, both `← session ← cli, app`: the engine knows no
/// Vulkan, the passes know the engine's updates only; `session` puts both together, without a command line. The yardstick `reference` shares no cache with what it measures.
const MAY_USE: &[(&str, &[&str])] = &[
    ("math", &[]),
    ("error", &["scene"]),
    ("system", &[]),
    ("trace", &[]),
    ("store", &["math", "error"]),
    ("scene", &["math", "error", "trace"]),
    ("geom", &["math", "error", "scene"]),
    ("bsdf", &["math", "scene"]),
    ("light", &["math", "error", "scene", "geom", "bsdf"]),
    ("estimate", &["math", "error", "scene", "geom", "bsdf", "light"]),
    ("cache", &["math", "error", "scene", "geom", "bsdf", "light", "estimate"]),
    ("refine", &["math", "error", "scene", "geom", "bsdf", "light", "estimate", "cache", "store", "trace"]),
    ("reference", &["math", "error", "scene", "geom", "bsdf", "light", "image"]),
    ("bench", &["math", "scene", "geom", "bsdf", "light", "estimate", "image", "reference", "refine::workers"]),
    ("bake", &["math", "error", "scene", "geom", "bsdf", "refine", "image"]),
    ("image", &["math", "error", "scene"]),
    ("log", &["math", "error", "scene", "image", "trace", "refine::update"]),
    ("vk", &["math", "error", "trace"]),
    ("compare", &["math", "error", "scene", "image", "log", "vk", "pass", "refine::update", "refine::replay"]),
    ("pass", &["math", "error", "scene", "bsdf", "vk", "image", "log", "trace", "refine::update"]),
    (
        "session",
        &[
            "math", "error", "scene", "geom", "light", "estimate", "refine", "vk", "pass", "image", "log", "store",
            "system", "trace",
        ],
    ),
];

/// The rooms that put the others together; they may use all of them.
const MAY_USE_ALL: &[&str] = &["lib", "main", "cli", "app"];

/// Crates that only some places may name: the crate, and the rooms or files that may.
const CRATES: &[(&str, &[&str])] = &[
    ("obvhs", &["src/geom/collapse.rs", "src/geom/halves.rs", "src/geom/tree.rs"]),
    ("wide", &["src/geom/"]),
    ("ash", &["src/vk/", "src/pass/", "src/app/"]),
    ("gpu_allocator", &["src/vk/"]),
    ("ash_window", &["src/vk/"]),
    ("raw_window_handle", &["src/vk/surface.rs", "src/vk/window_handles.rs"]),
    ("egui_ash_renderer", &["src/vk/overlay.rs"]),
    ("egui", &["src/app/", "src/vk/overlay.rs"]),
    ("egui_winit", &["src/app/"]),
    ("winit", &["src/app/"]),
    ("libloading", &["src/system.rs"]),
    ("clap", &["src/cli/"]),
    ("indicatif", &["src/cli/"]),
    ("glslang", &["src/vk/shader_compiler.rs"]),
    ("ctrlc", &["src/cli/"]),
    ("nix", &["src/system.rs"]),
    ("procfs", &["src/system.rs"]),
    ("redb", &["src/store/"]),
];

/// Extensions of shaders and of what they include.
const SHADERS: &[&str] = &["vert", "frag", "comp", "glsl"];

/// The longest a file of code or shaders may be.
const MAX_LINES: usize = 500;

#[test]
fn dependencies_point_one_way() {
    let faults: Vec<String> = sources("src", "rs")
        .iter()
        .flat_map(|file| room_faults(&slashes(file), &fs::read_to_string(file).unwrap()))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn crates_stay_in_their_rooms() {
    let faults: Vec<String> = sources("src", "rs")
        .iter()
        .flat_map(|file| crate_faults(&slashes(file), &fs::read_to_string(file).unwrap()))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn no_circle_of_files_inside_a_room() {
    let read = |file: &PathBuf| (slashes(file), fs::read_to_string(file).unwrap());
    let files: Vec<(String, String)> = sources("src", "rs").iter().map(read).collect();
    let mut rooms: Vec<&str> = files.iter().map(|(file, _)| room_of(file)).collect();
    rooms.dedup();
    let faults: Vec<String> = rooms
        .iter()
        .flat_map(|room| {
            let inside: Vec<_> = files.iter().filter(|(file, _)| room_of(file) == *room).cloned().collect();
            circles(&inside)
        })
        .map(|circle| format!("these import each other in a circle: {}", circle.join(", ")))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn files_are_short_enough_to_read() {
    let mut files = vec![root().join("build.rs")];
    files.extend(sources("src", "rs"));
    files.extend(sources("tests", "rs"));
    files.extend(sources("scenes", "rs"));
    files.extend(SHADERS.iter().flat_map(|extension| sources("glsl", extension)));
    let long: Vec<String> = files
        .iter()
        .map(|file| (file, fs::read_to_string(file).unwrap().lines().count()))
        .filter(|&(_, lines)| lines > MAX_LINES)
        .map(|(file, lines)| format!("{}: {lines} lines, at most {MAX_LINES}", slashes(file)))
        .collect();
    assert!(long.is_empty(), "{}", long.join("\n"));
}

/// A file beside a test program's `main.rs` that this does not name would be left out in silence.
#[test]
fn every_file_of_tests_is_run() {
    let is_left_out = |file: &&PathBuf| {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let main = fs::read_to_string(file.with_file_name("main.rs"));
        stem != "main" && main.is_ok_and(|main| !main.contains(&format!("\nmod {stem};\n")))
    };
    let left_out: Vec<String> = sources("tests", "rs").iter().filter(is_left_out).map(|file| slashes(file)).collect();
    assert!(left_out.is_empty(), "main.rs does not name {}", left_out.join(", "));
}

#[test]
fn citations_are_listed() {
    let listed = fs::read_to_string(root().join("docs/references.md")).unwrap();
    let mut files = sources("src", "rs");
    files.extend(SHADERS.iter().flat_map(|extension| sources("glsl", extension)));
    let unlisted: Vec<String> = files
        .iter()
        .flat_map(|file| citations(&fs::read_to_string(file).unwrap()).into_iter().map(move |key| (file, key)))
        .filter(|(_, key)| !listed.contains(&format!("**[{key}]**")))
        .map(|(file, key)| format!("{}: [{key}] is not in docs/references.md", slashes(file)))
        .collect();
    assert!(unlisted.is_empty(), "{}", unlisted.join("\n"));
}

#[test]
fn pages_that_comments_name_are_in_the_repository() {
    let mut files = sources("src", "rs");
    files.extend(sources("tests", "rs"));
    files.extend(SHADERS.iter().flat_map(|extension| sources("glsl", extension)));
    let this = root().join("tests/layers.rs");
    let missing: Vec<String> = files
        .iter()
        .filter(|file| **file != this)
        .flat_map(|file| pages(&fs::read_to_string(file).unwrap()).into_iter().map(move |page| (file, page)))
        .filter(|(_, page)| !root().join(page).is_file())
        .map(|(file, page)| format!("{}: {page} is not in the repository", slashes(file)))
        .collect();
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn pages_name_files_that_exist() {
    let mut pages = sources("docs", "md");
    pages.push(root().join("README.md"));
    // History keeps its names.
    let missing: Vec<String> = pages
        .iter()
        .filter(|page| !slashes(page).starts_with("docs/notebook/"))
        .flat_map(|page| named_files(&fs::read_to_string(page).unwrap()).into_iter().map(move |name| (page, name)))
        .filter(|(page, name)| !root().join(name).exists() && !page.with_file_name(name).exists())
        .map(|(page, name)| format!("{}: {name} does not exist", slashes(page)))
        .collect();
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn files_are_found_in_links_and_in_code() {
    let text = "See [this](method/a.md#b), [that](https://x.y), `src/cache/pool.rs`, `src/NEW/` and `cache::pool`.";
    assert_eq!(named_files(text), ["method/a.md", "src/cache/pool.rs"]);
}

#[test]
fn pages_are_found_however_they_are_cited() {
    let text =
        "//! As in docs/bench.md, (method 3) or `lavapipe.md` 4.\nlet a = \"b.md\"; // see method 5, the methods 2";
    assert_eq!(pages(text), ["docs/bench.md", "lavapipe.md", "method 3", "method 5"]);
}

#[test]
fn citations_are_told_from_links() {
    let text = "/// As in [FP03 §4.3] and [Duff17], not [`Scene`], [Camera], [this](x) or a[B64].\nlet x = a[X11];";
    assert_eq!(citations(text), ["FP03", "Duff17"]);
    assert_eq!(citations("// by its edges [Lambert §2]"), ["Lambert"]);
    assert_eq!(citations("// a weight [L 2.2], between [0, 1], of [Frame] 2"), ["L"]);
}

#[test]
fn the_rules_can_be_broken() {
    let faults = |file: &str, text: &str| room_faults(file, text).len() + crate_faults(file, text).len();
    assert_eq!(faults("src/geom/mod.rs", "use crate::scene::{FaceId, TriangleId};\nuse crate::math;"), 0);
    assert_eq!(faults("src/geom/mod.rs", "use crate::{scene::Scene, cache::{Cache, pool::Pool}};"), 2);
    assert_eq!(faults("src/pass/frame.rs", "use crate::refine::update::Update;"), 0);
    assert_eq!(faults("src/pass/frame.rs", "use crate::refine::{update::Update, engine::Engine};"), 1);
    assert_eq!(faults("src/cache/vertex.rs", "fn f() { crate::vk::buffer::new(); }"), 1);
    assert_eq!(faults("src/cache/vertex.rs", "// see crate::vk\n/// [`crate::pass`]"), 0);
    assert_eq!(faults("src/cache/vertex.rs", "use ash::vk; fn f() { hash::ash(); }"), 1);
    assert_eq!(faults("src/geom/ray.rs", "let tree = obvhs::cwbvh::build();"), 1);
    assert_eq!(faults("src/geom/tree.rs", "let tree = obvhs::cwbvh::build();"), 0);
    assert_eq!(faults("src/session/mod.rs", "use crate::{pass, refine};\nuse crate::cli;\nuse clap::Parser;"), 2);
    assert_eq!(faults("src/refine/mod.rs", "use crate::session::Session;"), 1);
    assert_eq!(faults("src/attic/mod.rs", "use crate::math;"), 1);
    assert_eq!(faults("src/cli/render.rs", "use crate::{pass, refine};"), 0);
}

#[test]
fn circles_are_found() {
    let files = |texts: &[(&str, &str)]| {
        texts.iter().map(|&(file, text)| (format!("src/attic/{file}.rs"), text.to_owned())).collect::<Vec<_>>()
    };
    let circle = [("a", "use super::b::{B, c};"), ("b", "fn f() { crate::attic::c::g(); }"), ("c", "use super::a::A;")];
    assert_eq!(circles(&files(&circle)), [["src/attic/a.rs", "src/attic/b.rs", "src/attic/c.rs"]]);
    // Deeper folders, and what a folder's own file defines.
    let deep = [("mod", "mod d;\nuse d::e::E;\nstruct A;"), ("d/mod", "pub mod e;"), ("d/e", "use super::super::A;")];
    assert_eq!(circles(&files(&deep)), [["src/attic/mod.rs", "src/attic/d/e.rs"]]);
    // A list of names that a folder passes on is no file of its own: who asks it for a name asks the file that has it.
    let passed_on =
        [("mod", "mod a;\nmod b;\npub use a::{A, C};\npub use b::B;"), ("a", "struct A;"), ("b", "use super::A;")];
    assert!(circles(&files(&passed_on)).is_empty());
    let tests_only =
        [("a", "use super::b::B;"), ("b", "// use super::a::A;\n#[cfg(test)]\nmod tests { use crate::attic::a; }")];
    assert!(circles(&files(&tests_only)).is_empty());
}

/// Groups of files, each with its text, that import each other in a circle, in the order of `files`.
fn circles(files: &[(String, String)]) -> Vec<Vec<String>> {
    let modules: Vec<Module> = files.iter().map(|(file, text)| Module::new(file, text)).collect();
    let uses: Vec<Vec<usize>> = modules.iter().map(|module| module.uses(&modules)).collect();
    let reached: Vec<Vec<bool>> = (0..files.len()).map(|from| reached(&uses, from)).collect();
    let mut found: Vec<Vec<String>> = Vec::new();
    for (from, leads_to) in reached.iter().enumerate() {
        let circle = (0..files.len()).filter(|&to| leads_to[to] && reached[to][from]).map(|file| files[file].0.clone());
        let circle: Vec<String> = circle.collect();
        if circle.len() > 1 && !found.contains(&circle) {
            found.push(circle);
        }
    }
    found
}

/// Which files a file leads to.
fn reached(uses: &[Vec<usize>], from: usize) -> Vec<bool> {
    let (mut reached, mut open) = (vec![false; uses.len()], vec![from]);
    while let Some(next) = open.pop() {
        for &used in &uses[next] {
            if !std::mem::replace(&mut reached[used], true) {
                open.push(used);
            }
        }
    }
    reached
}

/// A file as a module.
struct Module {
    /// Names from the crate down: `attic`, `d`, `e`.
    path: Vec<String>,
    /// The paths that it names, from the crate down, but for those that it only passes on.
    named: Vec<Vec<String>>,
    /// What it passes on with `pub use`: the name, and the path that it stands for.
    passed_on: Vec<(String, Vec<String>)>,
}

impl Module {
    fn new(file: &str, text: &str) -> Self {
        let file = file.trim_start_matches("src/").trim_end_matches(".rs").trim_end_matches("/mod");
        let path: Vec<String> = file.split('/').map(str::to_owned).collect();
        let code = without_comments(text);
        let code = code.split("#[cfg(test)]").next().unwrap_or_default();
        let children: Vec<&str> =
            code.split("mod ").skip(1).filter_map(|rest| rest.split_once(';')).map(|c| c.0).collect();
        let mut module = Self { path, named: Vec::new(), passed_on: Vec::new() };
        for start in ["crate", "super", "self"].into_iter().chain(children) {
            let path = format!("{start}::");
            for (at, _) in code.match_indices(&path).filter(|&(at, _)| starts_a_path(code, at)) {
                for branch in branches(&code[at..], usize::MAX) {
                    module.add(&branch, code[..at].ends_with("pub use "));
                }
            }
        }
        module
    }

    fn add(&mut self, branch: &str, passes_on: bool) {
        let mut names = branch.split("::").map(str::to_owned).peekable();
        let mut path = if names.peek().is_some_and(|first| first == "crate") { Vec::new() } else { self.path.clone() };
        while let Some(step) = names.next_if(|name| ["crate", "self", "super"].contains(&name.as_str())) {
            if step == "super" {
                path.pop();
            }
        }
        path.extend(names);
        match path.last().cloned().filter(|_| passes_on) {
            Some(name) => self.passed_on.push((name, path)),
            None => self.named.push(path),
        }
    }

    /// Indices of the other files that it names something of.
    fn uses(&self, all: &[Self]) -> Vec<usize> {
        let found = self.named.iter().filter_map(|path| home(all, path));
        found.filter(|&at| all[at].path != self.path).collect()
    }
}

/// The file that has what a path names.
fn home(all: &[Module], path: &[String]) -> Option<usize> {
    let longest = (0..all.len()).filter(|&k| path.starts_with(&all[k].path)).max_by_key(|&k| all[k].path.len())?;
    let rest = &path[all[longest].path.len()..];
    let passed_on = all[longest].passed_on.iter().find(|(name, _)| rest.first() == Some(name));
    passed_on.map_or(Some(longest), |(_, path)| home(all, path))
}

/// Whether a path begins at a place of some code rather than goes on there.
fn starts_a_path(code: &str, at: usize) -> bool {
    code[..at].chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':')
}

/// The uses of other rooms in one file that its own room may not make.
fn room_faults(file: &str, text: &str) -> Vec<String> {
    let room = room_of(file);
    if MAY_USE_ALL.contains(&room) {
        return Vec::new();
    }
    let Some((_, allowed)) = MAY_USE.iter().find(|(name, _)| *name == room) else {
        return vec![format!("{file}: room `{room}` has no rule; add it to MAY_USE in tests/layers.rs")];
    };
    let permits = |used: &str| {
        let inside = |outer: &str| used == outer || used.starts_with(&format!("{outer}::"));
        inside(room) || allowed.iter().any(|outer| inside(outer))
    };
    let used = used_rooms(&without_comments(text));
    used.iter().filter(|used| !permits(used)).map(|used| format!("{file}: `{room}` may not use `{used}`")).collect()
}

/// The crates that one file names and may not.
fn crate_faults(file: &str, text: &str) -> Vec<String> {
    let code = without_comments(text);
    let names = |krate: &str| {
        code.match_indices(&format!("{krate}::")).any(|(at, _)| {
            let before = code[..at].chars().next_back();
            before.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':')
        })
    };
    CRATES
        .iter()
        .filter(|(krate, places)| names(krate) && !places.iter().any(|place| file.starts_with(place)))
        .map(|(krate, places)| format!("{file}: only {} may name `{krate}`", places.join(", ")))
        .collect()
}

/// The first two names of every path that starts with `crate::`, groups in braces taken apart.
fn used_rooms(code: &str) -> Vec<String> {
    code.match_indices("crate::")
        // `$crate::` of a macro counts too; a longer name such as `my_crate::` does not.
        .filter(|(at, _)| code[..*at].chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '_'))
        .flat_map(|(at, path)| branches(&code[at + path.len()..], 2))
        .collect()
}

/// The beginnings, `depth` names long, of the paths that a use tree stands for.
fn branches(tree: &str, depth: usize) -> Vec<String> {
    let tree = tree.trim_start();
    if let Some(group) = tree.strip_prefix('{') {
        return group_items(group).iter().flat_map(|item| branches(item, depth)).collect();
    }
    let end = tree.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(tree.len());
    let (name, rest) = tree.split_at(end);
    match rest.strip_prefix("::") {
        Some(rest) if depth > 1 => branches(rest, depth - 1).iter().map(|branch| format!("{name}::{branch}")).collect(),
        _ => vec![name.to_owned()],
    }
}

/// The items of a group, without its opening brace, up to the closing one.
fn group_items(group: &str) -> Vec<&str> {
    let mut items = Vec::new();
    let (mut level, mut start) = (0, 0);
    for (at, c) in group.char_indices() {
        match c {
            '{' => level += 1,
            '}' if level > 0 => level -= 1,
            ',' | '}' if level == 0 => {
                items.push(group[start..at].trim());
                start = at + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    items.retain(|item| !item.is_empty());
    items
}

fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The files that a page links to, or names in code: those of an example, in capitals, left out.
fn named_files(text: &str) -> Vec<String> {
    let links = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
    let links = links.filter(|link| !link.is_empty() && !link.starts_with("http"));
    let folders = ["src/", "glsl/", "tests/", "scenes/", "docs/"];
    let is_file = |name: &&str| {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "/._-".contains(c);
        folders.iter().any(|folder| name.starts_with(folder)) && name.chars().all(plain)
    };
    let code = text.lines().flat_map(|line| line.split('`').skip(1).step_by(2)).filter(is_file);
    links.chain(code).map(str::to_owned).collect()
}

/// What comments cite as a page: a file of Markdown, or "method" and a number.
fn pages(text: &str) -> Vec<String> {
    let comments = text.lines().filter_map(|line| line.split_once("//").map(|(_, comment)| comment));
    let mut found = Vec::new();
    for comment in comments {
        let words: Vec<&str> = comment.split(|c: char| !c.is_alphanumeric() && !"/._-".contains(c)).collect();
        let words: Vec<&str> = words.iter().map(|word| word.trim_matches('.')).filter(|w| !w.is_empty()).collect();
        found.extend(words.iter().filter(|word| word.ends_with(".md")).map(|word| (*word).to_owned()));
        let numbered = words.windows(2).filter(|w| w[0] == "method" && w[1].parse::<u32>().is_ok());
        found.extend(numbered.map(|w| w.join(" ")));
    }
    found
}

/// The keys cited in comments: `[Name12]`, or any `[Name §…]` and `[Name 1.2]`.
fn citations(text: &str) -> Vec<String> {
    let comments = text.lines().filter_map(|line| line.split_once("//").map(|(_, comment)| comment));
    comments
        .flat_map(|comment| comment.match_indices('[').filter_map(|(at, _)| citation(comment, at)))
        .map(str::to_owned)
        .collect()
}

/// The key of the citation whose bracket opens at `at`.
fn citation(comment: &str, at: usize) -> Option<&str> {
    // What stands directly before the bracket makes it an index.
    if comment[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || c == '_') {
        return None;
    }
    let content = comment[at + 1..].split(']').next()?;
    let key = content.split([' ', ',']).next()?;
    let year = key.len() > 3 && key.is_ascii() && key[key.len() - 2..].chars().all(|c| c.is_ascii_digit());
    let name = key.starts_with(|c: char| c.is_ascii_uppercase()) && key.chars().all(|c| c.is_ascii_alphanumeric());
    let place =
        content.split(' ').nth(1).is_some_and(|word| word.starts_with(|c: char| c == '§' || c.is_ascii_digit()));
    (name && (year || place)).then_some(key)
}

/// The room of `src/geom/bvh.rs` is `geom`, that of `src/error.rs` is `error`.
fn room_of(file: &str) -> &str {
    let inside = file.strip_prefix("src/").unwrap_or(file);
    inside.split('/').next().unwrap_or(inside).trim_end_matches(".rs")
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every file with an extension under a folder of the repository; none when the folder is not there.
fn sources(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// A path relative to the repository, with forward slashes.
fn slashes(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).to_string_lossy().replace('\\', "/")
}
