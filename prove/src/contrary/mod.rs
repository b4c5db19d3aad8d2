//! Pairs of outputs that a person would call contrary, such as both directions of a slide: from their names, their aliases and
//! what people say of them; and of flags to the control, from what its manual says of them.
//!
//! Two descriptions of the same kind make a pair where they are the same but for one word each, and these two words are contrary.
//! Where a description says first what is so and then what it does, as in `stop state: the interpolator stops`, the first suffices.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use plcc_abi::Dialect;
use plcc_abi::place::Direction;
use plcc_frontend::language;
use plcc_runtime::{Class, Names};

/// Contrary words.
static WORDS: LazyLock<Table> = LazyLock::new(|| Table::new(include_str!("words.tsv")));

/// Words that say nothing of what an output does.
const FILLERS: &[&str] = &[
    "THE", "A", "AN", "OF", "TO", "IS", "FOR", "DER", "DIE", "DAS", "DEN", "DES", "DEM", "NACH",
    "AZ",
];

/// The shortest and longest words of the table that are looked for at the end or in the middle of a name: shorter ones come
/// about by chance.
const PARTS: std::ops::RangeInclusive<usize> = 2..=16;

/// Two outputs that should not be on together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair {
    /// The outputs, by their canonical names.
    pub outputs: [String; 2],
    /// What makes them contrary, for people.
    pub because: String,
    /// The condition that both are on, in the program's language.
    pub condition: String,
}

/// The table of contrary words.
struct Table {
    /// For each word the rows in which it is, and in which half of them.
    rows: BTreeMap<&'static str, Vec<(usize, bool)>>,
}

impl Table {
    fn new(text: &'static str) -> Self {
        let mut rows: BTreeMap<&'static str, Vec<(usize, bool)>> = BTreeMap::new();
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        for (row, line) in lines.enumerate() {
            for (half, words) in line.split('\t').enumerate() {
                for word in words.split(' ') {
                    rows.entry(word).or_default().push((row, half == 0));
                }
            }
        }
        Self { rows }
    }

    /// Whether two words are contrary.
    fn are_contrary(&self, a: &str, b: &str) -> bool {
        let (Some(a), Some(b)) = (self.rows.get(a), self.rows.get(b)) else { return false };
        a.iter().any(|(row, half)| b.contains(&(*row, !half)))
    }
}

/// How an output is described.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// By its name, or an alias.
    Name,
    /// By a text: a comment, or what `[names]` says of it or of the device.
    Text,
    /// By what the manual says of it.
    Manual,
}

/// A description of an output.
struct Description {
    output: usize,
    kind: Kind,
    /// As it was written.
    written: String,
    words: Vec<String>,
    /// Its words with signs and M functions among them; those before the first colon or semicolon, if it has any.
    others: Vec<Vec<String>>,
}

impl Description {
    fn new(output: usize, kind: Kind, written: &str) -> Self {
        let words = words(written);
        let mut others = vec![];
        // M10 and M11 may be names of variables, which say nothing.
        if kind != Kind::Name {
            others.push(signed_words(written));
            others.extend(written.split_once([':', ';']).map(|(head, _)| signed_words(head)));
        }
        Self { output, kind, written: written.into(), words, others }
    }
}

/// The pairs of a program, in the order of the names of their outputs. Each pair is there once. `given` are the bits that it gives to the
/// control, as far as they are known; of those only what the manual says counts.
pub fn pairs(dialect: Dialect, names: &dyn Names, given: &[String]) -> Vec<Pair> {
    let mut outputs: Vec<String> = (names.declared().into_iter())
        .filter(|(_, key)| {
            let properties = names.properties(*key);
            let width = properties.value.map(|place| place.width).or(properties.width);
            properties.direction == Direction::Output
                && (properties.class == Class::Logical || width == Some(1))
                && properties.elements.is_none()
        })
        .map(|(name, _)| name)
        .collect();
    let mut all = vec![];
    for (output, name) in outputs.iter().enumerate() {
        let mut describe = |kind, written: &str| {
            let description = Description::new(output, kind, written);
            if !description.words.is_empty() {
                all.push(description);
            }
        };
        describe(Kind::Name, name);
        for alias in names.given().aliases_of(name) {
            describe(Kind::Name, alias);
        }
        if let Some(said) = names.given().said_of(name) {
            describe(Kind::Text, &said.text);
            describe(Kind::Text, &said.device);
        }
    }
    let own: BTreeSet<String> = outputs.iter().cloned().collect();
    let meanings: BTreeMap<String, String> =
        language(dialect).topics().into_iter().map(|topic| (topic.name, topic.meaning)).collect();
    for name in given.iter().filter(|name| !own.contains(*name)) {
        let Some(meaning) = meanings.get(name) else { continue };
        all.push(Description::new(outputs.len(), Kind::Manual, meaning));
        outputs.push(name.clone());
    }
    let mut found: BTreeMap<(usize, usize), String> = BTreeMap::new();
    for (at, a) in all.iter().enumerate() {
        for b in all.iter().skip(at + 1).filter(|b| b.kind == a.kind && b.output != a.output) {
            let Some((one, other)) = difference(a, b) else { continue };
            // A text of a single word says nothing where several outputs have it.
            let is_shared = |own: &Description| {
                let same = |it: &&Description| it.words == own.words && it.output != own.output;
                own.kind == Kind::Text && own.words.len() == 1 && all.iter().any(|it| same(&it))
            };
            if is_shared(a) || is_shared(b) {
                continue;
            }
            let pair = (a.output.min(b.output), a.output.max(b.output));
            let what = match a.kind {
                Kind::Name if one == a.written && other == b.written => "the names".to_owned(),
                Kind::Name => format!("the names {} and {}", a.written, b.written),
                Kind::Text => format!("the texts \"{}\" and \"{}\"", a.written, b.written),
                Kind::Manual => format!("\"{}\" and \"{}\"", a.written, b.written),
            };
            found.entry(pair).or_insert_with(|| format!("{one} and {other} in {what}"));
        }
    }
    let pair = |((a, b), because)| {
        let (a, b): (&String, &String) = (outputs.get(a)?, outputs.get(b)?);
        let condition = language(dialect).both_on(a, b);
        Some(Pair { outputs: [a.clone(), b.clone()], because, condition })
    };
    found.into_iter().filter_map(pair).collect()
}

/// The words of a name or text in capitals, without accents, numbers words of their own.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = vec![];
    let mut before = ' ';
    for c in text.chars() {
        let is_new = match (before, c) {
            (before, c) if before.is_numeric() != c.is_numeric() => true,
            // `OpenClamp` is two words.
            (before, c) => before.is_lowercase() && c.is_uppercase() || !before.is_alphanumeric(),
        };
        if c.is_alphanumeric() {
            if is_new || words.is_empty() {
                words.push(String::new());
            }
            if let Some(word) = words.last_mut() {
                word.push_str(&plain(c));
            }
        }
        before = c;
    }
    let fillers = words.iter().filter(|word| FILLERS.contains(&word.as_str())).count();
    if fillers < words.len() {
        words.retain(|word| !FILLERS.contains(&word.as_str()));
    }
    words
}

/// The same with the signs + and - between blanks as the words that they are, and a number and the letter M before it as one word.
fn signed_words(text: &str) -> Vec<String> {
    let part = |part: &str| match part {
        "+" => vec!["PLUS".to_owned()],
        "-" => vec!["MINUS".to_owned()],
        part => words(part),
    };
    let mut all: Vec<String> = vec![];
    for word in text.split_whitespace().flat_map(part) {
        match all.last_mut() {
            Some(last) if last == "M" && word.starts_with(|c: char| c.is_ascii_digit()) => {
                last.push_str(word.trim_start_matches('0'));
            }
            _ => all.push(word),
        }
    }
    let fillers = all.iter().filter(|word| FILLERS.contains(&word.as_str())).count();
    if fillers < all.len() {
        all.retain(|word| !FILLERS.contains(&word.as_str()));
    }
    all
}

/// A letter in capitals, without what stands on it.
fn plain(c: char) -> String {
    c.to_uppercase()
        .map(|c| match c {
            'Á' | 'À' | 'Â' | 'Ä' => "A".to_owned(),
            'É' | 'È' | 'Ê' => "E".to_owned(),
            'Í' => "I".to_owned(),
            'Ó' | 'Ö' | 'Ő' | 'Ô' => "O".to_owned(),
            'Ú' | 'Ü' | 'Ű' => "U".to_owned(),
            'ß' => "SS".to_owned(),
            c => c.to_string(),
        })
        .collect()
}

/// The contrary words in which alone two descriptions differ.
fn difference<'d>(a: &'d Description, b: &'d Description) -> Option<(&'d str, &'d str)> {
    let is_name = a.kind == Kind::Name;
    let others = a.others.iter().flat_map(|a| b.others.iter().map(move |b| (a, b)));
    std::iter::once((&a.words, &b.words)).chain(others).find_map(|(a, b)| in_words(a, b, is_name))
}

fn in_words<'d>(a: &'d [String], b: &'d [String], is_name: bool) -> Option<(&'d str, &'d str)> {
    if a.len() != b.len() {
        return None;
    }
    let mut differing = a.iter().zip(b).filter(|(a, b)| a != b);
    let (one, other) = differing.next()?;
    if differing.next().is_some() {
        return None;
    }
    if WORDS.are_contrary(one, other) {
        return Some((one, other));
    }
    // A name may have no marks between its words: VUP and VDOWN.
    is_name.then(|| in_word(one, other)).flatten()
}

/// The contrary words in which alone two words differ that begin with the same letters or end with the same ones.
fn in_word<'w>(a: &'w str, b: &'w str) -> Option<(&'w str, &'w str)> {
    let same = a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count();
    for begin in (0..=same).rev() {
        let (rest_a, rest_b) = (part(a, begin..), part(b, begin..));
        let ends = rest_a.chars().rev().zip(rest_b.chars().rev()).take_while(|(a, b)| a == b);
        for end in (0..=ends.count()).rev() {
            // Something of the name has to be common to both, else they are whole words.
            if begin + end < 1 {
                continue;
            }
            let (one, other) = (
                part(rest_a, ..rest_a.len().saturating_sub(end)),
                part(rest_b, ..rest_b.len().saturating_sub(end)),
            );
            let fits = PARTS.contains(&one.len()) && PARTS.contains(&other.len());
            if fits && WORDS.are_contrary(one, other) {
                return Some((one, other));
            }
        }
    }
    None
}

/// A part of a word; empty where it has letters of several bytes.
fn part(word: &str, range: impl std::slice::SliceIndex<str, Output = str>) -> &str {
    word.get(range).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contrary(kind: Kind, a: &str, b: &str) -> Option<(String, String)> {
        let (a, b) = (Description::new(0, kind, a), Description::new(1, kind, b));
        difference(&a, &b).map(|(one, other)| (one.to_owned(), other.to_owned()))
    }

    #[test]
    fn names_and_texts_that_differ_in_contrary_words_are_contrary() {
        let pair = |one: &str, other: &str| Some((one.to_owned(), other.to_owned()));
        for (a, b, one, other) in [
            ("VUP", "VDOWN", "UP", "DOWN"),
            ("LEFT", "RIGHT", "LEFT", "RIGHT"),
            ("SPCW", "SPCCW", "CW", "CCW"),
            ("GLOW", "GHIGH", "LOW", "HIGH"),
            ("CLAMP", "UNCLAMP", "CLAMP", "UNCLAMP"),
            ("CLAMP_OPEN", "CLAMP_CLOSE", "OPEN", "CLOSE"),
            ("OpenDoor2", "CloseDoor2", "OPEN", "CLOSE"),
            ("TUROPN1", "TURCLS1", "OPN", "CLS"),
            ("K1_STERN", "K1_DREIECK", "STERN", "DREIECK"),
        ] {
            assert_eq!(contrary(Kind::Name, a, b), pair(one, other), "{a} {b}");
        }
        for (a, b, one, other) in [
            ("GEAR: LOW RANGE", "GEAR: HIGH RANGE", "LOW", "HIGH"),
            ("drive to the left", "drive to right", "LEFT", "RIGHT"),
            ("Futter öffnen", "Futter schließen", "OFFNEN", "SCHLIESSEN"),
            ("Futter spannen", "Futter loesen", "SPANNEN", "LOESEN"),
            ("ajtó nyitás", "ajtó zárás", "NYITAS", "ZARAS"),
            ("asztal előre", "asztal hátra", "ELORE", "HATRA"),
            ("jogs X in the + direction", "jogs X in the - direction", "PLUS", "MINUS"),
            ("lights M3 of the panel", "lights M04 of the panel", "M3", "M4"),
            ("start state: it moves", "stop state: nothing moves", "START", "STOP"),
        ] {
            assert_eq!(contrary(Kind::Text, a, b), pair(one, other), "{a} {b}");
        }
    }

    #[test]
    fn others_are_not() {
        for (a, b) in [
            ("CLAMP1", "UNCLAMP2"),
            ("SLOW", "GLOW"),
            ("PUMPON", "MOTOROFF"),
            ("COOL", "COIL"),
            ("UP", "UPS"),
            ("LAMP", "CLAMP"),
            ("XT", "XR"),
        ] {
            assert_eq!(contrary(Kind::Name, a, b), None, "{a} {b}");
        }
        for (a, b) in [
            ("valve of the clamp", "valve of the chuck"),
            ("door opens", "clamp closes"),
            ("", ""),
            ("on", "pump off"),
            ("X + Y", "X * Y"),
            ("lights M3", "lights M5"),
            ("guard: it opens", "guard: it turns"),
        ] {
            assert_eq!(contrary(Kind::Text, a, b), None, "{a} {b}");
        }
    }

    #[test]
    fn each_word_of_the_table_can_be_a_word() {
        for word in WORDS.rows.keys() {
            assert_eq!(signed_words(word), [word.to_string()]);
        }
        assert!(WORDS.rows.len() > 200);
    }
}
