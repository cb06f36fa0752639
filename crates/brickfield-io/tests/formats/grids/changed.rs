//! Thousands of damaged files: bytes that are replaced, left out or doubled. What is read or refused must not panic.

use super::examples;

/// The generator of Marsaglia 2003, "Xorshift RNGs": the same numbers in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

const BYTES: [u8; 8] = [0, 1, b'0', b'9', b'-', b' ', 0x7f, 0xff];

fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..1 + random.below(4) {
        // Headers come first: half of the changes are there.
        let most = if random.below(2) == 0 { out.len() } else { out.len().min(160) };
        let at = random.below(most);
        match random.below(8) {
            0 => out.truncate(at),
            1 => drop(out.drain(at..out.len().min(at + 1 + random.below(20)))),
            2 => {
                let piece = out[at..out.len().min(at + 1 + random.below(20))].to_vec();
                out.splice(at..at, piece);
            }
            3 if at < out.len() => out[at] ^= 1 << random.below(8),
            _ if at < out.len() => out[at] = BYTES[random.below(BYTES.len())],
            _ => {}
        }
    }
    out
}

/// No reader may take more than the limit of the fixtures, 1 MiB: a vector that is allocated from a header would show as a
/// failure of the allocator, or as a test that never ends.
#[test]
fn damaged_files_are_refused_or_read() {
    for example in examples() {
        let mut random = Random(0x2545_f491_4f6c_dd1d);
        for _ in 0..4000 {
            let bytes = damaged(&example.bytes, &mut random);
            match (example.read)(&bytes) {
                Ok(opened) => assert!(opened.grids.iter().map(|grid| grid.n()).sum::<u64>() < 1 << 20),
                Err(fault) => {
                    let said = fault.to_string();
                    assert!(!said.contains(['\n', '\r']) && !said.contains("panicked"), "{}: {said}", example.name);
                }
            }
        }
    }
}

/// Every byte of a header, replaced by others.
#[test]
fn every_byte_of_a_header_is_replaced() {
    for example in examples() {
        let mut bytes = example.bytes.clone();
        for at in 0..bytes.len().min(2200) {
            for other in BYTES {
                bytes[at] = other;
                if let Err(fault) = (example.read)(&bytes) {
                    let said = fault.to_string();
                    assert!(!said.contains(['\n', '\r']) && !said.contains("panicked"), "{}: {said}", example.name);
                }
            }
            bytes[at] = example.bytes[at];
        }
    }
}
