//! The order of numbered names.

use std::cmp::Ordering;

/// Compares names as people count them: runs of digits by their number, other characters without regard to case. Names
/// that are alike so are compared as they are.
pub(super) fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (Pieces(a), Pieces(b));
    loop {
        match (left.next(), right.next()) {
            (None, None) => return a.cmp(b),
            (l, r) if l == r => {}
            (l, r) => return l.cmp(&r),
        }
    }
}

/// Pieces of a name; the end comes before a number, and a number before a character.
struct Pieces<'a>(&'a str);

#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Piece<'a> {
    /// The number of its digits without zeros in front, then the digits.
    Number(usize, &'a str),
    Character(char),
}

impl<'a> Iterator for Pieces<'a> {
    type Item = Piece<'a>;

    fn next(&mut self) -> Option<Piece<'a>> {
        let first = self.0.chars().next()?;
        if !first.is_ascii_digit() {
            self.0 = &self.0[first.len_utf8()..];
            return Some(Piece::Character(first.to_lowercase().next().unwrap_or(first)));
        }
        let n_digits = self.0.bytes().take_while(u8::is_ascii_digit).count();
        let (digits, rest) = self.0.split_at(n_digits);
        self.0 = rest;
        let digits = digits.trim_start_matches('0');
        Some(Piece::Number(digits.len(), digits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_comes_before_ten() {
        let sorted =
            ["a", "A1", "a02", "a2", "a2b", "A10", "a010x", "a99999999999999999999", "b1", "\u{e9}2", "\u{e9}10"];
        let mut names = sorted;
        names.reverse();
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, sorted);
        assert_eq!(natural_order("", ""), Ordering::Equal);
        assert_eq!(natural_order("slice2.tif", "Slice10.TIF"), Ordering::Less);
    }
}
