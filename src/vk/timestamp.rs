//! Times of passes on the device's own clock.

use super::calibration::Moment;
use super::device::{Device, Tracked};
use super::error;
use crate::error::Result;
use crate::trace;
use ash::vk;

/// Passes a recording can time; later ones go untimed.
const MAX_PASSES: u32 = 32;

/// What a trace says of a clock that cannot be compared with the host's.
const ALIGNED: &str = "passes (each submission placed where it was submitted)";

/// Two timestamps a pass; absent where the queue has none.
pub(super) struct Timestamps {
    pub(super) raw: vk::QueryPool,
    period_ns: f32,
    tracked: Tracked,
}

/// Milliseconds spent in each pass of one submission.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassTimes(Vec<(&'static str, f64)>);

impl PassTimes {
    /// Time of a pass, summed if it ran more than once; `None` if it did not run or the device has no clock.
    #[must_use]
    pub fn ms(&self, pass: &str) -> Option<f64> {
        self.0.iter().filter(|(name, _)| *name == pass).map(|&(_, ms)| ms).reduce(|a, b| a + b)
    }

    /// Adds the passes of another submission.
    pub fn extend(&mut self, other: Self) {
        self.0.extend(other.0);
    }
}

impl Timestamps {
    pub(super) fn new(device: &Device, name: &str) -> Result<Option<Self>> {
        let Some(period_ns) = device.core.timestamp_period_ns else { return Ok(None) };
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2 * MAX_PASSES);
        // SAFETY: see the module's contract.
        let raw = unsafe { device.core.raw.create_query_pool(&info, None) }
            .map_err(|e| error(e, "creating the timestamp pool"))?;
        let tracked = Tracked::new(&device.core, raw, name);
        Ok(Some(Self { raw, period_ns, tracked }))
    }

    pub(super) fn reset(&self, commands: vk::CommandBuffer) {
        // SAFETY: `commands` is being recorded, outside a rendering scope; the pool is idle.
        unsafe { self.tracked.core.raw.cmd_reset_query_pool(commands, self.raw, 0, 2 * MAX_PASSES) };
    }

    /// Writes the first or last timestamp of pass number `pass`.
    pub(super) fn write(&self, commands: vk::CommandBuffer, pass: usize, last: bool) {
        let query = 2 * pass as u32 + u32::from(last);
        if query >= 2 * MAX_PASSES {
            return;
        }
        let stage = if last { vk::PipelineStageFlags2::ALL_COMMANDS } else { vk::PipelineStageFlags2::TOP_OF_PIPE };
        // SAFETY: the query was reset at the start of this recording and is written once.
        unsafe { self.tracked.core.raw.cmd_write_timestamp2(commands, stage, self.raw, query) };
    }

    /// Reads the times of the passes of a submission that has finished; a trace is told them, and when it was `submitted` if the
    /// device's clock cannot be compared with the host's.
    pub(super) fn read(&self, passes: &[&'static str], submitted: u64) -> Result<PassTimes> {
        let passes = &passes[..passes.len().min(MAX_PASSES as usize)];
        let mut ticks = vec![0u64; 2 * passes.len()];
        if ticks.is_empty() {
            return Ok(PassTimes::default());
        }
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: all these queries were written by the finished submission.
        unsafe { self.tracked.core.raw.get_query_pool_results(self.raw, 0, &mut ticks, flags) }
            .map_err(|e| error(e, "reading timestamps"))?;
        if trace::is_on() {
            self.trace(passes, &ticks, submitted);
        }
        let ms = |pair: &[u64]| pair[1].wrapping_sub(pair[0]) as f64 * f64::from(self.period_ns) * 1e-6;
        Ok(PassTimes(passes.iter().copied().zip(ticks.chunks_exact(2).map(ms)).collect()))
    }

    fn trace(&self, passes: &[&'static str], ticks: &[u64], submitted: u64) {
        let core = &self.tracked.core;
        let calibrated = core.calibration.as_ref().and_then(|clock| clock.now(&core.raw));
        let moment = calibrated.unwrap_or(Moment { ticks: ticks[0], nanoseconds: submitted, how: ALIGNED });
        for (&pass, times) in passes.iter().zip(ticks.chunks_exact(2)) {
            let [from, until] = [times[0], times[1]].map(|ticks| moment.host_time(ticks, self.period_ns));
            trace::device_span(moment.how, pass, (from, until));
        }
    }
}

impl Drop for Timestamps {
    fn drop(&mut self) {
        // SAFETY: every recording that used the pool was waited for.
        unsafe { self.tracked.core.raw.destroy_query_pool(self.raw, None) };
    }
}
