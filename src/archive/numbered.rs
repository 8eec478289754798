//! Names of numbered files, such as `scan_0086400.dpx`.

use std::fmt;

/// Names with a number in them, `scan_%07d.dpx` as C writes them.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct NumberedName {
    before: String,
    /// Digits of a number at least.
    digits: usize,
    after: String,
}

impl NumberedName {
    /// Reads a pattern, such as `scan_%07d.dpx` or `%d.tif`; `None` where it has no number, or two.
    pub fn parse(pattern: &str) -> Option<Self> {
        let (before, rest) = pattern.split_once('%')?;
        let (digits, after) = rest.split_once('d')?;
        let width = digits.strip_prefix('0').unwrap_or("1");
        // `%5d` fills up with spaces, which names do not have.
        let plain = digits.is_empty() || digits.starts_with('0');
        (plain && !after.contains('%')).then_some(())?;
        Some(Self {
            before: before.to_owned(),
            digits: width
                .parse()
                .ok()
                .filter(|digits| (1..=18).contains(digits))?,
            after: after.to_owned(),
        })
    }

    /// The pattern of a name and its number, the last one before the extension. Leading zeros
    /// are part of the number.
    pub fn of_file(name: &str) -> Option<(Self, u64)> {
        let stem = &name[..name.rfind('.').unwrap_or(name.len())];
        let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
        let begin = stem[..end].rfind(|c: char| !c.is_ascii_digit());
        let begin = begin.map_or(0, |at| {
            at + stem[at..].chars().next().map_or(1, char::len_utf8)
        });
        let number = &name[begin..end];
        let padded = number.starts_with('0') && number.len() > 1;
        let pattern = Self {
            before: name[..begin].to_owned(),
            digits: if padded { number.len() } else { 1 },
            after: name[end..].to_owned(),
        };
        Some((pattern, number.parse().ok()?))
    }

    /// The number of a name that follows the pattern.
    pub fn number(&self, name: &str) -> Option<u64> {
        let digits = name.strip_prefix(&self.before)?.strip_suffix(&self.after)?;
        let number = digits.parse().ok()?;
        (self.name(number) == name).then_some(number)
    }

    /// The name with a number.
    pub fn name(&self, number: u64) -> String {
        let (before, width, after) = (&self.before, self.digits, &self.after);
        format!("{before}{number:0width$}{after}")
    }

    /// The same with another extension.
    pub fn with_extension(&self, extension: &str) -> Self {
        let stem = self
            .after
            .rfind('.')
            .map_or(&*self.after, |dot| &self.after[..dot]);
        Self {
            after: format!("{stem}.{extension}"),
            ..self.clone()
        }
    }

    /// The extension in lower case; empty where there is none.
    pub fn extension(&self) -> String {
        let dot = self
            .after
            .rfind('.')
            .map_or(self.after.len(), |dot| dot + 1);
        self.after[dot..].to_ascii_lowercase()
    }
}

impl fmt::Display for NumberedName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.digits {
            1 => write!(f, "{}%d{}", self.before, self.after),
            digits => write!(f, "{}%0{digits}d{}", self.before, self.after),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_patterns() {
        for (file, pattern, number) in [
            ("scan_0086400.dpx", "scan_%07d.dpx", 86_400),
            ("reel2.000001.EXR", "reel2.%06d.EXR", 1),
            ("12.tif", "%d.tif", 12),
            ("é9", "é%d", 9),
        ] {
            let (name, found) = NumberedName::of_file(file).expect(file);
            assert_eq!((name.to_string(), found), (pattern.to_owned(), number));
            assert_eq!(NumberedName::parse(pattern), Some(name.clone()));
            assert_eq!(name.number(file), Some(number));
            assert_eq!(name.name(number), file);
        }
        let name = NumberedName::parse("a%04d_v2.dpx").expect("a pattern");
        assert_eq!(name.number("a0007_v2.dpx"), Some(7));
        assert_eq!(
            (name.number("a7_v2.dpx"), name.number("a0007.dpx")),
            (None, None)
        );
        assert_eq!(name.with_extension("tif").name(7), "a0007_v2.tif");
        for wrong in ["a.dpx", "%s.dpx", "%04d_%d.dpx", "%5d.dpx", "%099d"] {
            assert_eq!(NumberedName::parse(wrong), None, "{wrong}");
        }
        assert_eq!(NumberedName::of_file("notes.txt"), None);
    }
}
