//! Main memory, where the system tells it.

/// Bytes that a new process may take without swapping (Linux: `MemAvailable`).
pub(super) fn available() -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// The most bytes that this process held so far (Linux: `VmHWM`).
pub(super) fn peak() -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Bytes as people read them.
pub(super) fn gigabytes(n_bytes: u64) -> String {
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
        assert_eq!(gigabytes(1_340_000_000), "1.3 GB");
    }
}
