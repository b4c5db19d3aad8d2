//! The names that people gave to the variables of a program ([`GivenName`]), by variable and by alias.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::LazyLock;

use plcc_abi::GivenName;
use plcc_abi::given_name::alias_and_rest;

/// The names that people gave to the variables of a program.
#[derive(Debug, Default)]
pub struct GivenNames {
    /// What is said of each variable, the first alias that it was given among it; by its canonical name.
    by_name: HashMap<String, GivenName>,
    /// The canonical names of the variables, by their aliases.
    by_alias: HashMap<String, String>,
    /// The same by the aliases in capitals; empty where two have the same.
    by_capitals: HashMap<String, String>,
}

static NONE: LazyLock<GivenNames> = LazyLock::new(GivenNames::default);

impl GivenNames {
    /// Those of a program without any.
    pub(crate) fn none() -> &'static Self {
        &NONE
    }

    /// Those of a checked program, which have canonical names.
    pub fn of_canonical(given: &[GivenName]) -> Self {
        Self::with(given, |name| Some(name.to_owned()))
    }

    /// The names for the variables that `canonical` knows; others are left out.
    pub(crate) fn with(given: &[GivenName], canonical: impl Fn(&str) -> Option<String>) -> Self {
        let mut this = Self::default();
        for given in given {
            let Some(name) = canonical(&given.name) else { continue };
            let is_new = !given.alias.is_empty() && !this.by_alias.contains_key(&given.alias);
            if is_new {
                this.by_alias.insert(given.alias.clone(), name.clone());
                let capitals = given.alias.to_ascii_uppercase();
                let same = this.by_capitals.entry(capitals).or_insert_with(|| name.clone());
                if *same != name {
                    same.clear();
                }
            }
            let said = GivenName { name: name.clone(), ..given.clone() };
            let said = if is_new { said } else { GivenName { alias: String::new(), ..said } };
            this.by_name.entry(name).and_modify(|first| first.complete(&said)).or_insert(said);
        }
        this
    }

    /// The canonical name of the variable with an alias. A difference of small letters and capitals counts only where there
    /// are aliases that differ in nothing else.
    fn of_alias(&self, alias: &str) -> Option<&str> {
        let exact = self.by_alias.get(alias);
        let found = exact.or_else(|| self.by_capitals.get(&alias.to_ascii_uppercase()));
        found.map(String::as_str).filter(|name| !name.is_empty())
    }

    /// Replaces an alias by the name of its variable, also in front of an index or of `#COUNT`. `None` for other texts.
    pub fn replaced(&self, text: &str) -> Option<String> {
        if self.by_alias.is_empty() {
            return None;
        }
        let (alias, rest) = alias_and_rest(text);
        Some(format!("{}{rest}", self.of_alias(&alias)?))
    }

    /// Replaces the aliases in an expression by the names of their variables. What stands in quotes, and words that belong to
    /// a name or a number of the language, as after `@`, stay what they are.
    pub fn in_expression<'t>(&self, text: &'t str) -> Cow<'t, str> {
        if self.by_alias.is_empty() {
            return Cow::Borrowed(text);
        }
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let (mut out, mut rest, mut before, mut quoted) = (String::new(), text, ' ', false);
        while let Some(c) = rest.chars().next() {
            let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len()).max(c.len_utf8());
            let (word, behind) = rest.split_at(length);
            quoted ^= c == '"';
            let is_own = quoted || "@$#.:".contains(before) || behind.starts_with(':');
            match self.of_alias(word).filter(|_| !is_own) {
                Some(name) => out.push_str(name),
                None => out.push_str(word),
            }
            before = word.chars().next_back().unwrap_or(' ');
            rest = behind;
        }
        Cow::Owned(out)
    }

    /// What is said of a variable, by its canonical name. What is said of an array is said of its elements too, but for the
    /// alias, which has the index behind it then.
    pub fn said_of(&self, name: &str) -> Option<Cow<'_, GivenName>> {
        if let Some(said) = self.by_name.get(name) {
            return Some(Cow::Borrowed(said));
        }
        let at = name.find(['[', '#']).filter(|_| !self.by_name.is_empty())?;
        let (variable, rest) = name.split_at(at);
        let mut said = self.by_name.get(variable)?.clone();
        said.name = name.into();
        if !said.alias.is_empty() {
            said.alias.push_str(rest);
        }
        Some(Cow::Owned(said))
    }

    /// All aliases of a variable, by its canonical name, in alphabetical order; the one that is shown first.
    pub fn aliases_of(&self, name: &str) -> Vec<&str> {
        let Some(shown) = self.by_name.get(name).map(|said| said.alias.as_str()) else {
            return vec![];
        };
        let all = self.by_alias.iter().filter(|(_, of)| of.as_str() == name);
        let mut all: Vec<&str> = all.map(|(alias, _)| alias.as_str()).collect();
        all.sort_unstable_by_key(|alias| (*alias != shown, *alias));
        all
    }

    /// All aliases with the canonical names of their variables.
    pub fn aliases(&self) -> impl Iterator<Item = (&str, &str)> {
        self.by_alias.iter().map(|(alias, name)| (alias.as_str(), name.as_str()))
    }
}
