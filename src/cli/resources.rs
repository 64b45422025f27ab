//! CPU time and memory of this process, as the system reports them.

/// What the process has used. `None` where the system does not say (anything but Linux).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Used {
    /// CPU seconds of all threads, user and system, in steps of 0.01.
    pub(super) cpu_s: Option<f64>,
    /// Greatest resident memory, bytes.
    pub(super) peak_bytes: Option<u64>,
}

/// Ticks per second of /proc: fixed at 100 by the kernel's interface on every common platform.
const TICKS_PER_SECOND: f64 = 100.0;

/// What the process has used so far.
pub(super) fn used() -> Used {
    let stat = std::fs::read_to_string("/proc/self/stat").ok();
    let status = std::fs::read_to_string("/proc/self/status").ok();
    Used {
        cpu_s: stat.as_deref().and_then(cpu_seconds),
        peak_bytes: status.as_deref().and_then(peak_bytes),
    }
}

/// Fields 14 and 15 of /proc/self/stat, counted from behind the command's closing parenthesis (field 2).
fn cpu_seconds(stat: &str) -> Option<f64> {
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / TICKS_PER_SECOND)
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
    fn a_command_name_with_blanks_and_parentheses_does_not_shift_the_fields() {
        let stat = "7 (a b) c) R 1 2 3 4 5 6 7 8 9 10 250 50 0 0 20";
        assert_eq!(cpu_seconds(stat), Some(3.0));
    }

    #[test]
    fn peak_memory_is_read_in_bytes() {
        assert_eq!(
            peak_bytes("VmPeak:\t 9 kB\nVmHWM:\t    12 kB\n"),
            Some(12 * 1024)
        );
    }
}
