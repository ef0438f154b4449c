//! The logical device: choice, creation, names of objects, and what is still alive when it goes.

use super::calibration::Calibration;
use super::error;
use super::instance::Instance;
use super::memory::Memory;
use super::report::{self, Candidate, DeviceReport};
use super::surface::Surface;
use super::window_handles::WindowHandles;
use crate::error::{Error, Result};
use ash::{ext, khr, vk};
use std::collections::BTreeMap;
use std::ffi::{CStr, CString};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// How a device is chosen and watched.
#[derive(Clone, Debug, Default)]
pub struct DeviceOptions {
    /// `--device`: an index, or a part of a name (any case); `None` takes the best.
    pub device: Option<String>,
    /// Validation layers; `None` follows `PENOMBRE_VALIDATION` (0 or 1), else they are on in debug builds.
    pub validation: Option<bool>,
}

impl DeviceOptions {
    fn wants_validation(&self) -> bool {
        let from_environment = || std::env::var("PENOMBRE_VALIDATION").ok().map(|v| v != "0");
        self.validation.or_else(from_environment).unwrap_or(cfg!(debug_assertions))
    }
}

/// A Vulkan device, chosen and ready. Objects made from it keep its core alive; dropping it prints those that
/// should have gone before.
pub struct Device {
    pub(super) core: Arc<DeviceCore>,
    report: DeviceReport,
    depth_stencil: vk::Format,
}

/// What objects share and keep alive: handles, memory, the list of live objects.
pub(super) struct DeviceCore {
    pub(super) raw: ash::Device,
    pub(super) queue: Mutex<vk::Queue>,
    pub(super) queue_family: u32,
    pub(super) timestamp_period_ns: Option<f32>,
    /// Where the device's clock can be compared with the host's.
    pub(super) calibration: Option<Calibration>,
    pub(super) memory: Memory,
    /// Texels that a view of a buffer may have.
    pub(super) max_texels: u32,
    pub(super) debug: Option<ext::debug_utils::Device>,
    live: Mutex<BTreeMap<u64, String>>,
    /// Whether it counts as lost, on purpose.
    lost: AtomicBool,
    pub(super) physical: vk::PhysicalDevice,
    pub(super) instance: Arc<Instance>,
}

impl Device {
    /// Chooses a device (discrete, integrated, virtual, CPU in this order, unless `options` names one) and opens it.
    ///
    /// # Errors
    /// [`Error::NoDevice`] names what to install or which feature is lacking; [`Error::Usage`] an unknown `--device`.
    pub fn new(options: &DeviceOptions) -> Result<Arc<Self>> {
        let instance = Instance::new(options.wants_validation(), None)?;
        let candidates = report::candidates(&instance)?;
        Self::open(instance, choose(candidates, options.device.as_deref())?, false)
    }

    /// As [`Self::new`], a device that can draw to a window, and the surface of it.
    ///
    /// # Errors
    /// As [`Self::new`]; [`Error::NoWindow`] if Vulkan cannot draw to such a window.
    pub fn for_window(options: &DeviceOptions, window: Arc<dyn WindowHandles>) -> Result<(Arc<Self>, Arc<Surface>)> {
        let instance = Instance::new(options.wants_validation(), Some(&*window))?;
        let surface = Surface::new(&instance, window)?;
        let mut candidates = report::candidates(&instance)?;
        for candidate in &mut candidates {
            candidate.report.missing.extend(surface.missing(candidate));
        }
        let device = Self::open(instance, choose(candidates, options.device.as_deref())?, true)?;
        Ok((device, surface))
    }

    fn open(instance: Arc<Instance>, chosen: Candidate, presents: bool) -> Result<Arc<Self>> {
        let (Some(queue_family), Some(depth_stencil)) = (chosen.queue_family, chosen.depth_stencil) else {
            return Err(Error::Internal("a device without queue or depth format was chosen".to_owned()));
        };
        let core = DeviceCore::new(instance, &chosen, queue_family, presents)?;
        Ok(Arc::new(Self { core: Arc::new(core), report: chosen.report, depth_stencil }))
    }

    /// Name, driver, version, formats: for the log and for `info`.
    #[must_use]
    pub const fn report(&self) -> &DeviceReport {
        &self.report
    }

    /// The depth and stencil format found by query.
    #[must_use]
    pub const fn depth_stencil_format(&self) -> vk::Format {
        self.depth_stencil
    }

    /// Whether the validation layer watches this device.
    #[must_use]
    pub fn validates(&self) -> bool {
        self.core.instance.validates()
    }

    /// What the validation layer said so far, known noise left out; empty for a correct program.
    #[must_use]
    pub fn validation_messages(&self) -> Vec<String> {
        self.core.instance.messages.all()
    }

    /// Names of the objects alive.
    #[must_use]
    pub fn live_objects(&self) -> Vec<String> {
        self.core.live().values().cloned().collect()
    }

    /// Has it count as lost from now on, as if its driver had said so: what is submitted to it is refused.
    pub fn lose(&self) {
        self.core.lost.store(true, Ordering::Relaxed);
    }

    /// Bytes of device memory reserved.
    #[must_use]
    pub fn memory_bytes(&self) -> u64 {
        self.core.memory.reserved_bytes()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        for name in self.live_objects() {
            eprintln!("vulkan: `{name}` outlives its device");
        }
    }
}

impl DeviceCore {
    fn new(instance: Arc<Instance>, chosen: &Candidate, queue_family: u32, presents: bool) -> Result<Self> {
        let raw = create_device(&instance, chosen, queue_family, presents)?;
        // SAFETY: one queue of this family was requested.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        let debug = instance.has_debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        let memory = match Memory::new(&instance, &raw, chosen.raw, chosen.max_allocation) {
            Ok(memory) => memory,
            Err(e) => {
                // SAFETY: nothing was made from the device yet.
                unsafe { raw.destroy_device(None) };
                return Err(e);
            }
        };
        let timestamp_period_ns = chosen.timestamp_period_ns;
        let calibration = chosen.calibration.map(|extension| Calibration::new(&instance, &raw, extension));
        let (queue, live) = (Mutex::new(queue), Mutex::default());
        let (physical, max_texels) = (chosen.raw, chosen.max_texels);
        Ok(Self {
            raw,
            queue,
            queue_family,
            timestamp_period_ns,
            calibration,
            memory,
            max_texels,
            debug,
            live,
            lost: AtomicBool::new(false),
            physical,
            instance,
        })
    }

    /// What the device allows images made as `info` says.
    pub(super) fn image_limits(&self, info: &vk::ImageCreateInfo<'_>) -> Result<vk::ImageFormatProperties> {
        // SAFETY: the physical device belongs to the instance, which is alive.
        unsafe {
            self.instance.raw.get_physical_device_image_format_properties(
                self.physical,
                info.format,
                info.image_type,
                info.tiling,
                info.usage,
                info.flags,
            )
        }
        .map_err(|e| error(e, &format!("asking for the limits of {:?} images", info.format)))
    }

    /// Submits to the queue; `doing` as in "submitting a picture".
    ///
    /// # Safety
    /// As for `vkQueueSubmit`.
    pub(super) unsafe fn submit(&self, work: &vk::SubmitInfo<'_>, fence: vk::Fence, doing: &str) -> Result<()> {
        if self.lost.load(Ordering::Relaxed) {
            return Err(error(vk::Result::ERROR_DEVICE_LOST, doing));
        }
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the caller's; the mutex guards the queue.
        unsafe { self.raw.queue_submit(*queue, std::slice::from_ref(work), fence) }.map_err(|e| error(e, doing))
    }

    /// Waits until the queue has nothing to do.
    pub(super) fn wait_idle(&self) -> Result<()> {
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the mutex guards the queue.
        unsafe { self.raw.queue_wait_idle(*queue) }.map_err(|e| error(e, "waiting for the device"))
    }

    fn live(&self) -> MutexGuard<'_, BTreeMap<u64, String>> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives a handle its debug name.
    pub(super) fn set_name(&self, handle: impl vk::Handle, name: &str) {
        let Some(debug) = &self.debug else { return };
        let Ok(name) = CString::new(name) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is alive, its owner names it at creation. A failure only costs the name.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }
}

impl Drop for DeviceCore {
    fn drop(&mut self) {
        self.memory.close();
        // SAFETY: objects hold an `Arc` of this core, so none is left; every submission was waited for.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// The entry of a live object in its device's list; objects hold one and reach the device through it.
pub(super) struct Tracked {
    pub(super) core: Arc<DeviceCore>,
    key: u64,
}

impl Tracked {
    /// Names a new handle and lists it as alive.
    pub(super) fn new<H: vk::Handle + Copy>(core: &Arc<DeviceCore>, handle: H, name: &str) -> Self {
        core.set_name(handle, name);
        let mut live = core.live();
        let key = live.last_key_value().map_or(0, |(k, _)| k + 1);
        live.insert(key, name.to_owned());
        Self { core: Arc::clone(core), key }
    }
}

impl Drop for Tracked {
    fn drop(&mut self) {
        self.core.live().remove(&self.key);
    }
}

fn choose(candidates: Vec<Candidate>, wanted: Option<&str>) -> Result<Candidate> {
    let there_is = list(&candidates);
    let mut candidates = candidates;
    if let Some(wanted) = wanted {
        let matches = |c: &Candidate| match wanted.parse::<usize>() {
            Ok(index) => c.report.index == index,
            Err(_) => c.report.name.to_lowercase().contains(&wanted.to_lowercase()),
        };
        candidates.retain(matches);
        if candidates.is_empty() {
            return Err(Error::Usage(format!("no Vulkan device matches --device {wanted}; {there_is}")));
        }
    }
    let lacks: Vec<String> = candidates
        .iter()
        .filter(|c| !c.report.missing.is_empty())
        .map(|c| format!("{} lacks {}", c.report.name, c.report.missing.join(", ")))
        .collect();
    let usable = candidates.into_iter().filter(|c| c.report.missing.is_empty());
    // The first of the best kind: the loader's order is the system's preference.
    usable.min_by_key(|c| (c.rank, c.report.index)).ok_or_else(|| {
        Error::NoDevice(format!(
            "no usable Vulkan device: {}; `apt install mesa-vulkan-drivers` on Debian or Ubuntu brings a software one",
            lacks.join("; ")
        ))
    })
}

/// The devices by what `--device` takes.
fn list(candidates: &[Candidate]) -> String {
    let verb = if candidates.len() == 1 { "is" } else { "are" };
    let devices: Vec<String> = candidates.iter().map(|c| format!("{} = {}", c.report.index, c.report.name)).collect();
    format!("there {verb}: {}", devices.join(", "))
}

fn create_device(instance: &Instance, chosen: &Candidate, queue_family: u32, presents: bool) -> Result<ash::Device> {
    let physical = chosen.raw;
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&priorities)];
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default().buffer_device_address(true).scalar_block_layout(true);
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true)
        // SPIR-V 1.6 spells `discard` as a demotion.
        .shader_demote_to_helper_invocation(true);
    let optional = &chosen.report.optional;
    let features = vk::PhysicalDeviceFeatures::default()
        .occlusion_query_precise(chosen.report.precise_queries)
        .fragment_stores_and_atomics(optional.fragment_atomics)
        .independent_blend(optional.independent_blend);
    let mut extensions = Vec::new();
    // SAFETY: a plain query.
    let available = unsafe { instance.raw.enumerate_device_extension_properties(physical) }.unwrap_or_default();
    let has = |name: &CStr| available.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    if has(khr::portability_subset::NAME) {
        // Must be enabled where it exists.
        extensions.push(khr::portability_subset::NAME.as_ptr());
    }
    if optional.stencil_export {
        extensions.push(ext::shader_stencil_export::NAME.as_ptr());
    }
    extensions.extend(chosen.calibration.map(|extension| extension.name().as_ptr()));
    if presents {
        extensions.push(khr::swapchain::NAME.as_ptr());
    }
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut v12)
        .push_next(&mut v13);
    // SAFETY: the features were checked by `report`; everything `info` points to lives in this function.
    unsafe { instance.raw.create_device(physical, &info, None) }.map_err(|e| error(e, "opening the Vulkan device"))
}
