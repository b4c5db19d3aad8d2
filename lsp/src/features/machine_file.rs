//! Machine files (`STEM.machine.toml`): their mistakes, as every command tells them, their tables and keys, and the names of the
//! program that they belong to.

use std::path::{Path, PathBuf};

use gen_lsp_types::{
    CompletionItem, CompletionItemKind, CompletionResponse, Diagnostic, DiagnosticSeverity, Hover,
    Message, Position, Range,
};
use plcc_abi::machine::reference::{Keys, TABLES, Value, machine_table};
use plcc_frontend::common::{FileLoader, LintLevels, Machine};
use plcc_frontend::detect;

use super::open_text::OpenText;
use super::{completion, hover};
use crate::documents::Documents;
use crate::position::Encoding;
use crate::program::Program;

/// What the name of a machine file ends with.
const ENDING: &str = ".machine.toml";

/// Whether a file is a machine file by its name.
pub(crate) fn is_machine_file(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(ENDING))
}

/// The source beside a machine file that it belongs to.
pub(crate) fn source_of(path: &Path, documents: &Documents) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let stem = name.strip_suffix(ENDING)?;
    let folder = path.parent()?;
    let endings = detect::file_extensions();
    let mut names = documents.list(folder);
    names.sort_unstable();
    let is_source = |name: &String| {
        let ending = name.strip_prefix(stem).map(str::to_lowercase);
        ending.is_some_and(|ending| endings.contains(&ending))
    };
    names.into_iter().find(is_source).map(|name| folder.join(name))
}

/// A machine file, and what can be asked of a place in it.
pub(crate) struct MachineText(OpenText);

/// Whether a character is part of the names of tables, keys and variables.
fn is_part_of_name(c: char) -> bool {
    completion::is_part_of_word(c) || matches!(c, '.' | '-')
}

/// Where in a line of a table a place is.
enum Spot {
    /// Between the brackets of a table's name.
    Header,
    /// At the name of one of these keys.
    Key(Keys),
    /// At a value of this kind.
    Value(Value),
    /// Anywhere else.
    Other,
}

impl MachineText {
    /// A machine file with this text.
    pub(crate) fn new(path: &Path, text: &str, encoding: Encoding) -> Self {
        Self(OpenText::new(path, text, encoding))
    }

    /// The name of the table in which a line is that begins here.
    fn table_before(&self, line_start: usize) -> &str {
        let before = self.0.text().get(..line_start).unwrap_or_default();
        let header = before.lines().rev().map(str::trim_start).find(|line| line.starts_with('['));
        let header = header.and_then(|line| line.trim_start_matches('[').split(']').next());
        header.unwrap_or_default().trim()
    }

    /// Where a word that begins here is.
    fn spot(&self, start: u32) -> Spot {
        let before = self.0.line_before(start);
        let in_quotes = before.matches('"').count() % 2 == 1;
        if before.contains('#') && !in_quotes {
            return Spot::Other;
        }
        if before.trim_start().starts_with('[') {
            return Spot::Header;
        }
        let line_start = (start as usize).saturating_sub(before.len());
        let Some(table) = machine_table(self.table_before(line_start)) else { return Spot::Other };
        // Of `NAME = { key = value, key = value }` what is written last.
        let (keys, part) = match (table.keys, before.split_once('{')) {
            (Keys::Variables(keys), Some((_, inner))) => {
                (Keys::These(keys), inner.rsplit(',').next().unwrap_or_default())
            }
            (keys, _) => (keys, before),
        };
        match (keys, part.split_once('=')) {
            (_, None) => Spot::Key(keys),
            (Keys::These(_), Some((word, _))) => {
                let key = keys.get(word.trim().trim_matches('"'));
                key.map_or(Spot::Other, |key| Spot::Value(key.value))
            }
            (Keys::Any(value), Some(_)) => Spot::Value(value),
            (Keys::Variables(_), Some(_)) => Spot::Other,
        }
    }

    /// What can be written at a place: tables, keys of the table, their values, and names of the program.
    pub(crate) fn completion(&self, at: Position, program: Option<&Program>) -> CompletionResponse {
        let span = self.0.beginning(at, is_part_of_name);
        let (range, prefix) = (self.0.range(span), self.0.slice(span));
        let proposed = |name: &str, meaning: &str, kind| {
            let fits = completion::begins(name, prefix);
            fits.then(|| completion::item(name, kind, meaning, None, range))
        };
        let names = || {
            program.map_or(vec![], |program| completion::names(program, prefix, range, |_| false))
        };
        let items: Vec<CompletionItem> = match self.spot(span.start) {
            Spot::Header => TABLES
                .iter()
                .filter(|table| !table.name.is_empty())
                .filter_map(|it| proposed(it.name, it.meaning, CompletionItemKind::Module))
                .collect(),
            Spot::Key(Keys::These(keys)) => keys
                .iter()
                .filter_map(|it| proposed(it.name, it.meaning, CompletionItemKind::Property))
                .collect(),
            Spot::Key(Keys::Variables(_)) | Spot::Value(Value::Variable) => names(),
            Spot::Value(value) => {
                let texts = value.texts().into_iter();
                texts.filter_map(|it| proposed(it, "", CompletionItemKind::Value)).collect()
            }
            Spot::Key(Keys::Any(_)) | Spot::Other => vec![],
        };
        CompletionResponse::CompletionItemList(items)
    }

    /// What the word at a place is: a table, a key, or a name of the program.
    pub(crate) fn hover(&self, at: Position, program: Option<&Program>) -> Option<Hover> {
        let span = self.0.word(at, is_part_of_name);
        let word = self.0.slice(span);
        let value = match self.spot(span.start) {
            Spot::Header => machine_table(word).map(|it| format!("`[{word}]`: {}", it.meaning)),
            Spot::Key(Keys::Variables(_)) | Spot::Value(Value::Variable) => {
                hover::of_name(program?, word)
            }
            Spot::Key(keys) => keys.get(word).map(|it| format!("`{word}`: {}", it.meaning)),
            Spot::Value(_) | Spot::Other => None,
        }?;
        Some(hover::shown(value, self.0.range(span)))
    }
}

/// What is wrong with the text of a machine file.
pub(crate) fn problems(text: &str) -> Vec<Diagnostic> {
    let machine = Machine::parse(text).map_err(|error| error.to_string());
    let Err(message) = machine.and_then(|machine| LintLevels::of_machine(&machine)) else {
        return vec![];
    };
    // The message names the line, if it knows it.
    let named = message.split("line ").nth(1).unwrap_or_default();
    let digits: String = named.chars().take_while(char::is_ascii_digit).collect();
    let line = digits.parse::<u32>().unwrap_or(1).saturating_sub(1);
    let range = Range {
        start: Position { line, character: 0 },
        end: Position { line: line + 1, character: 0 },
    };
    vec![Diagnostic {
        range,
        severity: Some(DiagnosticSeverity::Error),
        source: Some("plcc".into()),
        message: Message::String(message.trim_end().to_owned()),
        ..Diagnostic::default()
    }]
}

#[cfg(test)]
mod tests {
    use gen_lsp_types::Contents;
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::with_cursor;

    /// A machine file and the place of `|` in it.
    fn machine(text: &str) -> (MachineText, Position) {
        let at = text.find('|').unwrap();
        let path = Path::new("/tmp/a.machine.toml");
        let machine = MachineText::new(path, &text.replace('|', ""), Encoding::Utf16);
        let at = machine.0.encoding.position(&machine.0.sources, machine.0.file, at as u32);
        (machine, at)
    }

    fn program() -> Program {
        with_cursor(Dialect::Pmi, "$INPUT\nDOOR = 1/0 ? the door\n$END\nLAMP = DOOR\n").0
    }

    fn proposed(text: &str) -> Vec<String> {
        let (machine, at) = machine(text);
        match machine.completion(at, Some(&program())) {
            CompletionResponse::CompletionItemList(list) => {
                list.into_iter().map(|it| it.label).collect()
            }
            CompletionResponse::CompletionList(_) => unreachable!("it is a plain list"),
        }
    }

    #[test]
    fn tables_keys_values_and_names_are_proposed() {
        assert_eq!(
            proposed("[sim|"),
            TABLES.iter().map(|it| it.name).filter(|it| it.starts_with("sim")).collect::<Vec<_>>()
        );
        assert_eq!(proposed("[[simulator.d|]]"), ["simulator.device"]);
        assert_eq!(
            proposed("[[simulator.device]]\nname = \"A\"\next|"),
            ["extend", "extended", "extend_ms"]
        );
        assert_eq!(proposed("[[simulator.device]]\nkind = \"t|"), ["turret"]);
        assert_eq!(proposed("[[simulator.device]]\ninput = \"!D|"), ["DOOR"]);
        assert_eq!(proposed("[simulator.keys]\n\"OPEN\" = \"DO|"), ["DOOR"]);
        assert_eq!(proposed("[names]\nDO|"), ["DOOR"]);
        assert_eq!(proposed("[names]\nDOOR = { alias = \"DO\", dr|"), ["drawing"]);
        assert_eq!(proposed("[names]\nDOOR = { alias = \"DO|"), [""; 0]);
        assert_eq!(proposed("[names]\nDOOR = { al|"), ["alias"]);
        assert_eq!(proposed("[lints]\nnear-name = \"d|"), ["deny"]);
        assert_eq!(proposed("con|"), ["control"]);
        assert_eq!(proposed("control = \"nct1|").first().map(String::as_str), Some("nct100"));
        assert_eq!(proposed("[simulator] # un|"), [""; 0]);
    }

    #[test]
    fn tables_keys_and_names_are_explained() {
        let shown = |text: &str| {
            let (machine, at) = machine(text);
            match machine.hover(at, Some(&program())).map(|it| it.contents) {
                Some(Contents::MarkupContent(it)) => it.value,
                _ => String::new(),
            }
        };
        assert_eq!(shown("[simulator.spin|dle]"), "`[simulator.spindle]`: the spindle");
        assert!(shown("[simulator]\nla|g_ms = 3\n").contains("follow the commands"));
        assert!(shown("[names]\nDO|OR = { }").contains("the door"));
        assert_eq!(shown("[simulator]\nnon|sense = 3\n"), "");
    }

    #[test]
    fn the_source_beside_it_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["a.pmi", "ab.plc", "b.PLC", "b.csv"] {
            std::fs::write(path(name), "").unwrap();
        }
        let found = |name: &str| source_of(&path(name), &Documents::default());
        assert_eq!(found("a.machine.toml"), Some(path("a.pmi")));
        assert_eq!(found("b.machine.toml"), Some(path("b.PLC")));
        assert_eq!(found("c.machine.toml"), None);
    }

    #[test]
    fn a_mistake_is_told_in_its_line() {
        let found =
            problems("[lints]\nnear-name = \"allow\"\n[names]\nI012 = { alias = \"2D\" }\n");
        assert_eq!(found.iter().map(|it| it.range.start.line).collect::<Vec<_>>(), [3]);
        assert!(problems("[lints]\nnear-name = \"allow\"\n").is_empty());
        assert_eq!(problems("[nonsense]\n").len(), 1);
    }
}
