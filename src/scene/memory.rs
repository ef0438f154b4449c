//! How much memory there is for what a scene asks for.

use std::path::Path;

/// Bytes of memory that this process can still take without swapping: what the system and the limit of its control group
/// leave. `None` where the system does not say.
pub(super) fn available() -> Option<u64> {
    let free = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| mem_available(&text));
    free.into_iter().chain(left_in_group(Path::new("/sys/fs/cgroup"))).min()
}

fn mem_available(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? << 10)
}

/// What the memory limit of a control group (version 2) leaves; `None` without one.
fn left_in_group(group: &Path) -> Option<u64> {
    let figure = |name: &str| std::fs::read_to_string(group.join(name)).ok()?.trim().parse::<u64>().ok();
    Some(figure("memory.max")?.saturating_sub(figure("memory.current")?))
}

/// A number of bytes as messages have it.
pub(super) fn figure(bytes: u64) -> String {
    const GIB: f64 = (1u64 << 30) as f64;
    const MIB: u64 = 1 << 20;
    if bytes >= 1 << 30 { format!("{:.1} GiB", bytes as f64 / GIB) } else { format!("{} MiB", bytes.div_ceil(MIB)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_read_and_written() {
        let text = "MemTotal:       24689444 kB\nMemFree:  17 kB\nMemAvailable:   23068672 kB\n";
        assert_eq!(mem_available(text).map(figure), Some("22.0 GiB".to_owned()));
        assert_eq!(mem_available("MemTotal: 1 kB\n"), None);
        assert_eq!(figure(1), "1 MiB");
    }

    #[test]
    fn the_limit_of_a_control_group_counts() {
        let group = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(group.path().join(name), text).expect("written");
        assert_eq!(left_in_group(group.path()), None);
        write("memory.current", "1000\n");
        write("memory.max", "max\n");
        assert_eq!(left_in_group(group.path()), None);
        write("memory.max", "4096\n");
        assert_eq!(left_in_group(group.path()), Some(3096));
    }
}
