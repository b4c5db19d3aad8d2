//! The lints: warnings with a name, each of which can be allowed, asked for or made an error.
//!
//! A lint tells of something that a program is allowed to do and that is seldom meant. Its name is
//! the same in all languages that have it; its code belongs to one language, and so does its page in
//! [`find_code`](crate::find_code).

/// What is done about the findings of a lint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Level {
    /// They are not shown.
    Allow,
    /// They are warnings.
    Warn,
    /// They are errors: the program is refused.
    Deny,
}

impl Level {
    /// The level of a word in the machine file: `allow`, `warn` or `deny`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "allow" => Some(Self::Allow),
            "warn" => Some(Self::Warn),
            "deny" => Some(Self::Deny),
            _ => None,
        }
    }
}

/// A lint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lint {
    /// Its name, as in `-A near-name`.
    pub name: &'static str,
    /// The codes of its diagnostics, one for each language that has it.
    pub codes: &'static [&'static str],
    /// What is done about its findings if nobody says anything.
    pub default: Level,
}

/// A lint that is on unless it is allowed.
const fn warn(name: &'static str, codes: &'static [&'static str]) -> Lint {
    Lint { name, codes, default: Level::Warn }
}

/// A lint that is off unless it is asked for, since it would find much in the manuals' examples and in
/// real programs that is meant so: they declare a timer that they no longer use, write a lamp from two
/// modules, define their M-variables in another file, or send a command in every scan.
const fn allow(name: &'static str, codes: &'static [&'static str]) -> Lint {
    Lint { name, codes, default: Level::Allow }
}

/// All lints.
pub static LINTS: &[Lint] = &[
    warn("near-name", &["PMI-W5"]),
    warn("unassigned-output", &["PMI-W6"]),
    warn("output-assigned-twice", &["PMI-W7"]),
    warn("code-never-reset", &["PMI-W8"]),
    allow("control-never-assigned", &["PMI-W9"]),
    warn("value-out-of-range", &["PMI-W10", "PMAC-W9"]),
    warn("constant-condition", &["PMI-W11", "NCT-W7", "PMAC-W10"]),
    warn("unreachable", &["PMI-W12", "NCT-W8", "PMAC-W11"]),
    warn("number-in-logical", &["PMI-W13"]),
    warn("delayed-contact-never-read", &["PMI-W14"]),
    warn("input-never-read", &["PMI-W15"]),
    warn("falls-through", &["NCT-W9"]),
    warn("strobe-without-fin", &["NCT-W10"]),
    warn("timer-never-started", &["NCT-W11"]),
    allow("written-in-two-modules", &["NCT-W6"]),
    warn("read-never-written", &["NCT-W5"]),
    warn("message-without-text", &["NCT-W12"]),
    warn("text-never-used", &["NCT-W13"]),
    warn("lost-z", &["NCT-W14"]),
    allow("undefined-m-variable", &["PMAC-W12"]),
    warn("assigned-undefined", &["PMAC-W22"]),
    warn("input-assigned", &["PMAC-W23"]),
    allow("repeats-every-scan", &["PMAC-W13"]),
    warn("shared-timer", &["PMAC-W14"]),
    warn("plc-never-runs", &["PMAC-W15"]),
    warn("plc-never-enabled", &["PMAC-W24"]),
    warn("empty-command", &["PMAC-W16"]),
    warn("position-beyond-display", &["PMAC-W17"]),
    warn("endless-wait", &["PMAC-W18"]),
    warn("same-bit-twice", &["PMAC-W20"]),
    warn("motor-not-activated", &["PMAC-W25"]),
];

/// The lint with a name, in any case of letters; `None` if there is none.
pub fn find_lint(name: &str) -> Option<&'static Lint> {
    LINTS.iter().find(|lint| lint.name.eq_ignore_ascii_case(name))
}

/// The lint to which a diagnostic's code belongs; `None` if the code is not a lint's.
pub fn lint_of_code(code: &str) -> Option<&'static Lint> {
    LINTS.iter().find(|lint| lint.codes.contains(&code))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::{LINTS, find_lint, lint_of_code};
    use crate::find_code;

    #[test]
    fn each_lint_has_a_name_of_its_own_and_pages() {
        let mut seen = HashSet::new();
        for lint in LINTS {
            assert!(seen.insert(lint.name), "{} is there twice", lint.name);
            assert_eq!(find_lint(&lint.name.to_uppercase()), Some(lint));
            for code in lint.codes {
                assert!(seen.insert(code), "{code} is there twice");
                assert!(find_code(code).is_some(), "{code} has no page");
                assert_eq!(lint_of_code(code), Some(lint));
            }
        }
    }
}
