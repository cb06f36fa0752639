//! The headers of elements: tag, value representation and length (PS3.5, 7.1).

use super::tags::{Tag, kept_vr};

/// How elements are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    ExplicitLittle,
    ExplicitBig,
    Implicit,
}

/// One element's header.
pub(super) struct ElementHeader {
    pub(super) tag: Tag,
    pub(super) length: u32,
    pub(super) vr: [u8; 2],
}

pub(super) const UNDEFINED: u32 = u32::MAX;
pub(super) const ITEM: Tag = (0xfffe, 0xe000);

fn short(syntax: Syntax, bytes: [u8; 2]) -> u16 {
    match syntax {
        Syntax::ExplicitBig => u16::from_be_bytes(bytes),
        _ => u16::from_le_bytes(bytes),
    }
}

fn long(syntax: Syntax, bytes: [u8; 4]) -> u32 {
    match syntax {
        Syntax::ExplicitBig => u32::from_be_bytes(bytes),
        _ => u32::from_le_bytes(bytes),
    }
}

/// The header in 8 bytes, if it has no more.
pub(super) fn short_header(header: &[u8], syntax: Syntax) -> Option<ElementHeader> {
    let &[a, b, c, d, e, f, g, h] = header else { return None };
    let tag = (short(syntax, [a, b]), short(syntax, [c, d]));
    if tag.0 == ITEM.0 {
        return Some(ElementHeader { tag, length: long(syntax, [e, f, g, h]), vr: *b"UN" });
    }
    if syntax == Syntax::Implicit {
        let vr = kept_vr(tag).unwrap_or(*b"UN");
        return Some(ElementHeader { tag, length: long(syntax, [e, f, g, h]), vr });
    }
    let length = u32::from(short(syntax, [g, h]));
    has_short_form([e, f]).then_some(ElementHeader { tag, length, vr: [e, f] })
}

pub(super) fn long_header(bytes: &[u8; 12], syntax: Syntax) -> ElementHeader {
    let [a, b, c, d, e, f, _, _, length @ ..] = *bytes;
    let tag = (short(syntax, [a, b]), short(syntax, [c, d]));
    let vr = if is_known([e, f]) { [e, f] } else { *b"UN" };
    ElementHeader { tag, length: long(syntax, length), vr }
}

const SHORT_VRS: &[u8] = b"AE AS AT CS DA DS DT FL FD IS LO LT PN SH SL SS ST TM UI UL US ";
const LONG_VRS: &[u8] = b"OB OD OF OL OV OW SQ SV UC UN UR UT UV ";

/// Value representations whose length has 16 bits (PS3.5, 7.1.2). Unknown ones have the long form.
pub(super) fn has_short_form(vr: [u8; 2]) -> bool {
    SHORT_VRS.chunks(3).any(|known| known[..2] == vr)
}

pub(super) fn is_known(vr: [u8; 2]) -> bool {
    has_short_form(vr) || LONG_VRS.chunks(3).any(|known| known[..2] == vr)
}

/// Bytes of one number of a value representation; 1 for text.
pub(super) fn word_bytes(vr: [u8; 2]) -> usize {
    match &vr {
        b"OW" | b"SS" | b"US" | b"AT" => 2,
        b"FL" | b"OF" | b"OL" | b"SL" | b"UL" => 4,
        b"FD" | b"OD" | b"OV" | b"SV" | b"UV" => 8,
        _ => 1,
    }
}

pub(super) fn reverse_words(bytes: &mut [u8], word_bytes: usize) {
    if word_bytes > 1 {
        bytes.chunks_exact_mut(word_bytes).for_each(<[u8]>::reverse);
    }
}
