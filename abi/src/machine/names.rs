//! What the machine file says of the names of variables.
//!
//! ```toml
//! [names]                   # each key is optional
//! I012 = { alias = "DOOR", text = "door closed", device = "-S12", at = "X11:7", drawing = "14.3" }
//! ```

use alloc::{
    borrow::ToOwned,
    collections::{BTreeMap, btree_map},
    format,
    string::String,
    vec::Vec,
};

use serde::Deserialize;
use toml::Spanned;

use crate::{GivenName, given_name::is_alias};

/// An entry of `[names]`. Which variables there are, only the program says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MachineName {
    /// The line at which it begins in the machine file, from 1.
    pub line: usize,
    /// The variable as it is written, and what is said of it.
    pub given: GivenName,
}

#[derive(Deserialize)]
struct File {
    #[serde(default)]
    names: BTreeMap<Spanned<String>, Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
#[derive(Default)]
struct Entry {
    alias: Option<Spanned<String>>,
    text: String,
    device: String,
    at: String,
    drawing: String,
}

/// Reads the table.
///
/// # Errors
/// A value that is not a text, a key that nothing knows, an alias of another form, or one that is there twice; the message
/// names the line.
pub(super) fn read(text: &str) -> Result<Vec<MachineName>, String> {
    let file: File = toml::from_str(text).map_err(|error| format!("{error}"))?;
    let line = |at: usize| text.get(..at).unwrap_or("").matches('\n').count() + 1;
    let mut aliases: BTreeMap<String, usize> = BTreeMap::new();
    let mut names = Vec::with_capacity(file.names.len());
    for (name, Entry { alias, text, device, at, drawing }) in file.names {
        let own_line = line(name.span().start);
        let mut given = GivenName {
            name: name.into_inner(),
            text,
            device,
            at,
            drawing,
            ..GivenName::default()
        };
        if let Some(alias) = alias {
            let (at, alias) = (line(alias.span().start), alias.into_inner());
            if !is_alias(&alias) {
                return Err(format!(
                    "line {at}: `{alias}` is not an alias: a letter or _ begins one, and letters, digits and _ follow"
                ));
            }
            match aliases.entry(alias.to_ascii_uppercase()) {
                btree_map::Entry::Vacant(entry) => drop(entry.insert(at)),
                btree_map::Entry::Occupied(entry) => {
                    let (first, second) = (at.min(*entry.get()), at.max(*entry.get()));
                    return Err(format!(
                        "line {second}: the alias {alias} is there twice, first in line {first}"
                    ));
                }
            }
            given.alias = alias.to_owned();
        }
        names.push(MachineName { line: own_line, given });
    }
    names.sort_by_key(|name| name.line);
    Ok(names)
}

#[cfg(test)]
mod tests {
    use alloc::{string::ToString, vec::Vec};

    use super::super::Machine;

    #[test]
    fn names_have_their_lines() {
        let text = "boards = 1\n[names]\n\"Y:$FFC2\" = { text = \"lamps\" }\n\
                    I012 = { alias = \"DOOR\", device = \"-S12\", at = \"X11:7\", drawing = \"14.3\" }\n";
        let names = Machine::parse(text).unwrap().names;
        let shown: Vec<_> = names
            .iter()
            .map(|name| (name.line, name.given.name.as_str(), name.given.summary()))
            .collect();
        let expected = [
            (3, "Y:$FFC2", "lamps".to_string()),
            (4, "I012", "-S12, at X11:7, drawing 14.3".to_string()),
        ];
        assert_eq!(shown, expected);
        assert_eq!(names[1].given.alias, "DOOR");
    }

    #[test]
    fn a_wrong_name_is_refused_with_its_line() {
        for (text, part) in [
            ("[names]\nI012 = { alias = \"2D\" }\n", "line 2: `2D` is not an alias"),
            ("[names]\nI012 = { alias = \"\" }\n", "line 2: `` is not an alias"),
            (
                "[names]\nI013 = { alias = \"DOOR\" }\n\nI012 = { alias = \"door\" }\n",
                "line 4: the alias",
            ),
            ("[names]\nI012 = { alais = \"D\" }\n", "unknown field `alais`"),
            ("[names]\nI012 = { drawing = 14.3 }\n", "line 2"),
            ("names = 1\n", "line 1"),
        ] {
            let error = Machine::parse(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
