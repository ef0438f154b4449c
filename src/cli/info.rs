//! `penombre info`: the Vulkan devices of this machine.

use super::args::InfoArgs;
use super::{Outcome, output};
use crate::error::{Error, Result};
use crate::pass::UpdateMode;
use crate::vk::report::{DeviceReport, devices};

/// Runs the command.
///
/// # Errors
/// [`Error::NoDevice`] without a loader, a driver or a usable device.
pub fn run(args: &InfoArgs) -> Result<Outcome> {
    let reports = devices()?;
    if args.json {
        let text = serde_json::to_string_pretty(&reports).map_err(|e| Error::Internal(e.to_string()))?;
        output::print(&(text + "\n"))?;
    } else {
        output::print(&reports.iter().map(describe).collect::<String>())?;
    }
    if reports.iter().any(|r| r.missing.is_empty()) {
        return Ok(Outcome::Done);
    }
    Err(Error::NoDevice("no device has everything that Penombre needs (see `missing` above)".to_owned()))
}

/// A device in a few lines.
fn describe(report: &DeviceReport) -> String {
    let DeviceReport { index, name, kind, driver, api_version, memory_mib, formats, .. } = report;
    let missing = if report.missing.is_empty() { "nothing".to_owned() } else { report.missing.join(", ") };
    let lacking: Vec<&str> =
        UpdateMode::ALL.iter().filter(|mode| mode.check(report).is_err()).map(|m| m.name()).collect();
    let modes = if lacking.is_empty() { "all".to_owned() } else { format!("all but {}", lacking.join(", ")) };
    let queries = if report.precise_queries { "exact" } else { "not exact, only the engine counts pixels" };
    let depth = formats.depth_stencil.as_deref().unwrap_or("none");
    format!(
        "{index}: {name} ({kind})\n   driver   {driver}, Vulkan {api_version}\n   memory   {memory_mib} MiB\n   \
         missing  {missing}\n   formats  depth and stencil {depth}, ids {}, colour and luminance {}\n   queries  {queries}\n   updates  {modes}\n",
        formats.id, formats.colour
    )
}
