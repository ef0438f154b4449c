//! Compiles the shaders of `glsl/` to SPIR-V and writes `$OUT_DIR/shaders.rs`: their words, and the memory layouts of
//! the structs that they share with the host.

use glslang::error::{GlslangError, GlslangErrorLog};
use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
use glslang::{
    Compiler, CompilerOptions, Shader, ShaderInput, ShaderMessage, ShaderSource, ShaderStage, SourceLanguage,
    SpirvVersion, Target, VulkanVersion,
};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io};

#[path = "src/vk/spirv_layout.rs"]
mod spirv_layout;
use spirv_layout::{Layout, snake_case};

const SHADERS: &str = "glsl";
const INCLUDES: &str = "glsl/include";

/// A compiled shader.
struct Compiled {
    /// Path as messages name it.
    file: String,
    /// Constant that holds it: `LUMINANCE_FRAG` for `luminance.frag`.
    constant: String,
    words: Vec<u32>,
}

fn main() -> io::Result<()> {
    for input in ["build.rs", "src/vk/spirv_layout.rs", SHADERS] {
        println!("cargo::rerun-if-changed={input}");
    }
    let mut errors = Vec::new();
    let mut shaders = Vec::new();
    for (file, stage) in shader_files()? {
        match compile(&file, stage) {
            Ok(shader) => shaders.push(shader),
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

/// The shaders of `glsl/` with their stages, by name; none when the folder is not there.
fn shader_files() -> io::Result<Vec<(PathBuf, ShaderStage)>> {
    let folder = match fs::read_dir(SHADERS) {
        Ok(folder) => folder,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let mut files = Vec::new();
    for entry in folder {
        let path = entry?.path();
        let stage = match path.extension().and_then(|e| e.to_str()) {
            Some("vert") => ShaderStage::Vertex,
            Some("frag") => ShaderStage::Fragment,
            Some("comp") => ShaderStage::Compute,
            _ => continue,
        };
        files.push((path, stage));
    }
    files.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(files)
}

/// Compiles one file for Vulkan 1.3; the errors read `file:line: message`.
fn compile(path: &Path, stage: ShaderStage) -> Result<Compiled, Vec<String>> {
    let file = slashes(path);
    let text = fs::read_to_string(path).map_err(|error| vec![format!("{file}: cannot read: {error}")])?;
    if text.contains('\0') {
        return Err(vec![format!("{file}: contains a zero byte; is it a text file?")]);
    }
    let compiler = Compiler::acquire().ok_or_else(|| vec!["glslang does not start".to_owned()])?;
    let options = CompilerOptions {
        source_language: SourceLanguage::GLSL,
        target: Target::Vulkan { version: VulkanVersion::Vulkan1_3, spirv_version: SpirvVersion::SPIRV1_6 },
        version_profile: None,
        messages: ShaderMessage::DEFAULT | ShaderMessage::SPV_RULES | ShaderMessage::VULKAN_RULES,
    };
    let source = ShaderSource::from(text);
    let mut includes = Includes;
    let words = ShaderInput::new(&source, stage, &options, None::<&[(&str, Option<&str>)]>, Some(&mut includes))
        .and_then(|input| Shader::new(compiler, input).parse())
        .and_then(|shader| {
            for warning in logged(&file, &shader.get_log(), "WARNING: ") {
                println!("cargo::warning={warning}");
            }
            shader.compile()
        })
        .map_err(|error| messages(&file, &error))?;
    Ok(Compiled { constant: constant_name(path), file, words })
}

/// Finds `#include "x.glsl"` in `glsl/include`, then in `glsl`.
struct Includes;

impl IncludeHandler for Includes {
    fn include(&mut self, _: IncludeType, name: &str, _: &str, depth: usize) -> Option<IncludeResult> {
        // Files without guards that include each other would never end.
        const MAX_DEPTH: usize = 32;
        if depth > MAX_DEPTH {
            return None;
        }
        let candidates = [Path::new(INCLUDES).join(name), Path::new(SHADERS).join(name)];
        let path = candidates.iter().find(|path| path.is_file())?;
        let data = fs::read_to_string(path).ok()?;
        Some(IncludeResult { name: slashes(path), data })
    }
}

/// The errors of a compiler's log, one each, as `file:line: message`.
fn messages(file: &str, error: &GlslangError) -> Vec<String> {
    use GlslangError::{LinkError, MapIoError, ParseError, PreprocessError};
    let (PreprocessError(log) | ParseError(log) | MapIoError(log) | LinkError(log)) = error else {
        return vec![format!("{file}: {error}")];
    };
    let GlslangErrorLog { log, .. } = log;
    let found = logged(file, log, "ERROR: ");
    if found.is_empty() { vec![format!("{file}: {}", log.trim())] } else { found }
}

/// The entries of a compiler's log that start with `kind`, without the summaries.
fn logged(file: &str, log: &str, kind: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let mut in_entry = false;
    for line in log.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let starts_entry = line.starts_with("ERROR: ") || line.starts_with("WARNING: ");
        if let Some(text) = line.strip_prefix(kind) {
            let entry = placed(file, text);
            // The log repeats what the preprocessor said; the compiler ends it with summaries.
            in_entry = !found.contains(&entry)
                && !text.contains("compilation errors.")
                && !text.contains("compilation terminated");
            if in_entry {
                found.push(entry);
            }
        } else if starts_entry {
            in_entry = false;
        } else if let (true, Some(entry)) = (in_entry, found.last_mut()) {
            // A list that belongs to the line before, such as the extensions that would allow something.
            *entry += &format!(" {line}");
        }
    }
    found
}

/// A message with its file: the compiler knows the shader as string 0, and an include by the name that `Includes` gave.
fn placed(file: &str, text: &str) -> String {
    match text.strip_prefix("0:") {
        Some(rest) => format!("{file}:{rest}"),
        None if text.starts_with(SHADERS) => text.to_owned(),
        None => format!("{file}: {text}"),
    }
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
    for Compiled { file, constant, words } in shaders {
        let words: Vec<String> = words.iter().map(|word| format!("{word:#x}")).collect();
        let _ = writeln!(text, "/// `{file}`, SPIR-V 1.6.\npub static {constant}: &[u32] = &[{}];", words.join(","));
    }
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

/// `luminance-update.frag` gives `LUMINANCE_UPDATE_FRAG`.
fn constant_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.replace(|c: char| !c.is_ascii_alphanumeric(), "_").to_uppercase()
}

/// A path with forward slashes, as messages and `#include` write it.
fn slashes(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}
