//! The crate table of ARCHITECTURE.md.

use std::collections::BTreeSet;

/// The packages that the table lists: the last name in backticks of each row's first cell.
pub(crate) fn crates_in_table(text: &str) -> BTreeSet<String> {
    let rows = text.lines().skip_while(|l| !l.starts_with("| crate |")).skip(2).take_while(|l| l.starts_with('|'));
    rows.filter_map(|row| row.split('|').nth(1)?.split('`').rev().nth(1).map(str::to_owned)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read() {
        let text = "# T\n\n| crate | owns |\n|---|---|\n| `a-core` | `Volume` |\n| `tests/` (`a-tests`) | b |\n\n| `no` | c |\n";
        assert_eq!(crates_in_table(text), BTreeSet::from(["a-core".to_owned(), "a-tests".to_owned()]));
    }
}
