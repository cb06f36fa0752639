//! The memory of this process.

use std::fs;

/// Bytes of this process that lie in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ProcessMemory {
    /// Now.
    pub(crate) resident: u64,
    /// At the most, since the last [`restart`].
    pub(crate) peak: u64,
}

impl ProcessMemory {
    /// As Linux counts them; `None` on other systems.
    pub(crate) fn now() -> Option<ProcessMemory> {
        ProcessMemory::of_status(&fs::read_to_string("/proc/self/status").ok()?)
    }

    fn of_status(status: &str) -> Option<ProcessMemory> {
        let kib = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.split_whitespace().next()?.parse::<u64>().ok()
        };
        Some(ProcessMemory { resident: kib("VmRSS:")? << 10, peak: kib("VmHWM:")? << 10 })
    }
}

/// Counts the peak anew, where the system can.
pub(crate) fn restart() {
    // Refused, the peak is that of the whole process: never too little.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn status_is_read_in_kib() {
        let status = "Name:\tx\nVmHWM:\t    2048 kB\nVmRSS:\t    1024 kB\n";
        assert_eq!(ProcessMemory::of_status(status), Some(ProcessMemory { resident: 1 << 20, peak: 2 << 20 }));
        assert_eq!(ProcessMemory::of_status("Name:\tx\n"), None);
    }
}
