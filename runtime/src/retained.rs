//! Data that survives power-off, as a control gives it, and what became of it when a control took it back.

use std::fmt::Write;

use serde::Serialize;

/// How many names a message lists at most.
const MAX_NAMES: usize = 20;

/// What a control has taken of the retained data, and what not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Restored {
    /// Whether another program had left the data, so that the rest is worth telling.
    pub other_program: bool,
    /// How many values were taken.
    pub kept: usize,
    /// The names of what was retained and has no place in this program, or another type there.
    pub gone: Vec<String>,
    /// The names of what this program retains and the data does not hold, or what this program's text
    /// sets to another value than the other program's did.
    pub new: Vec<String>,
}

impl Restored {
    /// Whether all of the data was taken, and there was data for everything.
    pub fn is_complete(&self) -> bool {
        self.gone.is_empty() && self.new.is_empty()
    }

    /// What was taken and what not, as the rest of a sentence: `12 values are kept; 1 is gone: M5`.
    pub fn summary(&self) -> String {
        let mut text = match self.kept {
            1 => "1 value is kept".to_owned(),
            kept => format!("{kept} values are kept"),
        };
        for (names, what) in [(&self.gone, "gone"), (&self.new, "new")] {
            let verb = if names.len() == 1 { "is" } else { "are" };
            // Writing to memory does not fail.
            let _ = write!(text, "; {} {verb} {what}", names.len());
            if !names.is_empty() {
                let listed: Vec<&str> = names.iter().take(MAX_NAMES).map(String::as_str).collect();
                let _ = write!(text, ": {}", listed.join(", "));
            }
            if names.len() > MAX_NAMES {
                let _ = write!(text, " and {} more", names.len() - MAX_NAMES);
            }
        }
        text
    }
}

/// Appends a value to a buffer, by postcard, and says whether that was possible; the buffer is empty
/// otherwise.
pub(crate) fn append_postcard(out: &mut Vec<u8>, value: &impl Serialize) -> bool {
    let written = postcard::to_extend(value, std::mem::take(out));
    let possible = written.is_ok();
    *out = written.unwrap_or_default();
    possible
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_counts_all_and_names_some() {
        let names = |count| (0..count).map(|number| format!("P{number}")).collect();
        let mut restored = Restored { other_program: true, kept: 1, gone: names(1), new: vec![] };
        assert_eq!(restored.summary(), "1 value is kept; 1 is gone: P0; 0 are new");
        restored.new = names(1000);
        let text = restored.summary();
        assert!(text.ends_with("P18, P19 and 980 more"), "{text}");
    }
}
