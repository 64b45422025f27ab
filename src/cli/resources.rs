//! CPU time and memory of this process, as the system reports them.

use crate::numeric::clock::process_cpu_seconds;

/// What the process has used. `None` where the system does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Used {
    /// CPU seconds of all threads, user and system.
    pub(super) cpu_s: Option<f64>,
    /// Greatest resident memory, bytes.
    pub(super) peak_bytes: Option<u64>,
}

/// What the process has used so far.
pub(super) fn used() -> Used {
    let status = std::fs::read_to_string("/proc/self/status").ok();
    Used {
        cpu_s: process_cpu_seconds(),
        peak_bytes: status.as_deref().and_then(peak_bytes),
    }
}

fn peak_bytes(status: &str) -> Option<u64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peak_memory_is_read_in_bytes() {
        assert_eq!(
            peak_bytes("VmPeak:\t 9 kB\nVmHWM:\t    12 kB\n"),
            Some(12 * 1024)
        );
    }
}
