use std::collections::BTreeMap;

/// Entries as name, line end, length (4 bytes, little-endian), content; the last one may be cut short.
pub fn entries(mut bytes: &[u8]) -> BTreeMap<String, Vec<u8>> {
    let mut entries = BTreeMap::new();
    while let Some(end) = bytes.iter().position(|b| *b == b'\n') {
        let name = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let Some((length, rest)) = bytes[end + 1..].split_first_chunk::<4>() else { break };
        let n = (u32::from_le_bytes(*length) as usize).min(rest.len());
        entries.insert(name, rest[..n].to_vec());
        bytes = &rest[n..];
    }
    entries
}
