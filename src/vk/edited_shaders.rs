//! Shaders compiled again while the program runs: pipelines that are made from then on use them.

use super::shader_compiler::{Compiled, compile, shader_files};
use super::shaders;
use super::spirv_layout::{self, Layout};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, PoisonError, RwLock};

/// SPIR-V of all shaders, by the names of their files; of none, those that were built in.
#[derive(Clone, Debug, Default)]
pub struct EditedShaders(BTreeMap<String, Arc<[u32]>>);

static PRESENT: RwLock<EditedShaders> = RwLock::new(EditedShaders(BTreeMap::new()));

impl EditedShaders {
    /// Compiles the shaders of a folder.
    ///
    /// # Errors
    /// Every fault, as `file:line: message`; structs that the host shares and that are not as it was built with.
    pub fn compile(folder: &Path) -> Result<Self, Vec<String>> {
        let files = shader_files(folder).map_err(|e| vec![format!("{}: cannot read: {e}", folder.display())])?;
        let (mut edited, mut faults) = (Self::default(), Vec::new());
        for file in files {
            match compile(folder, &file) {
                Ok(Compiled { words, .. }) => {
                    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    edited.0.insert(name, words.into());
                }
                Err(messages) => faults.extend(messages),
            }
        }
        if faults.is_empty() {
            faults = edited.faults(folder);
        }
        if faults.is_empty() { Ok(edited) } else { Err(faults) }
    }

    /// Files that are not there, and structs that are not as the host has them.
    fn faults(&self, folder: &Path) -> Vec<String> {
        let built: Vec<Layout> =
            shaders::ALL.iter().flat_map(|(_, words)| spirv_layout::read(words).unwrap_or_default()).collect();
        let of_shader = |name: &str| -> Result<(), String> {
            let words = self.0.get(name).ok_or("is not there")?;
            let layouts = spirv_layout::read(words)?;
            let changed = layouts
                .iter()
                .find(|layout| built.iter().any(|built| built.name == layout.name && !built.agrees_with(layout)));
            changed.map_or(Ok(()), |layout| Err(format!("the host has another `{}`: build again", layout.name)))
        };
        let faults = shaders::ALL.iter().filter_map(|(name, _)| Some((name, of_shader(name).err()?)));
        faults.map(|(name, fault)| format!("{}: {fault}", folder.join(name).display())).collect()
    }

    /// Has pipelines use them from now on; those that they used before.
    #[must_use]
    pub fn take_over(self) -> Self {
        std::mem::replace(&mut *PRESENT.write().unwrap_or_else(PoisonError::into_inner), self)
    }
}

/// What is used in place of a shader that was built in.
pub(super) fn in_place_of(built: &[u32]) -> Option<Arc<[u32]>> {
    let (name, _) = shaders::ALL.iter().find(|(_, words)| std::ptr::eq(*words, built))?;
    PRESENT.read().unwrap_or_else(PoisonError::into_inner).0.get(*name).cloned()
}
