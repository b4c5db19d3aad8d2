//! The names that the control gives a meaning: flags, registers, lines (NCT 2). They are the table
//! `names.tsv` beside this file.

use std::sync::LazyLock;

use plcc_abi::nct::{NctName, RETAINED_FROM};

use crate::common::tsv::{self, Row, TsvError};

const TABLE: &str = include_str!("names.tsv");

/// The table's columns.
const COLUMNS: &[&str] = &["name", "kind", "meaning", "section"];

/// What a name may be.
const KINDS: [&str; 12] = [
    "constant",
    "counter",
    "input flag",
    "input line",
    "input register",
    "output flag",
    "output line",
    "output register",
    "status flag",
    "status word",
    "table",
    "timer",
];

/// A name with a meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// In its full spelling: `I510`, `F0040`, `RH060`.
    pub name: &'static str,
    /// What it is: `input flag`, `output register`, `timer`.
    pub kind: &'static str,
    /// What it says, in one line.
    pub meaning: &'static str,
    /// The section of the manual that describes it.
    pub section: &'static str,
}

static NAMES: LazyLock<Vec<Name>> = LazyLock::new(|| tsv::built_in(load(TABLE)));

fn load(table: &'static str) -> Result<Vec<Name>, TsvError> {
    tsv::load("frontend/src/nct/reference/names.tsv", table, COLUMNS, str::cmp, name)
}

fn name(row: &Row<'static>) -> Result<Name, TsvError> {
    let name = row.text("name")?;
    let parsed = name.parse::<NctName>().ok().filter(|parsed| parsed.to_string() == name);
    let Some(parsed) = parsed else {
        return Err(row.error("name", format!("`{name}` is not a variable as programs are listed")));
    };
    let section = row.text("section")?;
    let expected = kind('I', parsed).1;
    if section != expected {
        return Err(row.error("section", format!("`{name}` is in {expected}, not in {section}")));
    }
    let kind = row.word("kind", &KINDS.map(|kind| (kind, kind)))?;
    Ok(Name { name, kind, meaning: row.text("meaning")?, section })
}

/// Every name, sorted.
pub fn all() -> &'static [Name] {
    &NAMES
}

/// Finds a name by its full spelling.
pub fn find(name: &str) -> Option<&'static Name> {
    let names = all();
    names.binary_search_by(|row| row.name.cmp(name)).ok().and_then(|at| names.get(at))
}

/// The meaning of a variable, where the control gives it one.
pub fn meaning(name: NctName) -> Option<&'static str> {
    find(&name.to_string()).map(|name| name.meaning)
}

/// The name that a user means who writes it with spaces, in small letters, with the letter O for 0,
/// or with too few zeros: `i51O` is I510, `RH 60` is RH060. The first letter is given too, since
/// `V002` is the name I002 with the letter V.
fn canonical(text: &str) -> Option<(char, NctName)> {
    let upper: String =
        text.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_ascii_uppercase()).collect();
    // A leading O is the letter of output lines; after the letters it can only be a zero.
    let letters = ["RH", "RP", "OP"].into_iter().find(|l| upper.starts_with(l)).map_or(1, str::len);
    let (letters, digits) = upper.split_at_checked(letters)?;
    let digits = digits.replace('O', "0");
    if letters == "V" {
        return format!("I{digits}").parse().ok().map(|name| ('V', name));
    }
    let name: NctName = format!("{letters}{digits}").parse().ok()?;
    letters.chars().next().map(|first| (first, name))
}

/// The letters of statements that act on one variable, the letters of the variable that are left out
/// after them, and what they do with it (NCT 4.1, 4.6, 4.7, 4.12).
const STATEMENTS: [(&str, &str, &str); 12] = [
    ("UF", "F", "sets NAME to 1"),
    ("DF", "F", "sets NAME to 0"),
    ("UO", "O", "switches NAME on at once, without the output image"),
    ("DO", "O", "switches NAME off at once, without the output image"),
    ("UQ", "Q", "increments NAME; 65535 becomes 0"),
    ("DQ", "Q", "decrements NAME; 0 becomes 65535"),
    ("NL", "", "loads the complement of NAME into register OP"),
    ("NS", "", "stores the complement of register OP into NAME"),
    ("U", "Y", "sets NAME to 1"),
    ("D", "Y", "sets NAME to 0"),
    ("L", "", "loads NAME into register OP"),
    ("S", "", "stores register OP into NAME"),
];

/// The statement that a text is, with the name of its variable: `U010` sets `Y010`.
fn statement(text: &str) -> Option<(String, String)> {
    let upper: String =
        text.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_ascii_uppercase()).collect();
    STATEMENTS.into_iter().find_map(|(letters, omitted, does)| {
        let name = format!("{omitted}{}", upper.strip_prefix(letters)?);
        let (_, parsed) = canonical(&name).filter(|_| name.len() > 1)?;
        let is_bit = matches!(letters, "UF" | "DF" | "UO" | "DO" | "U" | "D");
        if is_bit && !parsed.is_bit() {
            return None;
        }
        let shown = parsed.to_string();
        Some((format!("{upper}\n  the statement {}", does.replace("NAME", &shown)), shown))
    })
}

/// What `plcc explain` prints for a variable such as `I510`, or for a statement with one such as `U010`;
/// `None` if there is none of the name.
pub fn explain(text: &str) -> Option<String> {
    let Some((letter, name)) = canonical(text) else {
        let (does, name) = statement(text)?;
        return explain(&name).map(|page| format!("{does}\n\n{page}"));
    };
    let shown = if letter == 'V' {
        format!("V{}", name.to_string().trim_start_matches('I'))
    } else {
        name.to_string()
    };
    let (kind, section) = kind(letter, name);
    let mut out = format!("{shown}\n  {kind}\n");
    // A physical line (P, O) has the meaning of the same bit of the image (I, Y).
    let named = match name {
        NctName::P { byte, bit } => NctName::I { byte, bit },
        NctName::O { byte, bit } => NctName::Y { byte, bit },
        other => other,
    };
    if let Some(row) = find(&named.to_string()) {
        out.push_str(&format!("  {}\n", row.meaning));
    } else if let Some(bits) = bits(named) {
        for (bit, meaning) in bits {
            out.push_str(&format!("  {bit}: {meaning}\n"));
        }
    }
    out.push_str(&format!("  NCT manual {section}\n"));
    Some(out)
}

/// The names and meanings of those bits of a word that have a meaning; `None` if it is not a word of
/// I, Y or F.
fn bits(name: NctName) -> Option<Vec<(String, &'static str)>> {
    let bit_of = |byte: u16, bit: u8| match name {
        NctName::I { bit: None, .. } => {
            Some(NctName::I { byte: byte.try_into().ok()?, bit: Some(bit) })
        }
        NctName::Y { bit: None, .. } => {
            Some(NctName::Y { byte: byte.try_into().ok()?, bit: Some(bit) })
        }
        NctName::F { bit: None, .. } => Some(NctName::F { byte, bit: Some(bit) }),
        _ => None,
    };
    let first = match name {
        NctName::I { byte, bit: None } | NctName::Y { byte, bit: None } => byte.into(),
        NctName::F { byte, bit: None } => byte,
        _ => return None,
    };
    let places = (first..first + 2).flat_map(|byte| (0..8).map(move |bit| (byte, bit)));
    let named = places.filter_map(|(byte, bit)| {
        let name = bit_of(byte, bit)?;
        meaning(name).map(|meaning| (name.to_string(), meaning))
    });
    Some(named.collect())
}

/// What kind of variable a name is, and the manual's section.
fn kind(letter: char, name: NctName) -> (String, &'static str) {
    let line = |byte: u8| if byte < 40 { "line" } else { "flag" };
    let size = if name.is_bit() { "bit" } else { "word of 16 bits" };
    match name {
        NctName::I { byte, .. } => {
            let section = if byte < 40 { "2.1.1" } else { "2.2.1" };
            match letter {
                'V' => (format!("change test of an input {}, {size}", line(byte)), section),
                _ => (format!("input {}, {size}", line(byte)), section),
            }
        }
        NctName::Y { byte, .. } => {
            let section = if byte < 40 { "2.1.2" } else { "2.2.2" };
            (format!("output {}, {size}", line(byte)), section)
        }
        NctName::P { .. } => (format!("physical input line read directly, {size}"), "2.1.1"),
        NctName::O { .. } => (format!("physical output line written directly, {size}"), "2.1.2"),
        NctName::F { byte, .. } => {
            let section = match byte {
                0..=9 => "2.3.1",
                500 => "2.3.2",
                _ => "2.3",
            };
            let kept = if usize::from(byte) < RETAINED_FROM {
                "0 at power-up"
            } else {
                "survives power-off"
            };
            (format!("local variable, {size}, {kept}"), section)
        }
        NctName::Rh(n) if n % 100 < 50 => ("register from the NC, 16 bits".into(), "2.2.3"),
        NctName::Rh(_) => ("register to the NC, 16 bits".into(), "2.2.4"),
        NctName::Q(_) => ("up/down counter, 16 bits".into(), "2.4.1"),
        NctName::T(_) => ("20 ms timer, 16 bits".into(), "2.4.2"),
        NctName::H(_) => ("second timer, 16 bits".into(), "2.4.3"),
        NctName::M(_) => ("minute timer, 16 bits".into(), "2.4.4"),
        NctName::Rp(_) => ("PLC constant, 16 bits".into(), "2.4.5"),
        NctName::Op(_) => ("register OP of a module, 16 bits".into(), "2.3.1"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_explained_with_their_variable() {
        for (text, part) in [
            ("U010", "the statement sets Y010 to 1\n\nY010\n"),
            ("d 012", "the statement sets Y012 to 0"),
            ("UF0103", "sets F0103 to 1"),
            ("UO012", "switches O012 on at once"),
            ("UQ05", "increments Q05"),
            ("LF020", "loads F020 into register OP"),
            ("SRH060", "stores register OP into RH060"),
            ("NLI00", "loads the complement of I00"),
        ] {
            let page = explain(text).unwrap_or_default();
            assert!(page.contains(part), "{text}: {page}");
        }
        for text in ["U", "U01", "X010", "L", "U0109", "LQ", "UF010"] {
            assert_eq!(explain(text), None, "{text}");
        }
    }

    #[test]
    fn the_table_of_names_has_no_mistakes() {
        let names = load(TABLE).unwrap();
        assert_eq!(names.len(), 1534);
        for row in names {
            assert!((3..=100).contains(&row.meaning.len()), "{}", row.name);
        }
    }

    #[test]
    fn a_wrong_row_is_named() {
        for (rows, message) in [
            ("F40\ttimer\tx\t2.3", "2: name: `F40` is not a variable as programs are listed"),
            ("T00\ttimer\tx\t2.4.3", "2: section: `T00` is in 2.4.2, not in 2.4.3"),
            ("T00\tclock\tx\t2.4.2", "2: kind: `clock` is not one of: constant, counter"),
            ("T00\ttimer\t\t2.4.2", "2: meaning: the cell is empty"),
            ("T01\ttimer\tx\t2.4.2\nT00\ttimer\tx\t2.4.2", "3: name: `T00` comes after `T01`"),
        ] {
            let table = format!("{}\n{rows}\n", COLUMNS.join("\t"));
            let error = load(table.leak()).unwrap_err().to_string();
            let expected = format!("frontend/src/nct/reference/names.tsv:{message}");
            assert!(error.starts_with(&expected), "{error}");
        }
    }

    #[test]
    fn registers_and_flags_are_all_there() {
        let count = |letter: &str| {
            all()
                .iter()
                .filter(|row| row.name.trim_end_matches(|c: char| c.is_ascii_digit()) == letter)
                .count()
        };
        let counts = ["Q", "T", "H", "M", "RP"].map(count);
        assert_eq!(counts, [32, 50, 100, 10, 40]);
        for n in 0..152 {
            let name = format!("Y{}{}", 71 + n / 8, n % 8);
            assert!(find(&name).unwrap().meaning.contains(":199"), "{name}");
        }
    }

    #[test]
    fn variables_are_explained_in_every_spelling() {
        let first = explain("I510").unwrap();
        assert!(first.starts_with("I510\n  input flag, bit\n  first run"), "{first}");
        for other in ["i510", " I 5 1 0", "I51O"] {
            assert_eq!(explain(other).as_deref(), Some(first.as_str()), "{other}");
        }
        assert!(explain("rh60").unwrap().starts_with("RH060\n"));
        assert!(
            explain("V000")
                .unwrap()
                .starts_with("V000\n  change test of an input line, bit\n  input line")
        );
        assert!(explain("O012").unwrap().contains("connector O1, pin 21"));
        assert!(explain("Y40").unwrap().contains("  Y407: edit mode"));
        assert!(explain("F0100").unwrap().contains("0 at power-up"));
        assert!(explain("F600").unwrap().contains("survives power-off"));
        for none in ["", "I", "é", "W1", ":003", "NCT-7", "I999", "@FRO"] {
            assert_eq!(explain(none), None, "{none}");
        }
    }
}
