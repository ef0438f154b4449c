//! The device's clock beside the host's: `VK_KHR_calibrated_timestamps`, or `VK_EXT_calibrated_timestamps`, which is the same.

use super::instance::Instance;
use ash::{ext, khr, vk};
use std::ffi::CStr;

/// An extension that compares clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extension {
    Khr,
    Ext,
}

impl Extension {
    /// What a device has, if it compares its clock with the one that [`crate::trace::now`] reads.
    pub(super) fn of(instance: &Instance, device: vk::PhysicalDevice) -> Option<Self> {
        // SAFETY: a plain query of a physical device of this instance.
        let available = unsafe { instance.raw.enumerate_device_extension_properties(device) }.unwrap_or_default();
        let has = |name: &CStr| available.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let found = [Self::Khr, Self::Ext].into_iter().find(|extension| has(extension.name()))?;
        let domains = found.domains(instance, device);
        let compares = domains.contains(&DEVICE) && domains.contains(&HOST);
        (cfg!(unix) && compares).then_some(found)
    }

    pub(super) const fn name(self) -> &'static CStr {
        match self {
            Self::Khr => khr::calibrated_timestamps::NAME,
            Self::Ext => ext::calibrated_timestamps::NAME,
        }
    }

    fn domains(self, instance: &Instance, device: vk::PhysicalDevice) -> Vec<vk::TimeDomainKHR> {
        let (entry, raw) = (&instance.entry, &instance.raw);
        // SAFETY: the device has the extension, whose functions of a physical device need no more.
        let domains = unsafe {
            match self {
                Self::Khr => khr::calibrated_timestamps::Instance::new(entry, raw)
                    .get_physical_device_calibrateable_time_domains(device),
                Self::Ext => ext::calibrated_timestamps::Instance::new(entry, raw)
                    .get_physical_device_calibrateable_time_domains(device),
            }
        };
        domains.unwrap_or_default()
    }
}

const DEVICE: vk::TimeDomainKHR = vk::TimeDomainKHR::DEVICE;
const HOST: vk::TimeDomainKHR = vk::TimeDomainKHR::CLOCK_MONOTONIC;

/// Reads both clocks of a device.
pub(super) struct Calibration {
    read: vk::PFN_vkGetCalibratedTimestampsKHR,
    how: &'static str,
}

/// A moment by both clocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// By the device's.
    pub ticks: u64,
    /// By [`crate::trace::now`].
    pub nanoseconds: u64,
    /// How they were compared, for a trace to say.
    pub how: &'static str,
}

impl Calibration {
    /// Of a device that was opened with the extension.
    pub(super) fn new(instance: &Instance, device: &ash::Device, extension: Extension) -> Self {
        match extension {
            Extension::Khr => {
                let functions = khr::calibrated_timestamps::Device::new(&instance.raw, device);
                let read = functions.fp().get_calibrated_timestamps_khr;
                Self { read, how: "passes (clocks compared by VK_KHR_calibrated_timestamps)" }
            }
            Extension::Ext => {
                let functions = ext::calibrated_timestamps::Device::new(&instance.raw, device);
                let read = functions.fp().get_calibrated_timestamps_ext;
                Self { read, how: "passes (clocks compared by VK_EXT_calibrated_timestamps)" }
            }
        }
    }

    /// Now by both clocks; `None` if the device does not tell.
    pub(super) fn now(&self, device: &ash::Device) -> Option<Moment> {
        let infos = [DEVICE, HOST].map(|domain| vk::CalibratedTimestampInfoKHR::default().time_domain(domain));
        let (mut times, mut deviation) = ([0; 2], 0);
        // SAFETY: the function is this device's; both arrays have as many elements as it is told.
        let result = unsafe {
            (self.read)(device.handle(), infos.len() as u32, infos.as_ptr(), times.as_mut_ptr(), &raw mut deviation)
        };
        let [ticks, nanoseconds] = times;
        (result == vk::Result::SUCCESS).then_some(Moment { ticks, nanoseconds, how: self.how })
    }
}

impl Moment {
    /// When the device's clock showed so many ticks, of so many nanoseconds each, nanoseconds by [`crate::trace::now`].
    pub(super) fn host_time(&self, ticks: u64, period_ns: f32) -> u64 {
        let since = ticks.wrapping_sub(self.ticks).cast_signed() as f64 * f64::from(period_ns);
        self.nanoseconds.saturating_add_signed(since.round() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_before_and_after_a_moment() {
        let moment = Moment { ticks: 1000, nanoseconds: 50_000, how: "" };
        assert_eq!([990, 1000, 1004].map(|ticks| moment.host_time(ticks, 2.5)), [49_975, 50_000, 50_010]);
    }
}
