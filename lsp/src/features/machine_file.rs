//! Machine files (`STEM.machine.toml`): their mistakes, as every command tells them, their tables and keys, and the names of the
//! program that they belong to.

use std::path::{Path, PathBuf};

use gen_lsp_types::{
    CompletionItem, CompletionItemKind, CompletionResponse, Contents, Diagnostic,
    DiagnosticSeverity, Hover, MarkupContent, MarkupKind, Message, Position, Range,
};
use plcc_abi::machine::reference::{Key, MachineTable, TABLES, Value, machine_table};
use plcc_diag::{FileId, SourceMap, Span};
use plcc_frontend::common::{FileLoader, LintLevels, Machine};
use plcc_frontend::detect;

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
pub(crate) struct MachineText {
    sources: SourceMap,
    file: FileId,
    encoding: Encoding,
}

/// Where in a line of a table a place is.
enum Spot<'t> {
    /// Between the brackets of a table's name.
    Header,
    /// At the name of a key of this table.
    Key(&'static MachineTable),
    /// At the name of a variable that is a key of this table.
    Variable,
    /// At the value of this key.
    Value(&'t Key),
    /// Anywhere else.
    Other,
}

impl MachineText {
    /// A machine file with this text.
    pub(crate) fn new(path: &Path, text: &str, encoding: Encoding) -> Self {
        let mut sources = SourceMap::new();
        let file = sources.add(path.to_string_lossy(), text.as_bytes());
        Self { sources, file, encoding }
    }

    fn text(&self) -> &str {
        self.sources.text(self.file)
    }

    /// The word at a place, of the letters that names of tables, keys and variables have.
    fn word(&self, at: Position) -> Span {
        let is_part = |c: char| completion::is_part_of_word(c) || matches!(c, '.' | '-');
        let offset = self.encoding.offset(&self.sources, self.file, at) as usize;
        let (before, after) = self.text().split_at_checked(offset).unwrap_or((self.text(), ""));
        let start = before.trim_end_matches(is_part).len();
        let end = self.text().len() - after.trim_start_matches(is_part).len();
        Span::new(self.file, start, end)
    }

    /// The name of the table in which a line is that begins here.
    fn table_before(&self, line_start: usize) -> &str {
        let before = self.text().get(..line_start).unwrap_or_default();
        let header = before.lines().rev().map(str::trim_start).find(|line| line.starts_with('['));
        let header = header.and_then(|line| line.trim_start_matches('[').split(']').next());
        header.unwrap_or_default().trim()
    }

    /// Where a word that begins here is.
    fn spot(&self, start: usize) -> Spot<'static> {
        let before = self.text().get(..start).unwrap_or_default();
        let line_start = before.rfind(['\n', '\r']).map_or(0, |at| at + 1);
        let before = before.get(line_start..).unwrap_or_default();
        let in_quotes = before.matches('"').count() % 2 == 1;
        if before.contains('#') && !in_quotes {
            return Spot::Other;
        }
        if before.trim_start().starts_with('[') {
            return Spot::Header;
        }
        let name = self.table_before(line_start);
        let Some(table) = machine_table(name) else { return Spot::Other };
        let key_of = |word: &str| table.keys.iter().find(|key| key.name == word);
        let bare = |text: &str| text.trim().trim_matches('"').to_owned();
        if table.is_by_variable {
            // Of `NAME = { key = value, key = value }` the part that is written last.
            let Some((_, inner)) = before.split_once('{') else {
                return if before.contains('=') { Spot::Other } else { Spot::Variable };
            };
            let part = inner.rsplit(',').next().unwrap_or_default();
            return match part.split_once('=') {
                Some((word, _)) => key_of(&bare(word)).map_or(Spot::Other, Spot::Value),
                None if in_quotes => Spot::Other,
                None => Spot::Key(table),
            };
        }
        match before.split_once('=') {
            None => Spot::Key(table),
            Some(_) if name == "simulator.keys" => Spot::Value(&KEY_OF_A_KEY),
            Some((word, _)) => key_of(&bare(word)).map_or(Spot::Other, Spot::Value),
        }
    }

    /// What can be written at a place: tables, keys of the table, their values, and names of the program.
    pub(crate) fn completion(&self, at: Position, program: Option<&Program>) -> CompletionResponse {
        let end = self.encoding.offset(&self.sources, self.file, at);
        let span = Span { end, ..self.word(at) };
        let range = self.encoding.range(&self.sources, span);
        let prefix = self.sources.slice(span);
        let proposed = |name: &str, meaning: &str, kind| {
            let fits = name.get(..prefix.len()).is_some_and(|it| it.eq_ignore_ascii_case(prefix));
            fits.then(|| completion::item(name, kind, meaning, None, range))
        };
        let names = || {
            program.map_or(vec![], |program| completion::names(program, prefix, range, |_| false))
        };
        let items: Vec<CompletionItem> = match self.spot(span.start as usize) {
            Spot::Header => TABLES
                .iter()
                .filter(|table| !table.name.is_empty())
                .filter_map(|it| proposed(it.name, it.meaning, CompletionItemKind::Module))
                .collect(),
            Spot::Key(table) => table
                .keys
                .iter()
                .filter_map(|it| proposed(it.name, it.meaning, CompletionItemKind::Property))
                .collect(),
            Spot::Variable => names(),
            Spot::Value(key) if key.value == Value::Variable => names(),
            Spot::Value(key) => {
                let texts = key.value.texts().into_iter();
                texts.filter_map(|it| proposed(it, "", CompletionItemKind::Value)).collect()
            }
            Spot::Other => vec![],
        };
        CompletionResponse::CompletionItemList(items)
    }

    /// What the word at a place is: a table, a key, or a name of the program.
    pub(crate) fn hover(&self, at: Position, program: Option<&Program>) -> Option<Hover> {
        let span = self.word(at);
        let word = self.sources.slice(span);
        let of_name = || hover::of_name(program?, word);
        let value = match self.spot(span.start as usize) {
            Spot::Header => machine_table(word).map(|it| format!("`[{word}]`: {}", it.meaning)),
            Spot::Key(table) => {
                let key = table.keys.iter().find(|key| key.name == word);
                key.map(|it| format!("`{word}`: {}", it.meaning))
            }
            Spot::Variable | Spot::Value(Key { value: Value::Variable, .. }) => of_name(),
            Spot::Value(_) | Spot::Other => None,
        }?;
        let contents = Contents::MarkupContent(MarkupContent { kind: MarkupKind::Markdown, value });
        Some(Hover { contents, range: Some(self.encoding.range(&self.sources, span)) })
    }
}

/// Of `[simulator.keys]` each value is a variable.
const KEY_OF_A_KEY: Key =
    Key { name: "", meaning: "the variable that the key sets", value: Value::Variable };

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
    use plcc_abi::Dialect;

    use super::*;
    use crate::program::tests::with_cursor;

    /// A machine file and the place of `|` in it.
    fn machine(text: &str) -> (MachineText, Position) {
        let at = text.find('|').unwrap();
        let path = Path::new("/tmp/a.machine.toml");
        let machine = MachineText::new(path, &text.replace('|', ""), Encoding::Utf16);
        let at = machine.encoding.position(&machine.sources, machine.file, at as u32);
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
