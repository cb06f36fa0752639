//! Names of numbered files: the printf patterns of NRRD and MetaImage.

use crate::ReadError;

/// The files of a volume whose data are apart from the header.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum FileNames {
    One(String),
    List(Vec<String>),
    Numbered { pattern: Pattern, first: i64, last: i64, step: i64 },
}

impl FileNames {
    pub(crate) fn n_files(&self) -> u128 {
        match self {
            FileNames::One(_) => 1,
            FileNames::List(names) => names.len() as u128,
            FileNames::Numbered { first, last, step, .. } => {
                let distance = (i128::from(*last) - i128::from(*first)) * i128::from(step.signum());
                if distance < 0 { 0 } else { distance as u128 / u128::from(step.unsigned_abs()) + 1 }
            }
        }
    }

    /// Name of file `i`, which is below [`n_files`](Self::n_files).
    pub(crate) fn name(&self, i: usize) -> String {
        match self {
            FileNames::One(name) => name.clone(),
            FileNames::List(names) => names[i].clone(),
            FileNames::Numbered { pattern, first, step, .. } => {
                pattern.name(first.wrapping_add(step.wrapping_mul(i as i64)))
            }
        }
    }

    /// `pattern first last step`.
    pub(crate) fn numbered(pattern: &str, numbers: [&str; 3]) -> Result<FileNames, ReadError> {
        let parsed = numbers.map(|n| n.parse::<i64>().map_err(|_| ReadError::field("file number", n, "an integer")));
        let [first, last, step] = parsed;
        let (first, last, step) = (first?, last?, step?);
        if step == 0 {
            return Err(ReadError::field("file number step", step, "not 0"));
        }
        Ok(FileNames::Numbered { pattern: Pattern::parse(pattern)?, first, last, step })
    }
}

/// `prefix%03dsuffix`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pattern {
    prefix: String,
    suffix: String,
    width: usize,
    fill: char,
}

impl Pattern {
    pub(crate) fn parse(text: &str) -> Result<Pattern, ReadError> {
        let bad = || ReadError::field("file name pattern", text, "one %d, as in slice%03d.raw");
        let (prefix, rest) = text.split_once('%').ok_or_else(bad)?;
        let end = rest.find(|c: char| !c.is_ascii_digit()).ok_or_else(bad)?;
        let (digits, conversion) = rest.split_at(end);
        let suffix = conversion.strip_prefix(['d', 'i', 'u']).ok_or_else(bad)?;
        let width = if digits.is_empty() { 0 } else { digits.parse().map_err(|_| bad())? };
        if suffix.contains('%') || width > 32 {
            return Err(bad());
        }
        let fill = if digits.starts_with('0') { '0' } else { ' ' };
        Ok(Pattern { prefix: prefix.to_owned(), suffix: suffix.to_owned(), width, fill })
    }

    fn name(&self, number: i64) -> String {
        let Pattern { prefix, suffix, width, fill } = self;
        match fill {
            '0' => format!("{prefix}{number:0width$}{suffix}"),
            _ => format!("{prefix}{number:width$}{suffix}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_filled_in_as_printf_does() {
        let name = |pattern, n| Pattern::parse(pattern).unwrap().name(n);
        assert_eq!(name("quarter.%d", 7), "quarter.7");
        assert_eq!(name("s%03d.raw", 7), "s007.raw");
        assert_eq!(name("s%3d.raw", 7), "s  7.raw");
        assert_eq!(name("s%04i", -7), "s-007");
        for bad in ["plain", "%s", "%", "%3", "%99d", "%d%d", "%99999999999999999999d"] {
            assert!(Pattern::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_are_counted_without_overflow() {
        let n = |first, last, step| FileNames::numbered("%d", [first, last, step]).unwrap().n_files();
        assert_eq!(n("1", "93", "1"), 93);
        assert_eq!(n("10", "1", "-3"), 4);
        assert_eq!(n("2", "1", "1"), 0);
        assert_eq!(n("-9223372036854775808", "9223372036854775807", "1"), 1 << 64);
        assert_eq!(n("0", "9223372036854775807", "-9223372036854775808"), 0);
    }
}
