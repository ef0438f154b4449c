//! The Vulkan loader, the instance, and the validation layer's messages.

use super::error;
use super::window_handles::WindowHandles;
use crate::error::{Error, Result};
use ash::{ext, khr, vk};
use std::borrow::Cow;
use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::{Arc, Mutex, PoisonError};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What the validation layer said, in order.
#[derive(Debug, Default)]
pub struct Messages(Mutex<Vec<String>>);

impl Messages {
    /// A copy of all messages so far.
    #[must_use]
    pub fn all(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn push(&self, message: String) {
        eprintln!("vulkan: {message}");
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}

/// The loaded Vulkan library and an instance of it.
pub struct Instance {
    pub(super) raw: ash::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Messages of the validation layer; the messenger points at it.
    pub(super) messages: Arc<Messages>,
    /// Whether objects can be named and passes labelled.
    pub(super) has_debug_utils: bool,
    /// Keeps the shared library loaded.
    pub(super) entry: ash::Entry,
}

impl Instance {
    /// Loads Vulkan and creates an instance, with core and synchronisation validation if `validation` is set and the
    /// layer is installed; one that can show pictures in a window if there is one.
    ///
    /// # Errors
    /// [`Error::NoDevice`] without a loader or a driver, or if these cannot draw to such a window.
    pub fn new(validation: bool, window: Option<&dyn WindowHandles>) -> Result<Arc<Self>> {
        // SAFETY: the loader's initialisation routines have no requirements of their own.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| {
            Error::NoDevice(format!(
                "the Vulkan loader is missing ({e}); install it: `apt install libvulkan1 mesa-vulkan-drivers` on Debian or Ubuntu"
            ))
        })?;
        let validation = validation && has_layer(&entry, VALIDATION_LAYER);
        let available = instance_extensions(&entry);
        let has_debug_utils = available.iter().any(|e| e == ext::debug_utils::NAME);
        let portability = available.iter().any(|e| e == khr::portability_enumeration::NAME);
        let for_window = window.map_or(Ok(&[][..]), |window| window_extensions(window, &available))?;
        let raw = create_instance(&entry, validation, [has_debug_utils, portability], for_window)?;
        let messages = Arc::new(Messages::default());
        let mut instance = Self { raw, messenger: None, messages, has_debug_utils, entry };
        if validation && has_debug_utils {
            instance.listen()?;
        }
        Ok(Arc::new(instance))
    }

    /// Whether the validation layer is on.
    #[must_use]
    pub const fn validates(&self) -> bool {
        self.messenger.is_some()
    }

    fn listen(&mut self) -> Result<()> {
        use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(Severity::WARNING | Severity::ERROR)
            .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(&self.messages).cast_mut().cast());
        let loader = ext::debug_utils::Instance::new(&self.entry, &self.raw);
        // SAFETY: the user data outlives the messenger, which `drop` destroys first; `Messages` is `Sync`.
        let messenger = unsafe { loader.create_debug_utils_messenger(&info, None) }
            .map_err(|e| error(e, "creating the debug messenger"))?;
        self.messenger = Some((loader, messenger));
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: devices hold an `Arc` of this instance, so none is left.
        unsafe {
            if let Some((loader, messenger)) = self.messenger.take() {
                loader.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn has_layer(entry: &ash::Entry, name: &CStr) -> bool {
    // SAFETY: a plain query of the loader.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
    layers.iter().any(|l| l.layer_name_as_c_str() == Ok(name))
}

fn instance_extensions(entry: &ash::Entry) -> Vec<CString> {
    // SAFETY: a plain query of the loader.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }.unwrap_or_default();
    extensions.iter().filter_map(|e| e.extension_name_as_c_str().ok().map(CStr::to_owned)).collect()
}

/// The extensions that drawing to a window takes.
fn window_extensions(window: &dyn WindowHandles, available: &[CString]) -> Result<&'static [*const c_char]> {
    let display = window.display_handle().map_err(|e| Error::NoWindow(format!("the window has no display: {e}")))?;
    let needed = ash_window::enumerate_required_extensions(display.as_raw())
        .map_err(|e| Error::NoWindow(format!("Vulkan cannot draw to this kind of window: {e}")))?;
    for &name in needed {
        // SAFETY: the names are string constants.
        let name = unsafe { CStr::from_ptr(name) };
        if !available.iter().any(|there| there.as_c_str() == name) {
            let name = name.to_string_lossy();
            return Err(Error::NoDevice(format!(
                "the Vulkan driver cannot draw to this kind of window: it lacks {name}"
            )));
        }
    }
    Ok(needed)
}

fn create_instance(
    entry: &ash::Entry,
    validation: bool,
    [has_debug_utils, portability]: [bool; 2],
    for_window: &[*const c_char],
) -> Result<ash::Instance> {
    let application = vk::ApplicationInfo::default()
        .application_name(c"penombre")
        .engine_name(c"penombre")
        .api_version(vk::API_VERSION_1_3);
    let mut extensions: Vec<*const c_char> = for_window.to_vec();
    let mut layers: Vec<*const c_char> = Vec::new();
    let mut flags = vk::InstanceCreateFlags::empty();
    if has_debug_utils {
        extensions.push(ext::debug_utils::NAME.as_ptr());
    }
    if portability {
        // MoltenVK and other layered drivers are only listed on demand.
        extensions.push(khr::portability_enumeration::NAME.as_ptr());
        flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    }
    if validation {
        layers.push(VALIDATION_LAYER.as_ptr());
        extensions.push(ext::validation_features::NAME.as_ptr());
    }
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut info = vk::InstanceCreateInfo::default()
        .flags(flags)
        .application_info(&application)
        .enabled_extension_names(&extensions)
        .enabled_layer_names(&layers);
    if validation {
        info = info.push_next(&mut features);
    }
    // SAFETY: everything `info` points to lives in this function.
    unsafe { entry.create_instance(&info, None) }.map_err(|e| match e {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => Error::NoDevice(
            "no Vulkan driver is installed, or none that loads; `apt install mesa-vulkan-drivers` on Debian or Ubuntu brings \
             a software one, VK_LOADER_DEBUG=error says what is wrong with one that is there"
                .to_owned(),
        ),
        other => error(other, "creating the Vulkan instance"),
    })
}

/// Whether a message says nothing about correctness: advice on speed that does not hold for us, and the loader's
/// remarks on other drivers.
fn is_noise(kinds: vk::DebugUtilsMessageTypeFlagsEXT, id: &str, text: &str) -> bool {
    let advice =
        kinds.contains(vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE) && text.contains("For optimal performance");
    advice || id == "Loader Message"
}

unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    kinds: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    if data.is_null() || user.is_null() {
        return vk::FALSE;
    }
    // SAFETY: Vulkan passes a valid struct for the duration of the call, `user` is the instance's `Messages`, and the
    // strings are null or NUL-terminated.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Messages>()) };
    let text = |p: *const c_char| -> Cow<'_, str> {
        // SAFETY: as above.
        if p.is_null() { Cow::Borrowed("") } else { unsafe { CStr::from_ptr(p) }.to_string_lossy() }
    };
    let (id, message) = (text(data.p_message_id_name), text(data.p_message));
    if !is_noise(kinds, &id, &message) {
        messages.push(format!("{id}: {message}"));
    }
    vk::FALSE
}
