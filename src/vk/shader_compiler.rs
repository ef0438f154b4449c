//! GLSL to SPIR-V. `build.rs` includes this file; the program has it, too, where shaders are compiled again while it runs.

use glslang::error::{GlslangError, GlslangErrorLog};
use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
use glslang::{
    Compiler, CompilerOptions, Shader, ShaderInput, ShaderMessage, ShaderSource, ShaderStage, SourceLanguage,
    SpirvVersion, Target, VulkanVersion,
};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// A compiled shader.
pub struct Compiled {
    /// Path as messages name it.
    pub file: String,
    /// SPIR-V.
    pub words: Vec<u32>,
    /// What the compiler warns of.
    pub warnings: Vec<String>,
}

/// The shaders of a folder, by name; none when the folder is not there.
pub fn shader_files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let paths: Vec<PathBuf> = entries.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<_>>()?;
    let mut files: Vec<PathBuf> = paths.into_iter().filter(|path| stage_of(path).is_some()).collect();
    files.sort();
    Ok(files)
}

/// The stage that a file is for, by its extension.
fn stage_of(path: &Path) -> Option<ShaderStage> {
    Some(match path.extension()?.to_str()? {
        "vert" => ShaderStage::Vertex,
        "frag" => ShaderStage::Fragment,
        "comp" => ShaderStage::Compute,
        _ => return None,
    })
}

/// Compiles a file of a folder of shaders for Vulkan 1.3; the errors read `file:line: message`.
pub fn compile(folder: &Path, path: &Path) -> Result<Compiled, Vec<String>> {
    let file = slashes(path);
    let stage = stage_of(path).ok_or_else(|| vec![format!("{file}: no shader, by its name")])?;
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
    let mut includes = Includes(folder);
    let mut warnings = Vec::new();
    let words = ShaderInput::new(&source, stage, &options, None::<&[(&str, Option<&str>)]>, Some(&mut includes))
        .and_then(|input| Shader::new(compiler, input).parse())
        .and_then(|shader| {
            warnings = logged((folder, &file), &shader.get_log(), "WARNING: ");
            shader.compile()
        })
        .map_err(|error| messages((folder, &file), &error))?;
    Ok(Compiled { file, words, warnings })
}

/// Finds `#include "x.glsl"` in the folder's `include`, then in the folder.
struct Includes<'a>(&'a Path);

impl IncludeHandler for Includes<'_> {
    fn include(&mut self, _: IncludeType, name: &str, _: &str, depth: usize) -> Option<IncludeResult> {
        // Files without guards that include each other would never end.
        const MAX_DEPTH: usize = 32;
        if depth > MAX_DEPTH {
            return None;
        }
        let candidates = [self.0.join("include").join(name), self.0.join(name)];
        let path = candidates.iter().find(|path| path.is_file())?;
        let data = fs::read_to_string(path).ok()?;
        Some(IncludeResult { name: slashes(path), data })
    }
}

/// The errors of a compiler's log, one each, as `file:line: message`.
fn messages((folder, file): (&Path, &str), error: &GlslangError) -> Vec<String> {
    use GlslangError::{LinkError, MapIoError, ParseError, PreprocessError};
    let (PreprocessError(log) | ParseError(log) | MapIoError(log) | LinkError(log)) = error else {
        return vec![format!("{file}: {error}")];
    };
    let GlslangErrorLog { log, .. } = log;
    let found = logged((folder, file), log, "ERROR: ");
    if found.is_empty() { vec![format!("{file}: {}", log.trim())] } else { found }
}

/// The entries of a compiler's log that start with `kind`, without the summaries.
fn logged((folder, file): (&Path, &str), log: &str, kind: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let mut in_entry = false;
    for line in log.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let starts_entry = line.starts_with("ERROR: ") || line.starts_with("WARNING: ");
        if let Some(text) = line.strip_prefix(kind) {
            let entry = placed((folder, file), text);
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
fn placed((folder, file): (&Path, &str), text: &str) -> String {
    match text.strip_prefix("0:") {
        Some(rest) => format!("{file}:{rest}"),
        None if text.starts_with(&slashes(folder)) => text.to_owned(),
        None => format!("{file}: {text}"),
    }
}

/// A path with forward slashes, as messages and `#include` write it.
fn slashes(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}
