//! What each Vulkan device is, what it lacks, and which formats it would use: `penombre info`.

use super::calibration::Extension;
use super::error;
use super::instance::Instance;
use crate::error::{Error, Result};
use ash::{ext, vk};
use serde::Serialize;
use std::ffi::{CStr, c_char};

/// Face ids.
pub const ID_FORMAT: vk::Format = vk::Format::R32_UINT;
/// k_d, k_s, L_e, D and S: of two such images a pixel has 128 bits, as in [FP03 §4.3].
pub const COLOUR_FORMAT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// The displayed picture; the shader encodes sRGB itself.
pub const DISPLAY_FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;
/// The combined linear picture.
pub const LINEAR_FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
/// Depth formats with stencil, best first.
const DEPTH_FORMATS: [vk::Format; 3] =
    [vk::Format::D32_SFLOAT_S8_UINT, vk::Format::D24_UNORM_S8_UINT, vk::Format::D16_UNORM_S8_UINT];

/// The formats a device uses, as the Vulkan names without prefix.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Formats {
    /// Depth and stencil; `None` if the device has none that can be rendered to.
    pub depth_stencil: Option<String>,
    /// Face ids.
    pub id: String,
    /// k_d, k_s, L_e, D, S.
    pub colour: String,
    /// The displayed picture.
    pub display: String,
    /// The combined linear picture.
    pub linear: String,
}

/// One Vulkan device of this machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DeviceReport {
    /// What `--device INDEX` takes.
    pub index: usize,
    /// Name, what `--device NAME` takes a part of.
    pub name: String,
    /// discrete, integrated, virtual, cpu or other.
    pub kind: &'static str,
    /// Driver and its version.
    pub driver: String,
    /// Vulkan version of the device.
    pub api_version: String,
    /// Device-local memory, MiB.
    pub memory_mib: u64,
    /// Largest single allocation, MiB.
    pub max_allocation_mib: u64,
    /// Largest width and height of a picture, pixels.
    pub max_image_side: u32,
    /// Whether occlusion queries count exactly; without, only the engine counts pixels.
    pub precise_queries: bool,
    /// What only some options need, where the device has it.
    pub optional: Optional,
    /// What penombre needs and the device lacks; empty for a usable one.
    pub missing: Vec<String>,
    /// Formats it would use.
    pub formats: Formats,
}

impl DeviceReport {
    /// Whether it is a software rasteriser, which takes its time from the program's own threads.
    #[must_use]
    pub fn is_cpu(&self) -> bool {
        self.kind == "cpu"
    }
}

/// What only some options need, by the names that Vulkan gives it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Optional {
    /// The extension VK_EXT_shader_stencil_export.
    pub stencil_export: bool,
    /// The feature fragmentStoresAndAtomics.
    pub fragment_atomics: bool,
    /// The feature independentBlend.
    pub independent_blend: bool,
    /// Bits of a pixel to which vertices are snapped: subPixelPrecisionBits.
    pub sub_pixel_bits: u32,
    /// Depth formats that can be rendered to.
    pub depth_formats: Vec<String>,
}

/// A physical device with its report and what device creation needs to know.
pub(super) struct Candidate {
    pub(super) raw: vk::PhysicalDevice,
    pub(super) report: DeviceReport,
    /// The family with graphics, and transfer with it.
    pub(super) queue_family: Option<u32>,
    /// Depth and stencil format.
    pub(super) depth_stencil: Option<vk::Format>,
    /// Nanoseconds a timestamp tick; `None` if the queue has no timestamps.
    pub(super) timestamp_period_ns: Option<f32>,
    /// The extension that compares the device's clock with the host's.
    pub(super) calibration: Option<Extension>,
    /// Largest single allocation, bytes.
    pub(super) max_allocation: u64,
    /// Texels that a view of a buffer may have.
    pub(super) max_texels: u32,
    /// 0 for the best kind.
    pub(super) rank: u32,
}

/// Every Vulkan device, in the loader's order.
///
/// # Errors
/// [`Error::NoDevice`] without a loader or a driver.
pub fn devices() -> Result<Vec<DeviceReport>> {
    let instance = Instance::new(false, None)?;
    Ok(candidates(&instance)?.into_iter().map(|c| c.report).collect())
}

pub(super) fn candidates(instance: &Instance) -> Result<Vec<Candidate>> {
    // SAFETY: a plain query of the instance.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }.map_err(|e| match e {
        vk::Result::ERROR_INITIALIZATION_FAILED => no_device(),
        other => error(other, "listing Vulkan devices"),
    })?;
    if devices.is_empty() {
        return Err(no_device());
    }
    Ok(devices.iter().enumerate().map(|(index, &raw)| inspect(instance, index, raw)).collect())
}

fn no_device() -> Error {
    Error::NoDevice(
        "no Vulkan device found; `apt install mesa-vulkan-drivers` on Debian or Ubuntu brings a software one"
            .to_owned(),
    )
}

fn inspect(instance: &Instance, index: usize, raw: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut limits = vk::PhysicalDeviceMaintenance3Properties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut limits);
    // SAFETY: plain queries of a physical device of this instance; a 1.0 driver leaves unknown structs untouched.
    let (families, memory) = unsafe {
        instance.raw.get_physical_device_properties2(raw, &mut properties);
        (
            instance.raw.get_physical_device_queue_family_properties(raw),
            instance.raw.get_physical_device_memory_properties(raw),
        )
    };
    let basic = properties.properties;
    let (kind, rank) = match basic.device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => ("discrete", 0),
        vk::PhysicalDeviceType::INTEGRATED_GPU => ("integrated", 1),
        vk::PhysicalDeviceType::VIRTUAL_GPU => ("virtual", 2),
        vk::PhysicalDeviceType::CPU => ("cpu", 3),
        _ => ("other", 4),
    };
    let family = families.iter().position(|f| f.queue_flags.contains(vk::QueueFlags::GRAPHICS));
    let has_timestamps = family.is_some_and(|f| families[f].timestamp_valid_bits > 0);
    let depth_stencil = DEPTH_FORMATS
        .into_iter()
        .find(|&f| supports(instance, raw, f, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT));
    let heaps = &memory.memory_heaps[..memory.memory_heap_count as usize];
    let local: u64 = heaps.iter().filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL)).map(|h| h.size).sum();
    // 1 GiB is what Vulkan guarantees where the driver says nothing.
    let max_allocation =
        if limits.max_memory_allocation_size == 0 { 1 << 30 } else { limits.max_memory_allocation_size };
    // SAFETY: a plain query of a physical device of this instance.
    let features = unsafe { instance.raw.get_physical_device_features(raw) };
    let report = DeviceReport {
        index,
        name: text(&basic.device_name),
        kind,
        driver: format!("{} {}", text(&driver.driver_name), text(&driver.driver_info)).trim().to_owned(),
        api_version: version(basic.api_version),
        memory_mib: local >> 20,
        max_allocation_mib: max_allocation >> 20,
        max_image_side: max_image_side(&basic.limits),
        precise_queries: features.occlusion_query_precise == vk::TRUE,
        optional: optional(instance, raw, &features, &basic.limits),
        missing: missing(instance, raw, basic.api_version, family.is_some(), depth_stencil.is_some()),
        formats: formats(depth_stencil),
    };
    Candidate {
        raw,
        report,
        queue_family: family.map(|f| f as u32),
        depth_stencil,
        timestamp_period_ns: has_timestamps.then_some(basic.limits.timestamp_period),
        calibration: Extension::of(instance, raw),
        max_allocation,
        max_texels: basic.limits.max_texel_buffer_elements,
        rank,
    }
}

fn optional(
    instance: &Instance,
    raw: vk::PhysicalDevice,
    features: &vk::PhysicalDeviceFeatures,
    limits: &vk::PhysicalDeviceLimits,
) -> Optional {
    // SAFETY: a plain query of a physical device of this instance.
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(raw) }.unwrap_or_default();
    let depth = [vk::Format::D16_UNORM].into_iter().chain(DEPTH_FORMATS);
    let works = |f: &vk::Format| supports(instance, raw, *f, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT);
    Optional {
        stencil_export: extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(ext::shader_stencil_export::NAME)),
        fragment_atomics: features.fragment_stores_and_atomics == vk::TRUE,
        independent_blend: features.independent_blend == vk::TRUE,
        sub_pixel_bits: limits.sub_pixel_precision_bits,
        depth_formats: depth.filter(works).map(|f| format!("{f:?}")).collect(),
    }
}

fn max_image_side(limits: &vk::PhysicalDeviceLimits) -> u32 {
    let viewport = limits.max_viewport_dimensions;
    let framebuffer = limits.max_framebuffer_width.min(limits.max_framebuffer_height);
    limits.max_image_dimension2_d.min(framebuffer).min(viewport[0]).min(viewport[1])
}

fn formats(depth_stencil: Option<vk::Format>) -> Formats {
    let name = |f: vk::Format| format!("{f:?}");
    Formats {
        depth_stencil: depth_stencil.map(name),
        id: name(ID_FORMAT),
        colour: name(COLOUR_FORMAT),
        display: name(DISPLAY_FORMAT),
        linear: name(LINEAR_FORMAT),
    }
}

/// Everything that penombre needs and the device has not, in words.
fn missing(
    instance: &Instance,
    raw: vk::PhysicalDevice,
    api_version: u32,
    has_graphics: bool,
    has_depth_stencil: bool,
) -> Vec<String> {
    let mut missing = Vec::new();
    let mut need = |there: bool, what: &str| {
        if !there {
            missing.push(what.to_owned());
        }
    };
    need(api_version >= vk::API_VERSION_1_3, "Vulkan 1.3");
    need(has_graphics, "a graphics queue");
    need(has_depth_stencil, "a depth format with stencil (D32S8, D24S8 or D16S8)");
    if api_version >= vk::API_VERSION_1_3 {
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
        // SAFETY: a plain query; both structs are core in 1.3.
        unsafe { instance.raw.get_physical_device_features2(raw, &mut features) };
        need(v12.buffer_device_address == vk::TRUE, "the feature bufferDeviceAddress");
        need(v12.scalar_block_layout == vk::TRUE, "the feature scalarBlockLayout");
        need(v13.dynamic_rendering == vk::TRUE, "the feature dynamicRendering");
        need(v13.synchronization2 == vk::TRUE, "the feature synchronization2");
        let demotes = v13.shader_demote_to_helper_invocation == vk::TRUE;
        need(demotes, "the feature shaderDemoteToHelperInvocation");
    }
    for format in [ID_FORMAT, COLOUR_FORMAT, DISPLAY_FORMAT, LINEAR_FORMAT] {
        let flags = vk::FormatFeatureFlags::COLOR_ATTACHMENT | vk::FormatFeatureFlags::SAMPLED_IMAGE;
        need(supports(instance, raw, format, flags), &format!("rendering to {format:?} images"));
    }
    missing
}

fn supports(instance: &Instance, raw: vk::PhysicalDevice, format: vk::Format, flags: vk::FormatFeatureFlags) -> bool {
    // SAFETY: a plain query of a physical device of this instance.
    let properties = unsafe { instance.raw.get_physical_device_format_properties(raw, format) };
    properties.optimal_tiling_features.contains(flags)
}

fn text(chars: &[c_char]) -> String {
    let bytes: &[u8] = bytemuck::cast_slice(chars);
    CStr::from_bytes_until_nul(bytes).map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

fn version(v: u32) -> String {
    format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v))
}
