//! Runs of literal and of repeated bytes: PackBits (TIFF 6.0, section 9), which is DICOM's RLE, too (PS3.5, annex G).

/// Writes unpacked bytes to their places, until all places are filled or the packed bytes end; how many places are left.
pub(crate) fn unpack_runs<'a>(
    mut packed: &[u8],
    places: &mut (impl ExactSizeIterator<Item = &'a mut u8> + 'a),
) -> usize {
    while places.len() > 0
        && let [head, rest @ ..] = packed
    {
        let n = usize::from(*head);
        packed = match *head {
            0..=127 => {
                let literal = &rest[..rest.len().min(n + 1)];
                literal.iter().zip(places.by_ref()).for_each(|(byte, place)| *place = *byte);
                rest.get(n + 1..).unwrap_or_default()
            }
            128 => rest,
            129..=255 => {
                let [byte, rest @ ..] = rest else { break };
                places.by_ref().take(257 - n).for_each(|place| *place = *byte);
                rest
            }
        };
    }
    places.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpacked(packed: &[u8], n: usize) -> Vec<u8> {
        let mut bytes = vec![0; n];
        let n_left = unpack_runs(packed, &mut bytes.iter_mut());
        bytes.truncate(n - n_left);
        bytes
    }

    #[test]
    fn runs_end_with_the_places_or_with_the_bytes() {
        // Three literal bytes, nothing, three times 9.
        let packed = [2, 5, 6, 7, 128, 254, 9];
        assert_eq!(unpacked(&packed, 6), [5, 6, 7, 9, 9, 9]);
        assert_eq!(unpacked(&packed, 2), [5, 6]);
        assert_eq!(unpacked(&packed, 5), [5, 6, 7, 9, 9]);
        assert_eq!(unpacked(&packed, 8), [5, 6, 7, 9, 9, 9]);
        assert_eq!(unpacked(&packed[..3], 8), [5, 6]);
        assert_eq!(unpacked(&packed[..6], 8), [5, 6, 7]);
    }
}
