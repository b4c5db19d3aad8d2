//! Names and descriptions that people gave to variables: in the table `[names]` of the machine file, by a PMAC's `#define`, and in
//! comments of the source.

use alloc::{
    borrow::ToOwned,
    format,
    string::{String, ToString},
    vec::Vec,
};

use serde::{Deserialize, Serialize};

use crate::printable;

/// What people call a variable, and what they say of it. What nobody has said is empty.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GivenName {
    /// The variable, in the language's canonical spelling.
    pub name: String,
    /// Another name for it, which [`is_alias`] allows.
    pub alias: String,
    /// What it is, in a few words.
    pub text: String,
    /// The device that is wired to it, as the drawings of the machine call it: `-S12`.
    pub device: String,
    /// The terminal: `X11:7`.
    pub at: String,
    /// Where in the drawings it is: `14.3`.
    pub drawing: String,
}

impl GivenName {
    /// Text, device, terminal and place in the drawings in one line; empty where nothing is said.
    pub fn summary(&self) -> String {
        let said = |what: &str, value: &String| match value.is_empty() {
            true => None,
            false => Some(format!("{what}{}", printable(value))),
        };
        let parts = [
            said("", &self.text),
            said("", &self.device),
            said("at ", &self.at),
            said("drawing ", &self.drawing),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// The alias and the [`summary`](Self::summary) in one line; empty where nothing is said.
    pub fn line(&self) -> String {
        match (self.alias.as_str(), self.summary()) {
            (alias, said) if said.is_empty() => alias.into(),
            ("", said) => said,
            (alias, said) => format!("{alias}: {said}"),
        }
    }

    /// What is said, without what is not, with its keys in the machine file.
    pub fn parts(&self) -> impl Iterator<Item = (&'static str, &str)> {
        let parts = [
            ("alias", self.alias.as_str()),
            ("text", &self.text),
            ("device", &self.device),
            ("at", &self.at),
            ("drawing", &self.drawing),
        ];
        parts.into_iter().filter(|(_, value)| !value.is_empty())
    }

    /// Takes over what `other` says and this one does not.
    pub fn complete(&mut self, other: &Self) {
        let fill = |own: &mut String, other: &String| {
            if own.is_empty() {
                other.clone_into(own);
            }
        };
        fill(&mut self.alias, &other.alias);
        fill(&mut self.text, &other.text);
        fill(&mut self.device, &other.device);
        fill(&mut self.at, &other.at);
        fill(&mut self.drawing, &other.drawing);
    }
}

/// Whether a text has the form of an alias: a letter or `_`, then letters, digits and `_`, all of them ASCII.
pub fn is_alias(text: &str) -> bool {
    let is_first = |c: char| c.is_ascii_alphabetic() || c == '_';
    text.starts_with(is_first) && text.chars().all(|c| is_first(c) || c.is_ascii_digit())
}

/// Splits a name into the part that may be an alias and what follows it: `[3]` of an element, `#COUNT` of a timer.
pub fn alias_and_rest(name: &str) -> (String, &str) {
    let name = name.trim();
    let at = name.find(['[', '#']).unwrap_or(name.len());
    let (alias, rest) = name.split_at(at);
    (alias.trim_end().to_string(), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alias_is_a_word() {
        for text in ["DOOR", "_d2", "a"] {
            assert!(is_alias(text), "{text}");
        }
        for text in ["", "2D", "A B", "Tür", "@A", "A.1", "A-B"] {
            assert!(!is_alias(text), "{text}");
        }
    }

    #[test]
    fn a_summary_has_what_is_said() {
        let mut name = GivenName { text: "door closed".into(), ..GivenName::default() };
        assert_eq!(name.summary(), "door closed");
        let other = GivenName {
            text: "other".into(),
            device: "-S12".into(),
            at: "X11:7".into(),
            drawing: "14.3".into(),
            ..GivenName::default()
        };
        name.complete(&other);
        assert_eq!(name.summary(), "door closed, -S12, at X11:7, drawing 14.3");
        assert_eq!(name.line(), name.summary());
        name.alias = "DOOR".into();
        assert_eq!(name.line(), "DOOR: door closed, -S12, at X11:7, drawing 14.3");
        assert_eq!(GivenName::default().line(), "");
    }
}
