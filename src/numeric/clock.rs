//! CPU clocks: time that other programs on the machine do not stretch.

/// Measures the CPU time of the calling thread, or where the system has no such clock (anything but Unix) the time on the wall.
#[derive(Clone, Copy, Debug)]
pub struct ThreadClock {
    #[cfg(not(unix))]
    wall: std::time::Instant,
    #[cfg(unix)]
    cpu: f64,
}

impl ThreadClock {
    /// Starts now.
    pub fn start() -> Self {
        Self {
            #[cfg(not(unix))]
            wall: std::time::Instant::now(),
            #[cfg(unix)]
            cpu: seconds_of(rustix::time::ClockId::ThreadCPUTime),
        }
    }

    /// Seconds since the start; must be asked on the thread that started it.
    pub fn seconds(&self) -> f64 {
        #[cfg(unix)]
        return seconds_of(rustix::time::ClockId::ThreadCPUTime) - self.cpu;
        #[cfg(not(unix))]
        return self.wall.elapsed().as_secs_f64();
    }
}

/// Measures the CPU time of the process, all threads, or where the system has no such clock the time on the wall.
#[derive(Clone, Copy, Debug)]
pub struct ProcessClock {
    wall: std::time::Instant,
    cpu: Option<f64>,
}

impl ProcessClock {
    /// Starts now.
    pub fn start() -> Self {
        Self {
            wall: std::time::Instant::now(),
            cpu: process_cpu_seconds(),
        }
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        match (self.cpu, process_cpu_seconds()) {
            (Some(start), Some(now)) => now - start,
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }
}

/// CPU seconds of the process, all threads; `None` where the system has no such clock.
pub fn process_cpu_seconds() -> Option<f64> {
    #[cfg(unix)]
    return Some(seconds_of(rustix::time::ClockId::ProcessCPUTime));
    #[cfg(not(unix))]
    return None;
}

#[cfg(unix)]
fn seconds_of(clock: rustix::time::ClockId) -> f64 {
    let time = rustix::time::clock_gettime(clock);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_cpu_time_and_sleep_does_not() {
        let clock = ThreadClock::start();
        std::thread::sleep(std::time::Duration::from_millis(20));
        let asleep = clock.seconds();
        let mut x = 1_u64;
        for i in 0..3_000_000_u64 {
            x = std::hint::black_box(x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(i));
        }
        assert!(clock.seconds() > asleep, "{x}");
        #[cfg(unix)]
        assert!(asleep < 0.015, "{asleep} s of CPU while asleep");
    }
}
