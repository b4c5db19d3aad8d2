//! The watched variables (`--watch`): finds the variables of a list of names and patterns.

use std::borrow::Cow;

use wildmatch::WildMatch;

use plcc_runtime::{Event, NameError, Names, Purpose, VariableKey};

/// Watched variables, each with the name under which the trace shows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Watch {
    names: Vec<(String, VariableKey)>,
    /// Whether traces, dumps and events have the names that people gave.
    shows_aliases: bool,
}

impl Watch {
    /// Finds the variables of lists `NAME,NAME…`. A name with `*` (any characters) or `?` (one
    /// character) is a pattern: it stands for the variables of a dump whose names it matches, in
    /// natural sort order and whatever the case of letters, without those that stand in the list before it. A name that
    /// people gave ([`Names::given`]) stands for its variable.
    ///
    /// # Errors
    /// Every name that nothing has, and every pattern that matches nothing.
    pub fn parse(lists: &[impl AsRef<str>], program: &dyn Names) -> Result<Self, Vec<NameError>> {
        let mut names: Vec<(String, VariableKey)> = vec![];
        let mut errors = vec![];
        for name in lists.iter().flat_map(|list| split(list.as_ref())) {
            if name.is_empty() {
                let reason = "is empty: a name is missing between commas".into();
                errors.push(NameError::Unfit { name: String::new(), reason });
                continue;
            }
            if name.contains(['*', '?']) {
                let pattern = WildMatch::new_case_insensitive(name);
                let mut matching = program.matching(|name| pattern.matches(name));
                if matching.is_empty() {
                    let reason = "matches no variable that the program declares or names".into();
                    errors.push(NameError::Unfit { name: name.into(), reason });
                }
                matching.retain(|(_, found)| names.iter().all(|(_, known)| known != found));
                names.extend(matching);
                continue;
            }
            match program.find(name, Purpose::Watch) {
                Ok(variable) => names.push((program.spelled(name).into_owned(), variable)),
                Err(error) => errors.push(error),
            }
        }
        if errors.is_empty() { Ok(Self { names, shows_aliases: false }) } else { Err(errors) }
    }

    /// Has traces and dumps of these variables show the names that people gave.
    pub fn with_aliases(self, shows_aliases: bool) -> Self {
        Self { shows_aliases, ..self }
    }

    /// How a trace, a dump or an event shows the variable with a canonical or a watched name.
    pub fn shown(&self, name: &str, names: &dyn Names) -> String {
        let said = self.shows_aliases.then(|| names.given().said_of(name)).flatten();
        let alias = said.map(|said| said.alias.clone()).filter(|alias| !alias.is_empty());
        alias.unwrap_or_else(|| name.to_owned())
    }

    /// How the events show one, with the name of its variable as [`shown`](Self::shown).
    pub fn shown_event<'e>(&self, event: &'e Event, names: &dyn Names) -> Cow<'e, Event> {
        match self.shows_aliases {
            true => Cow::Owned(event.clone().renamed(|name| Some(self.shown(name, names)))),
            false => Cow::Borrowed(event),
        }
    }

    /// Adds the variables of another list behind these, but for those that are there already.
    pub fn append(&mut self, other: Self) {
        let names = &mut self.names;
        for (name, variable) in other.names {
            if names.iter().all(|(_, known)| *known != variable) {
                names.push((name, variable));
            }
        }
    }

    /// The variables, in their order.
    pub fn variables(&self) -> impl Iterator<Item = VariableKey> + '_ {
        self.names.iter().map(|&(_, variable)| variable)
    }

    /// The names with their variables, in their order.
    pub fn names(&self) -> &[(String, VariableKey)] {
        &self.names
    }

    /// Goes on with another program, in which the variables have these keys, in the same order. The former keys are in
    /// `keys` afterwards.
    pub fn exchange_keys(&mut self, keys: &mut [VariableKey]) {
        let own = self.names.iter_mut().map(|(_, own)| own);
        own.zip(keys).for_each(|(own, new)| std::mem::swap(own, new));
    }

    /// Whether nothing is watched.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
}

/// The names of a list. Commas inside brackets separate nothing, nor do those in front of the bits of a word of memory, as in
/// `Y:$FFC2,8`.
fn split(list: &str) -> impl Iterator<Item = &str> {
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let mut rest = Some(list);
    std::iter::from_fn(move || {
        let text = rest?;
        let (mut depth, mut is_word) = (0u32, false);
        let end = text.char_indices().find(|&(at, c)| {
            match c {
                '[' => depth += 1,
                ']' => depth = depth.saturating_sub(1),
                ':' => is_word = true,
                _ => {}
            }
            let next = text.get(at + 1..).unwrap_or("").split(',').next().unwrap_or("").trim();
            c == ',' && depth == 0 && !(is_word && is_number(next))
        });
        let Some((at, _)) = end else {
            rest = None;
            return Some(text);
        };
        rest = text.get(at + 1..);
        text.get(..at)
    })
    .map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn names_are_split_at_commas() {
        let names: Vec<&str> = split("A[3], X:$0700,&2Q5 ,B[1,2],").collect();
        assert_eq!(names, ["A[3]", "X:$0700", "&2Q5", "B[1,2]", ""]);
        let names: Vec<&str> = split("Y:$FFC2,8,P1,X:0, 4,4 ,PORT1.0,7").collect();
        assert_eq!(names, ["Y:$FFC2,8", "P1", "X:0, 4,4", "PORT1.0", "7"]);
    }
}
