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

/// The numbers that a list of names in natural order leaves out, if the names differ in one number only: how many, and the
/// index of the name before the first. The least step is the one that is expected.
pub(super) fn missing_numbers(names: &[&str]) -> Option<(u64, usize)> {
    let numbers = counting_numbers(names)?;
    let steps: Vec<u64> = numbers.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    let least = steps.iter().copied().min().filter(|least| *least > 0)?;
    let missing = |step: u64| (step - 1) / least;
    let first = steps.iter().position(|step| missing(*step) > 0)?;
    Some((steps.into_iter().map(missing).fold(0, u64::saturating_add), first))
}

/// The one number in which the names differ.
fn counting_numbers(names: &[&str]) -> Option<Vec<u64>> {
    let pieces: Vec<Vec<Piece>> = names.iter().map(|name| Pieces(name).collect()).collect();
    let first = pieces.first()?;
    let differs = |at: usize| pieces.iter().any(|other| other[at] != first[at]);
    if pieces.iter().any(|other| other.len() != first.len()) {
        return None;
    }
    let mut differing = (0..first.len()).filter(|at| differs(*at));
    let (at, None) = (differing.next()?, differing.next()) else { return None };
    let number = |pieces: &Vec<Piece>| match pieces[at] {
        Piece::Number(0, _) => Some(0),
        Piece::Number(_, digits) => digits.parse().ok(),
        Piece::Character(_) => None,
    };
    pieces.iter().map(number).collect()
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

    #[test]
    fn numbers_that_are_left_out_are_counted() {
        let missing = |names: &[&str]| missing_numbers(names);
        assert_eq!(missing(&["s0.png", "s1.png", "s4.png", "s5.png", "s7.png"]), Some((3, 1)));
        assert_eq!(missing(&["2020 s08", "2020 s10", "2020 s14"]), Some((1, 1)));
        for whole in [
            &["1.tif", "2.tif", "3.tif"][..],
            &["010", "020", "030"],
            // Nothing to compare with, no numbers, two that count, the same number twice.
            &["1.tif", "9.tif"],
            &["1.tif"],
            &[],
            &["a", "b", "d"],
            &["t1 z1", "t1 z2", "t2 z4"],
            &["1a", "1b", "3a"],
            &["1.tif", "01.tif", "3.tif"],
            &["1", "99999999999999999999999"],
        ] {
            assert_eq!(missing(whole), None, "{whole:?}");
        }
    }
}
