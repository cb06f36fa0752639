//! Main memory and processor time, where the system tells them.

/// Bytes that a new process may take without swapping (Linux: `MemAvailable`).
pub(crate) fn available() -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// The bytes that this process holds (Linux: `VmRSS`).
pub(crate) fn resident() -> Option<u64> {
    of_process("VmRSS:")
}

/// The most bytes that this process held since it began, or since [`restart_peak`] (Linux: `VmHWM`).
pub(crate) fn peak() -> Option<u64> {
    of_process("VmHWM:")
}

/// Counts the peak anew. Where the system refuses, the peak is that of the whole process: never too little.
pub(crate) fn restart_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The seconds that all threads of this process have run.
#[cfg(unix)]
pub(crate) fn cpu_seconds() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64)
}

/// The seconds that all threads of this process have run: no safe interface of this system says them.
#[cfg(not(unix))]
pub(crate) fn cpu_seconds() -> Option<f64> {
    None
}

fn of_process(name: &str) -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/self/status").ok()?, name)
}

/// Bytes as people read them.
pub(crate) fn gigabytes(n_bytes: u64) -> String {
    format!("{:.1} GB", n_bytes as f64 * 1e-9)
}

fn kilobytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|l| l.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kilobytes| kilobytes << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_by_their_name() {
        let text = "MemFree:    12 kB\nMemAvailable:   20480 kB\n";
        assert_eq!(kilobytes(text, "MemAvailable:"), Some(20_971_520));
        assert_eq!(kilobytes(text, "VmHWM:"), None);
        let status = "Name:\tx\nVmHWM:\t    2048 kB\nVmRSS:\t    1024 kB\n";
        assert_eq!((kilobytes(status, "VmHWM:"), kilobytes(status, "VmRSS:")), (Some(2 << 20), Some(1 << 20)));
        assert_eq!(gigabytes(1_340_000_000), "1.3 GB");
    }

    /// The clock is finer than a frame, and stands still while nothing runs.
    #[cfg(unix)]
    #[test]
    fn processor_time_is_that_of_work() {
        let begin = cpu_seconds().unwrap();
        let (mut n_read, mut last) = (0, begin);
        while last < begin + 2e-3 {
            let now = cpu_seconds().unwrap();
            assert!(now >= last);
            n_read += usize::from(now > last);
            last = now;
        }
        assert!(n_read > 10, "{n_read} steps in two milliseconds");
    }
}
