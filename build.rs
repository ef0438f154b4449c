//! Compiles the shaders of `glsl/` to SPIR-V and writes `$OUT_DIR/shaders.rs`: their words, and the memory layouts of
//! the structs that they share with the host.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

#[path = "src/vk/shader_compiler.rs"]
mod shader_compiler;
#[path = "src/vk/spirv_layout.rs"]
mod spirv_layout;
use shader_compiler::{Compiled, compile, shader_files};
use spirv_layout::{Layout, snake_case};

const SHADERS: &str = "glsl";

fn main() -> io::Result<()> {
    for input in ["build.rs", "src/vk/shader_compiler.rs", "src/vk/spirv_layout.rs", SHADERS] {
        println!("cargo::rerun-if-changed={input}");
    }
    let mut errors = Vec::new();
    let mut shaders = Vec::new();
    let folder = Path::new(SHADERS);
    for file in shader_files(folder)? {
        match compile(folder, &file) {
            Ok(shader) => {
                shader.warnings.iter().for_each(|warning| println!("cargo::warning={warning}"));
                shaders.push(shader);
            }
            Err(messages) => errors.extend(messages),
        }
    }
    let layouts = shared_layouts(&shaders, &mut errors);
    for error in &errors {
        println!("cargo::error={error}");
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("cargo sets no OUT_DIR"))?);
    fs::write(out.join("shaders.rs"), generated(&shaders, &layouts))
}

/// The structs of all shaders by module name, checked against each other.
fn shared_layouts(shaders: &[Compiled], errors: &mut Vec<String>) -> BTreeMap<String, (Layout, String)> {
    let mut layouts: BTreeMap<String, (Layout, String)> = BTreeMap::new();
    for shader in shaders {
        let found = spirv_layout::read(&shader.words).unwrap_or_else(|what| {
            errors.push(format!("{}: {what}", shader.file));
            Vec::new()
        });
        for layout in found {
            let (known, file) =
                layouts.entry(snake_case(&layout.name)).or_insert_with(|| (layout.clone(), shader.file.clone()));
            if !known.agrees_with(&layout) {
                errors.push(format!(
                    "{file} and {} disagree on a struct: {known}; {layout}; put it into an include or rename one",
                    shader.file
                ));
            }
            known.stride = known.stride.or(layout.stride);
        }
    }
    layouts
}

/// The text of `shaders.rs`.
fn generated(shaders: &[Compiled], layouts: &BTreeMap<String, (Layout, String)>) -> String {
    let mut text = String::new();
    for Compiled { file, words, .. } in shaders {
        let constant = constant_name(file);
        let words: Vec<String> = words.iter().map(|word| format!("{word:#x}")).collect();
        let _ = writeln!(text, "/// `{file}`, SPIR-V 1.6.\npub static {constant}: &[u32] = &[{}];", words.join(","));
    }
    text.push_str("/// All of them, by the names of their files.\n#[cfg(feature = \"shader-reload\")]\npub static ALL: &[(&str, &[u32])] = &[");
    for Compiled { file, .. } in shaders {
        let _ = write!(text, "({:?},{}),", file_name(file), constant_name(file));
    }
    text.push_str("];\n");
    text.push_str("/// Memory layouts of the structs of the shaders, bytes.\npub mod layout {\n");
    for (module, (layout, file)) in layouts {
        // A raw identifier is the plain one unless it is a keyword.
        let _ = writeln!(text, "/// `{}`, first seen in `{file}`.\npub mod r#{module} {{", layout.name);
        let _ = writeln!(text, "/// Size of one struct.\npub const SIZE: usize = {};", layout.size());
        for member in &layout.members {
            let name = snake_case(&member.name).to_uppercase();
            let _ = writeln!(text, "/// Offset of `{}`.\npub const {name}: usize = {};", member.name, member.offset);
        }
        text.push_str("}\n");
    }
    text.push_str("}\n");
    text
}

/// `glsl/luminance_export.frag` gives `LUMINANCE_EXPORT_FRAG`.
fn constant_name(file: &str) -> String {
    file_name(file).replace(|c: char| !c.is_ascii_alphanumeric(), "_").to_uppercase()
}

/// A file without its folder.
fn file_name(file: &str) -> &str {
    file.rsplit('/').next().unwrap_or(file)
}
