//! How long an editor waits for answers while its user types in a program of 20 000 lines: a character is inserted or deleted, and
//! an answer is asked for at once, as an editor asks it. The time counts from the change to the answer, with what the server
//! reads anew for it. The server is in the same process, and writes and reads messages as it does for an editor.
//!
//! The last row of each language is a request that comes while the problems of the last change are looked for: it waits for
//! their end, as the server has one thread.
//!
//! `cargo bench -p plcc-benches --bench editor -- ROUNDS [METHOD]` (100 without a number; of methods with this name alone)
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::indexing_slicing)]

use std::fmt::Write;
use std::thread;
use std::time::Instant;

use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId};
use plcc_abi::Dialect;
use plcc_diag::{Diagnostic, SourceMap};
use plcc_frontend::common::{Limits, MemoryLoader, Options};
use plcc_frontend::{CheckedProgram, language};
use plcc_lsp::{Compiler, Run};
use plcc_random::Rng;
use serde_json::{Value, json};

/// The lines of each program.
const LINES: usize = 20_000;

/// What is asked for, with the parameters apart from document and position. The range is what an editor shows, the columns are
/// those after the statement and after the first letter of its last name.
const ASKED: [(&str, &str); 21] = [
    ("textDocument/completion", "{}"),
    ("textDocument/completion", FIRST_LETTER),
    ("textDocument/hover", "{}"),
    ("textDocument/signatureHelp", "{}"),
    ("textDocument/definition", "{}"),
    ("textDocument/references", r#"{"context": {"includeDeclaration": true}}"#),
    ("textDocument/documentHighlight", "{}"),
    ("textDocument/documentSymbol", "{}"),
    ("workspace/symbol", r#"{"query": "1"}"#),
    ("textDocument/foldingRange", "{}"),
    ("textDocument/selectionRange", r#"{"positions": [{"line": 9000, "character": 2}]}"#),
    ("textDocument/prepareCallHierarchy", "{}"),
    ("textDocument/prepareRename", "{}"),
    ("textDocument/codeLens", "{}"),
    ("textDocument/codeAction", r#"{"context": {"diagnostics": []}, "range": "RANGE"}"#),
    ("textDocument/documentLink", "{}"),
    ("textDocument/inlayHint", r#"{"range": "RANGE"}"#),
    ("textDocument/semanticTokens/range", r#"{"range": "RANGE"}"#),
    ("textDocument/semanticTokens/full/delta", r#"{"previousResultId": "KNOWN"}"#),
    ("textDocument/semanticTokens/full", "{}"),
    ("textDocument/formatting", r#"{"options": {"tabSize": 1, "insertSpaces": true}}"#),
];

const FIRST_LETTER: &str = r#"{"position": "FIRST"}"#;

/// No code is compared, and nothing runs.
struct Alone;

impl Compiler for Alone {
    fn code(&self, _: &dyn CheckedProgram, _: Option<(&str, &str)>) -> Option<Vec<u8>> {
        None
    }

    fn mistakes_of_script(&self, _: &std::path::Path, _: &str) -> Vec<Diagnostic> {
        vec![]
    }

    fn open_run(&self, _: &std::path::Path, _: &std::path::Path) -> Result<Box<dyn Run>, String> {
        Err("nothing runs".into())
    }
}

fn main() {
    let rounds = std::env::args().filter_map(|word| word.parse::<usize>().ok()).next_back();
    let rounds = rounds.unwrap_or(100);
    let is_number = |word: &String| word.parse::<usize>().is_ok() || word.starts_with("--");
    let only = std::env::args().skip(1).find(|word| !is_number(word));
    println!("| {LINES} lines | answers | half within | 99 % within | longest |");
    println!("| --- | --- | --- | --- | --- |");
    for (dialect, name, text, line) in [
        (Dialect::Pmi, "a.pmi", pmi(), " V17 = V18"),
        (Dialect::Nct, "a.plc", nct(), "LI012"),
        (Dialect::Pmac, "a.pmc", pmac(), "P17=P18"),
    ] {
        let mut sources = SourceMap::new();
        let file = sources.add(name, text.as_bytes());
        // An NCT of those days takes 64 kB of text.
        let options = Options { limits: Limits::None, ..Options::default() };
        let checked =
            language(dialect).check(&mut sources, &[file], &MemoryLoader::new(), &options).1;
        let error = checked.into_iter().find(Diagnostic::is_error);
        assert!(error.is_none(), "{name}: {error:?}");
        let language = dialect.name();
        let mut editor = Editor::open(language, name, &text);
        let mut rng = Rng::new(1);
        let asked = ASKED.into_iter().map(|asked| (asked, false));
        let waiting = (("textDocument/hover", "{}"), true);
        for ((method, more), waits) in asked.chain([waiting]) {
            if only.as_ref().is_some_and(|only| !method.ends_with(only.as_str())) {
                continue;
            }
            let mut times: Vec<f64> = (0..rounds)
                .map(|_| editor.type_and_ask(&mut rng, line, (method, more), waits))
                .collect();
            times.sort_unstable_by(f64::total_cmp);
            let at = |part: f64| {
                let index = (times.len() as f64 * part) as usize;
                times.get(index.min(times.len() - 1)).copied().unwrap_or(0.0)
            };
            println!(
                "| {language} {}{} | {rounds} | {:.1} ms | {:.1} ms | {:.1} ms |",
                method.trim_start_matches("textDocument/"),
                match (more, waits) {
                    (FIRST_LETTER, _) => " of a letter",
                    (_, true) => " after the problems",
                    _ => "",
                },
                at(0.5),
                at(0.99),
                at(1.0)
            );
        }
    }
}

/// An editor with one document.
struct Editor {
    connection: Connection,
    uri: String,
    version: i32,
    next: i32,
    lines: usize,
    /// The result id of the tokens that were sent last.
    tokens: Value,
}

impl Editor {
    fn open(language: &str, name: &str, text: &str) -> Self {
        let (connection, server) = Connection::memory();
        thread::spawn(move || plcc_lsp::serve(&server, &Alone).unwrap());
        let uri = format!("file:///nowhere/{name}");
        let lines = text.lines().count();
        let mut editor = Self { connection, uri, version: 1, next: 0, lines, tokens: Value::Null };
        let settings = json!({"noLimits": true});
        editor.ask("initialize", json!({"capabilities": {}, "initializationOptions": settings}));
        editor.tell("initialized", json!({}));
        editor.tell(
            "textDocument/didOpen",
            json!({"textDocument": {"uri": editor.uri, "languageId": language, "version": 1, "text": text}}),
        );
        let tokens = json!({"textDocument": {"uri": editor.uri}});
        editor.ask("textDocument/semanticTokens/full", tokens);
        editor
    }

    fn tell(&self, method: &str, params: Value) {
        self.connection.sender.send(Notification::new(method.into(), params).into()).unwrap();
    }

    /// Sends a request and waits for its answer. Gives when that came.
    fn ask(&mut self, method: &str, params: Value) -> Instant {
        self.next += 1;
        let id = RequestId::from(self.next);
        self.connection
            .sender
            .send(Request::new(id.clone(), method.into(), params).into())
            .unwrap();
        loop {
            if let Message::Response(response) = self.connection.receiver.recv().unwrap()
                && response.id == id
            {
                let came = Instant::now();
                match response.response_result {
                    Ok(result) => {
                        result.get("resultId").into_iter().for_each(|id| self.tokens = id.clone());
                    }
                    // A name of the control can't be renamed: that is said.
                    Err(error) => {
                        assert_eq!(error.code, ErrorCode::RequestFailed as i32, "{error:?}");
                    }
                }
                return came;
            }
        }
    }

    fn change(&mut self, line: usize, from: usize, to: usize, text: &str) {
        self.version += 1;
        let range = json!({"start": {"line": line, "character": from}, "end": {"line": line, "character": to}});
        self.tell(
            "textDocument/didChange",
            json!({
                "textDocument": {"uri": self.uri, "version": self.version},
                "contentChanges": [{"range": range, "text": text}],
            }),
        );
    }

    /// Begins a new line at a random place with all but the last character of a statement; then types that and asks. Returns how long
    /// the answer took, in milliseconds. The line is taken out again. With `waits` it asks when the server has begun to
    /// look for problems.
    fn type_and_ask(
        &mut self,
        rng: &mut Rng,
        line: &str,
        (method, more): (&str, &str),
        waits: bool,
    ) -> f64 {
        let at = self.lines / 4 + rng.below(self.lines / 2);
        let (head, last) = line.split_at(line.len() - 1);
        self.change(at, 0, 0, &format!("{head}\n"));
        // As after a pause: what the first change has led to is done.
        let params =
            json!({"textDocument": {"uri": self.uri}, "position": {"line": at, "character": 1}});
        self.ask("textDocument/hover", params);
        let position = |character: usize| json!({"line": at, "character": character});
        let mut params =
            json!({"textDocument": {"uri": self.uri}, "position": position(line.len())});
        let more: Value = serde_json::from_str(more).unwrap();
        for (key, value) in more.as_object().into_iter().flatten() {
            params[key] = match value.as_str() {
                Some("RANGE") => json!({
                    "start": {"line": at.saturating_sub(30), "character": 0},
                    "end": {"line": at + 30, "character": 0},
                }),
                Some("FIRST") => position(line.rfind(char::is_alphabetic).map_or(0, |at| at + 1)),
                Some("KNOWN") => self.tokens.clone(),
                _ => value.clone(),
            };
        }
        let mut began = Instant::now();
        self.change(at, head.len(), head.len(), last);
        if waits {
            thread::sleep(std::time::Duration::from_millis(1));
            began = Instant::now();
        }
        let took = self.ask(method, params).duration_since(began).as_secs_f64() * 1e3;
        self.version += 1;
        let range =
            json!({"start": {"line": at, "character": 0}, "end": {"line": at + 1, "character": 0}});
        self.tell(
            "textDocument/didChange",
            json!({
                "textDocument": {"uri": self.uri, "version": self.version},
                "contentChanges": [{"range": range, "text": ""}],
            }),
        );
        took
    }
}

fn pmi() -> String {
    let mut text = String::from("$INPUT\n");
    for n in 0..64 {
        let _ = writeln!(text, "LS{n} = {}/{} ? limit switch {n}", n / 8, n % 8);
    }
    text.push_str("$OUTPUT\n");
    for n in 0..64 {
        let _ = writeln!(text, "SOL{n} = {}/{}", 8 + n / 8, n % 8);
    }
    text.push_str("$LOGICAL\n");
    for n in 0..1000 {
        let _ = writeln!(text, "V{n} ? flag {n}");
    }
    text.push_str("$END\n");
    let mut n = text.lines().count();
    while n < LINES {
        let (a, b, c) = (n % 1000, n * 7 % 1000, n % 64);
        let _ = writeln!(text, "IF (V{a} & /LS{c})");
        let _ = writeln!(text, " V{b} = LS{c} ! V{a} & /V{}", (a + 1) % 1000);
        let _ = writeln!(text, " SOL{c} = V{b} & /V{a} ? valve {c}");
        text.push_str("ENDIF\n");
        n += 4;
    }
    text
}

fn nct() -> String {
    let mut text = String::from(":000\nJ0\n:001\n");
    let mut n = 4;
    while n < LINES {
        let (a, b, c) = (n % 500, n * 7 % 500, n / 5 % 8);
        let _ = writeln!(text, "(I01{c}ANF{:03}{c}) U01{c}; line {n}", a % 100);
        text.push_str(" E\n");
        let _ = writeln!(text, " D03{c} LRH{:03} +20 SRH{:03}", a % 100, 50 + b % 50);
        let _ = writeln!(text, " LF{:03}{c} SF{:03}{c}", a % 100, b % 100);
        text.push_str("Z\n");
        n += 5;
    }
    text.push_str("J1\n");
    text
}

fn pmac() -> String {
    let mut text = String::from("#define DOOR M1\n#define LIMIT 20\n");
    for n in 0..64 {
        let _ = writeln!(text, "M{n}->Y:$FFC2,{}", n % 24);
    }
    let mut n = text.lines().count();
    for plc in 1..=20 {
        let _ = writeln!(text, "OPEN PLC {plc} CLEAR");
        for _ in 0..LINES / 100 {
            let (a, b, c) = (n % 1000, n * 7 % 1000, n % 64);
            let _ = writeln!(text, "IF (P{a}<LIMIT AND DOOR=1) ; step {n}");
            let _ = writeln!(text, "P{b}=P{a}*3+Q{}", a % 100);
            let _ = writeln!(text, "M{c}=1");
            let _ = writeln!(text, "P{a}=SIN(P{b})%360");
            text.push_str("ENDIF\n");
            n += 5;
        }
        text.push_str("CLOSE\n");
    }
    text
}
