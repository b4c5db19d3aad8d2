//! The server as an editor meets it, over a connection in memory.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use std::collections::BTreeMap;
use std::path::Path;
use std::thread::{self, JoinHandle};

use lsp_server::{Connection, Message, Notification, Request, RequestId};
use plcc_diag::{Diagnostic, FileId, Span};
use plcc_frontend::CheckedProgram;
use plcc_lsp::{Compiler, Run};
use serde_json::{Value, json};

/// Compares what lowering makes.
struct Lowering;

impl Compiler for Lowering {
    fn code(&self, program: &dyn CheckedProgram, _: Option<(&str, &str)>) -> Option<Vec<u8>> {
        let module = program.lower().ok()?.module;
        let lengths = module.funcs.iter().map(|it| format!("{it:?}").len());
        Some(lengths.flat_map(usize::to_le_bytes).collect())
    }

    /// Says that each script has a mistake in its second line.
    fn mistakes_of_script(&self, path: &Path, text: &str) -> Vec<Diagnostic> {
        assert_eq!(path, Path::new("/nowhere/x.plctest"));
        let start = text.find('\n').unwrap() + 1;
        vec![Diagnostic::error("TEST-1", Span::new(FileId(0), start, text.len()), "no statement")]
    }

    fn open_run(&self, path: &Path, _: &Path) -> Result<Box<dyn Run>, String> {
        if path == Path::new("/nowhere/cell.record") {
            return Ok(Box::new(Counting));
        }
        Err(format!("{}: there is none", path.display()))
    }
}

/// A run of ticks 5 to 900 in which each variable but DOOR has the number of the tick.
struct Counting;

impl Run for Counting {
    fn ticks(&mut self) -> Result<(u64, u64), String> {
        Ok((5, 900))
    }

    fn values(
        &mut self,
        tick: u64,
        names: &[String],
    ) -> Result<BTreeMap<String, plcc_lsp::Value>, String> {
        let names = names.iter().filter(|name| *name != "DOOR");
        let value = |name: &String| {
            let (text, is_forced) = (tick.to_string(), name == "PUMP");
            let forced = is_forced.then(|| "0".to_owned());
            let note = is_forced.then(|| "PUMP is forced by ann".to_owned());
            (name.clone(), plcc_lsp::Value { text, forced, note })
        };
        Ok(names.map(value).collect())
    }

    fn change(&mut self, name: &str, value: Option<&str>, force: bool) -> Result<u64, String> {
        if name == "LAMP" { Ok(901) } else { Err(format!("{name}, {value:?}, {force}")) }
    }

    fn why(&mut self, tick: u64, name: &str) -> Result<String, String> {
        if name == "LAMP" { Ok(format!("by {tick}")) } else { Err(format!("nothing is {name}")) }
    }
}

/// An editor.
struct Editor {
    connection: Connection,
    server: Option<JoinHandle<()>>,
    next: i32,
    /// The problems of each document that were told last.
    problems: std::collections::HashMap<String, Vec<Value>>,
    capabilities: Value,
    /// Answers that came while another one was waited for.
    answers: Vec<lsp_server::Response>,
}

impl Editor {
    fn new() -> Self {
        let (connection, server) = Connection::memory();
        let server = thread::spawn(move || {
            plcc_lsp::serve(&server, &Lowering).unwrap();
        });
        let mut editor = Self {
            connection,
            server: Some(server),
            next: 0,
            problems: std::collections::HashMap::new(),
            capabilities: Value::Null,
            answers: vec![],
        };
        let result = editor.ask("initialize", json!({"capabilities": {}})).unwrap();
        editor.capabilities = result["capabilities"].clone();
        editor.tell("initialized", json!({}));
        editor
    }

    fn tell(&self, method: &str, params: Value) {
        self.connection.sender.send(Notification::new(method.into(), params).into()).unwrap();
    }

    fn send(&mut self, method: &str, params: Value) -> RequestId {
        self.next += 1;
        let id = RequestId::from(self.next);
        self.connection
            .sender
            .send(Request::new(id.clone(), method.into(), params).into())
            .unwrap();
        id
    }

    /// Waits for the answer of a request; notes problems that come meanwhile.
    fn answer(&mut self, id: &RequestId) -> Result<Value, (i32, String)> {
        loop {
            if let Some(at) = self.answers.iter().position(|it| it.id == *id) {
                let value = serde_json::to_value(self.answers.remove(at)).unwrap();
                if let Some(error) = value.get("error").filter(|it| !it.is_null()) {
                    let code = error["code"].as_i64().unwrap() as i32;
                    return Err((code, error["message"].as_str().unwrap().to_owned()));
                }
                return Ok(value["result"].clone());
            }
            match self.connection.receiver.recv().unwrap() {
                Message::Response(response) => self.answers.push(response),
                Message::Notification(note) if note.method == "textDocument/publishDiagnostics" => {
                    let uri = note.params["uri"].as_str().unwrap().to_owned();
                    let found = note.params["diagnostics"].as_array().unwrap().clone();
                    self.problems.insert(uri, found);
                }
                other => panic!("unexpected: {other:?}"),
            }
        }
    }

    fn ask(&mut self, method: &str, params: Value) -> Result<Value, (i32, String)> {
        let id = self.send(method, params);
        self.answer(&id)
    }

    fn open(&self, uri: &str, language: &str, text: &str) {
        self.tell(
            "textDocument/didOpen",
            json!({"textDocument": {"uri": uri, "languageId": language, "version": 1, "text": text}}),
        );
    }

    fn change(&self, uri: &str, version: i32, range: Value, text: &str) {
        let change = if range.is_null() {
            json!({"text": text})
        } else {
            json!({"range": range, "text": text})
        };
        self.tell(
            "textDocument/didChange",
            json!({"textDocument": {"uri": uri, "version": version}, "contentChanges": [change]}),
        );
    }

    /// The codes of a document's problems, once they have been told.
    fn codes(&mut self, uri: &str) -> Vec<String> {
        self.problems.remove(uri);
        while !self.problems.contains_key(uri) {
            let Message::Notification(note) = self.connection.receiver.recv().unwrap() else {
                continue;
            };
            if note.method == "textDocument/publishDiagnostics" {
                let about = note.params["uri"].as_str().unwrap().to_owned();
                self.problems.insert(about, note.params["diagnostics"].as_array().unwrap().clone());
            }
        }
        let codes = self.problems[uri].iter().map(|it| it["code"].as_str().unwrap().to_owned());
        codes.collect()
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        if thread::panicking() {
            return;
        }
        // Both at once, as some editors do.
        let id = self.send("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        let _ = self.answer(&id);
        self.server.take().unwrap().join().unwrap();
    }
}

const PMI: &str = "file:///nowhere/a.pmi";
const TEXT: &str = "$INPUT\nDOOR = 1/0 ? closed\n$OUTPUT\nLAMP = 2/0\n$END\nLAMP = DOOR\n";

fn about(uri: &str, line: u32, character: u32) -> Value {
    json!({"textDocument": {"uri": uri}, "position": {"line": line, "character": character}})
}

#[test]
fn problems_follow_the_text() {
    let mut editor = Editor::new();
    editor.open(PMI, "pmi", TEXT);
    assert_eq!(editor.codes(PMI), [""; 0]);
    let range = json!({"start": {"line": 5, "character": 7}, "end": {"line": 5, "character": 11}});
    editor.change(PMI, 2, range, "DOR");
    assert_eq!(editor.codes(PMI), ["PMI-31"]);
    let whole = json!({"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}});
    let context = json!({"diagnostics": []});
    let fixes = editor
        .ask(
            "textDocument/codeAction",
            json!({"textDocument": {"uri": PMI}, "range": whole, "context": context}),
        )
        .unwrap();
    assert_eq!(fixes[0]["title"], "Write DOOR");
    assert_eq!(fixes[0]["edit"]["changes"][PMI][0]["newText"], "DOOR");
    editor.change(PMI, 3, Value::Null, TEXT);
    assert_eq!(editor.codes(PMI), [""; 0]);
}

/// What an editor knows of the problems when it asks for fixes, and when it asks, makes no difference: fixes are of the text as it is.
#[test]
fn fixes_are_of_the_present_text() {
    let mut editor = Editor::new();
    let ask = |editor: &mut Editor, from: u32, to: u32, known: Value| {
        let at = |character: u32| json!({"line": 5, "character": character});
        let range = json!({"start": at(from), "end": at(to)});
        let context = json!({"diagnostics": known, "only": ["quickfix"], "triggerKind": 1});
        let params = json!({"textDocument": {"uri": PMI}, "range": range, "context": context});
        editor.send("textDocument/codeAction", params)
    };
    let titles = |editor: &mut Editor, id: &RequestId| {
        let found = editor.answer(id).map(|it| it.as_array().cloned().unwrap_or_default());
        let title = |it: &Value| it["title"].as_str().unwrap().to_owned();
        found.map(|it| it.iter().map(title).collect::<Vec<_>>())
    };
    let fix = Ok(vec!["Write DOOR".to_owned()]);
    // At once, before any problem has been told, at each place of the word, both its ends among them, and in the whole of it.
    editor.open(PMI, "pmi", &TEXT.replace("= DOOR", "= DOR"));
    for (from, to) in [(7, 7), (8, 8), (10, 10), (7, 10), (0, 10)] {
        let asked = ask(&mut editor, from, to, json!([]));
        assert_eq!(titles(&mut editor, &asked), fix, "{from} to {to}");
    }
    let asked = ask(&mut editor, 3, 3, json!([]));
    assert_eq!(titles(&mut editor, &asked), Ok(vec![]));
    // Right after a change, with a problem of the text before.
    let old = json!([{
        "range": {"start": {"line": 5, "character": 7}, "end": {"line": 5, "character": 10}},
        "message": "nothing is named DOR", "code": "PMI-31", "source": "plcc",
    }]);
    let word = |to: u32| json!({"start": {"line": 5, "character": 7}, "end": {"line": 5, "character": to}});
    editor.change(PMI, 2, word(10), "DOORR");
    let asked = ask(&mut editor, 12, 12, old.clone());
    assert_eq!(titles(&mut editor, &asked), fix);
    editor.change(PMI, 3, word(12), "DOOR");
    let asked = ask(&mut editor, 8, 8, old.clone());
    assert_eq!(titles(&mut editor, &asked), Ok(vec![]));
    // With a change after it, the answer is of the text before, or says that there is another text.
    editor.change(PMI, 4, word(11), "DOO");
    let first = ask(&mut editor, 8, 8, json!([]));
    editor.change(PMI, 5, word(10), "DOOR");
    let last = ask(&mut editor, 8, 8, old);
    let found = titles(&mut editor, &first);
    assert!(found == fix || found.as_ref().is_err_and(|(code, _)| *code == -32801), "{found:?}");
    assert_eq!(titles(&mut editor, &last), Ok(vec![]));
}

#[test]
fn included_files_are_read_as_they_are_in_the_editor() {
    let folder = std::env::temp_dir().join(format!("plcc-lsp-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("main.pmi"), "$INCLUDE NAMES.PMI\n$END\nLAMP = DOOR\n").unwrap();
    std::fs::write(folder.join("names.pmi"), "$INPUT\nDOOR = 1/0\n").unwrap();
    let uri = |name: &str| format!("file://{}/{name}", folder.display());
    let mut editor = Editor::new();
    // The file that is included has no $END: its program is the one that includes it.
    editor.open(&uri("names.pmi"), "pmi", "$INPUT\nDOOR = 1/0 ? closed\n");
    assert_eq!(editor.codes(&uri("names.pmi")), [""; 0]);
    let places = editor
        .ask("textDocument/references", {
            let mut params = about(&uri("names.pmi"), 1, 1);
            params["context"] = json!({"includeDeclaration": false});
            params
        })
        .unwrap();
    assert_eq!(places[0]["uri"], uri("main.pmi"));
    editor.change(&uri("names.pmi"), 2, Value::Null, "$INPUT\nGATE = 1/0\n");
    assert_eq!(editor.codes(&uri("main.pmi")), ["PMI-31"]);
    drop(editor);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn what_is_cancelled_or_old_is_answered_so() {
    let mut editor = Editor::new();
    // Long enough that the messages after it have come before it has been read.
    let long: String =
        (0..20_000).map(|n| format!("V{} = V{} & A\n", n % 1000, (n + 1) % 1000)).collect();
    editor.open(PMI, "pmi", &format!("$LOGICAL\nA\n$END\n{long}"));
    let first = editor.send("textDocument/hover", about(PMI, 5, 1));
    let cancelled = editor.send("textDocument/hover", about(PMI, 5, 1));
    let Value::Number(id) = serde_json::to_value(&cancelled).unwrap() else { panic!() };
    editor.tell("$/cancelRequest", json!({"id": id}));
    let old = editor.send("textDocument/hover", about(PMI, 5, 1));
    editor.change(PMI, 2, Value::Null, TEXT);
    let last = editor.send("textDocument/hover", about(PMI, 5, 1));
    let codes = |answer: Result<Value, (i32, String)>| answer.err().map(|(code, _)| code);
    // The first may have been begun before the change came; each other answer is what the order of messages says.
    let _ = editor.answer(&first);
    let cancelled = codes(editor.answer(&cancelled));
    assert!(cancelled.is_none() || cancelled == Some(-32800), "{cancelled:?}");
    let old = codes(editor.answer(&old));
    assert!(old.is_none() || old == Some(-32801), "{old:?}");
    let hover = editor.answer(&last).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().starts_with("**LAMP**"));
}

#[test]
fn every_capability_is_answered() {
    let mut editor = Editor::new();
    editor.open(PMI, "pmi", TEXT);
    let document = json!({"textDocument": {"uri": PMI}});
    let mut with = |method: &str, more: Value| {
        let mut params = about(PMI, 5, 8);
        params.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        editor.ask(method, params)
    };
    let range = json!({"start": {"line": 0, "character": 0}, "end": {"line": 9, "character": 0}});
    let asked = [
        ("hoverProvider", "textDocument/hover", json!({})),
        ("completionProvider", "textDocument/completion", json!({})),
        ("signatureHelpProvider", "textDocument/signatureHelp", json!({})),
        ("declarationProvider", "textDocument/declaration", json!({})),
        ("definitionProvider", "textDocument/definition", json!({})),
        (
            "referencesProvider",
            "textDocument/references",
            json!({"context": {"includeDeclaration": true}}),
        ),
        ("documentHighlightProvider", "textDocument/documentHighlight", json!({})),
        ("documentSymbolProvider", "textDocument/documentSymbol", json!({})),
        ("workspaceSymbolProvider", "workspace/symbol", json!({"query": "do"})),
        (
            "codeActionProvider",
            "textDocument/codeAction",
            json!({"range": range, "context": {"diagnostics": []}}),
        ),
        ("codeLensProvider", "textDocument/codeLens", json!({})),
        ("documentLinkProvider", "textDocument/documentLink", json!({})),
        (
            "documentFormattingProvider",
            "textDocument/formatting",
            json!({"options": {"tabSize": 2, "insertSpaces": true}}),
        ),
        ("renameProvider", "textDocument/rename", json!({"newName": "GATE"})),
        ("foldingRangeProvider", "textDocument/foldingRange", json!({})),
        (
            "selectionRangeProvider",
            "textDocument/selectionRange",
            json!({"positions": [{"line": 5, "character": 8}]}),
        ),
        ("callHierarchyProvider", "textDocument/prepareCallHierarchy", json!({})),
        ("semanticTokensProvider", "textDocument/semanticTokens/full", json!({})),
        (
            "semanticTokensProvider",
            "textDocument/semanticTokens/full/delta",
            json!({"previousResultId": "0"}),
        ),
        (
            "inlineValueProvider",
            "textDocument/inlineValue",
            json!({"range": range, "context": {"frameId": 1, "stoppedLocation": range}}),
        ),
        ("inlayHintProvider", "textDocument/inlayHint", json!({"range": range})),
    ];
    for (_, method, more) in &asked {
        let answer = with(method, more.clone());
        assert!(answer.is_ok(), "{method}: {answer:?}");
    }
    // None is promised that is not asked here.
    for (capability, _) in editor.capabilities.as_object().unwrap() {
        let is_request = capability.ends_with("Provider");
        assert!(!is_request || asked.iter().any(|(known, ..)| known == capability), "{capability}");
    }
    let (code, _) = editor.ask("textDocument/noSuchThing", document).unwrap_err();
    assert_eq!(code, -32601);
    let (code, _) = editor.ask("textDocument/hover", json!({"position": 7})).unwrap_err();
    assert_eq!(code, -32602);
}

#[test]
fn test_scripts_have_problems_names_and_statements() {
    let mut editor = Editor::new();
    let uri = "file:///nowhere/x.plctest";
    editor.open("file:///nowhere/x.pmi", "pmi", "$INPUT\nDOOR = 1/0 ? the door\n$END\nL = DOOR\n");
    editor.open(uri, "plctest", "program \"x.pmi\"\n  set DO\n");
    assert_eq!(editor.codes(uri), ["TEST-1"]);
    let names = editor.ask("textDocument/completion", about(uri, 1, 8)).unwrap();
    assert_eq!(names[0]["label"], "DOOR");
    let hover = editor.ask("textDocument/hover", about(uri, 1, 3)).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().contains("set NAME = VALUE"));
}

#[test]
fn pages_of_diagnostics_can_be_asked_for() {
    let mut editor = Editor::new();
    let page = editor.ask("plcc/explain", json!({"code": "PMI-31"})).unwrap();
    assert!(page.as_str().unwrap().starts_with("# PMI-31"));
    assert!(editor.ask("plcc/explain", json!({"code": "X"})).is_err());
}

#[test]
fn values_of_a_run_stand_behind_names() {
    let mut editor = Editor::new();
    let uri = "file:///nowhere/x.pmi";
    let text =
        "$INPUT\nDOOR = 1/0\n$OUTPUT\nLAMP = 2/0\nPUMP = 2/1\n$END\nLAMP = DOOR\n\nPUMP = T\n";
    editor.open(uri, "pmi", text);
    let document = json!({"uri": uri});
    let range = json!({"start": {"line": 6, "character": 0}, "end": {"line": 7, "character": 0}});
    let labels = |editor: &mut Editor| {
        let hints = json!({"textDocument": {"uri": uri}, "range": range});
        let hints = editor.ask("textDocument/inlayHint", hints).unwrap();
        let hints = hints.as_array().unwrap().iter();
        hints.map(|it| it["label"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(labels(&mut editor), ["2/0", "1/0"]);
    let show = |editor: &mut Editor, run: &str, tick: Value| {
        let wanted = json!({"textDocument": document, "run": run, "tick": tick});
        editor.ask("plcc/showValues", wanted)
    };
    let (_, why) = show(&mut editor, "none.record", Value::Null).unwrap_err();
    assert_eq!(why, "/nowhere/none.record: there is none");
    assert!(editor.ask("plcc/change", json!({"name": "LAMP", "value": "1"})).is_err());
    let shown = show(&mut editor, "cell.record", Value::Null).unwrap();
    assert_eq!(shown, json!({"tick": 900, "first": 5, "last": 900}));
    assert_eq!(labels(&mut editor), ["= 900"]);
    // What is forced has both values.
    let range = json!({"start": {"line": 8, "character": 0}, "end": {"line": 9, "character": 0}});
    let hints = json!({"textDocument": document, "range": range});
    let hints = editor.ask("textDocument/inlayHint", hints).unwrap();
    assert_eq!(hints[0]["label"], "= 900 (forced 0)");
    assert_eq!(hints[0]["tooltip"], "PUMP at the end of tick 900; PUMP is forced by ann");
    assert_eq!(show(&mut editor, "cell.record", json!(7)).unwrap()["tick"], 7);
    assert_eq!(labels(&mut editor), ["= 7"]);
    let (_, why) = show(&mut editor, "cell.record", json!(4)).unwrap_err();
    assert_eq!(why, "tick 4 can't be shown: 5 to 900 can");
    assert_eq!(labels(&mut editor), ["= 7"]);
    show(&mut editor, "none.record", Value::Null).unwrap_err();
    assert_eq!(labels(&mut editor), ["= 7"], "what can't be opened takes nothing away");
    assert_eq!(editor.ask("plcc/why", json!({"name": "LAMP"})), Ok(json!({"text": "by 7"})));
    assert_eq!(editor.ask("plcc/why", json!({"name": "X"})).unwrap_err().1, "nothing is X");
    // What the program writes has a lens that asks.
    let lenses = |editor: &mut Editor| {
        let found = editor.ask("textDocument/codeLens", json!({"textDocument": document})).unwrap();
        let commands = found.as_array().unwrap().iter().map(|it| it["command"].clone());
        commands.filter(|it| it["command"] == "plcc.why").collect::<Vec<_>>()
    };
    let of_outputs = lenses(&mut editor);
    let why = |name: &str| json!({"title": "why?", "command": "plcc.why", "arguments": [name]});
    assert_eq!(of_outputs, [why("LAMP"), why("PUMP")]);
    let change = editor.ask("plcc/change", json!({"name": "LAMP", "value": "1", "force": true}));
    assert_eq!(change.unwrap(), json!({"tick": 901}));
    let (_, why) = editor.ask("plcc/change", json!({"name": "DOOR"})).unwrap_err();
    assert_eq!(why, "DOOR, None, false");
    editor.ask("plcc/hideValues", json!({})).unwrap();
    assert_eq!(labels(&mut editor), ["2/0", "1/0"]);
    assert_eq!(lenses(&mut editor), Vec::<Value>::new());
    assert!(editor.ask("plcc/why", json!({"name": "LAMP"})).is_err());
}

/// Pseudo-random numbers, the same in each run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, limit: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % limit.max(1)
    }
}

/// What an editor asks that depends on the text alone.
fn asked(editor: &mut Editor, uri: &str, at: (u32, u32)) -> Vec<Result<Value, (i32, String)>> {
    let document = json!({"textDocument": {"uri": uri}});
    let range =
        json!({"start": {"line": 0, "character": 0}, "end": {"line": at.0, "character": at.1}});
    vec![
        editor.ask("textDocument/hover", about(uri, at.0, at.1)),
        editor.ask("textDocument/completion", about(uri, at.0, at.1)),
        editor.ask("textDocument/definition", about(uri, at.0, at.1)),
        editor.ask("textDocument/documentSymbol", document.clone()),
        editor.ask("textDocument/semanticTokens/full", document.clone()),
        editor.ask("textDocument/foldingRange", document.clone()),
        editor.ask("textDocument/codeAction", {
            let mut params = document;
            params["range"] = range;
            params["context"] = json!({"diagnostics": []});
            params
        }),
    ]
}

/// Edits at random places with requests in between: no panic, and the answers of a server that has never seen another text. From
/// time to time the whole text becomes the first one again, since a few dozen edits leave little of a program.
/// The environment variable PLCC_EDITS says how many edits are made in each language.
#[test]
fn answers_depend_on_the_text_alone() {
    let texts = [
        (
            "pmi",
            "$INPUT\nA = 1/0 ? é\n$TIMER\nE/TC/DC = 5\n$END\nIF A # x\n & DC\nTC = /A\nELSE\nL: B = A\nENDIF\n",
        ),
        (
            "nct",
            ":001 ;x\n(I012ANF0103) U012 E D012 Z /* y */ LRH005 +,20 SF020 C003 J1\n:003 R\n:198 $A$\n:000 J0\n",
        ),
        (
            "pmac",
            "#define D M11 // d\nM11->Y:$FFC2,0\nI5=2\nOPEN PLC 1 CLEAR\nWHILE (D=1 AND P1<$1F)\nP1=P1+1\nENDW\nCMD\"J/\"\nCLOSE\n",
        ),
    ];
    let pieces = [
        "",
        "\n",
        "A",
        "é",
        "𝄞",
        "\"",
        "/*",
        "*/",
        "?",
        ";",
        "#",
        "$END\n",
        "IF ",
        "ENDIF",
        ":005 ",
        "(",
        "P1=",
        "OPEN PLC 2 ",
        "12",
        "\r\n",
        " ",
    ];
    let edits = std::env::var("PLCC_EDITS").map_or(150, |count| count.parse().unwrap());
    let mut numbers = Numbers(7);
    for (language, program) in texts {
        let uri = format!("file:///nowhere/x.{language}");
        let mut text = program.to_owned();
        let mut editor = Editor::new();
        editor.open(&uri, language, &text);
        for version in 2..edits {
            let line = numbers.below(text.lines().count() + 2) as u32;
            let (from, length) = (numbers.below(30) as u32, numbers.below(4) as u32);
            let range = json!({
                "start": {"line": line, "character": from},
                "end": {"line": line + u32::from(length == 3), "character": from + length},
            });
            let piece = pieces[numbers.below(pieces.len())];
            if version % 40 == 0 {
                editor.change(&uri, version, Value::Null, program);
                text = program.to_owned();
            } else {
                editor.change(&uri, version, range.clone(), piece);
                text = edited(&text, &range, piece);
            }
            let at = (numbers.below(12) as u32, numbers.below(20) as u32);
            let answers = asked(&mut editor, &uri, at);
            if version % 10 == 3 {
                let mut fresh = Editor::new();
                fresh.open(&uri, language, &text);
                assert_eq!(answers, asked(&mut fresh, &uri, at), "{text:?}");
            }
            for answer in &answers {
                assert!(
                    answer.as_ref().err().is_none_or(|(code, _)| *code != -32603),
                    "{answer:?}: {text:?}"
                );
            }
        }
    }
}

/// A text with an edit, by another way than the server's.
fn edited(text: &str, range: &Value, piece: &str) -> String {
    let units: Vec<u16> = text.encode_utf16().collect();
    let offset = |at: &Value| {
        let (mut line, mut start) = (at["line"].as_u64().unwrap(), 0);
        while line > 0 {
            let rest = &units[start..];
            let Some(end) = rest.iter().position(|&u| u == 10 || u == 13) else {
                return units.len();
            };
            let pair = rest[end] == 13 && rest.get(end + 1) == Some(&10);
            start += end + 1 + usize::from(pair);
            line -= 1;
        }
        let rest = &units[start..];
        let length = rest.iter().position(|&u| u == 10 || u == 13).unwrap_or(rest.len());
        let mut at = start + (at["character"].as_u64().unwrap() as usize).min(length);
        // Not inside a character of two units.
        if units.get(at).is_some_and(|u| (0xDC00..0xE000).contains(u)) {
            at -= 1;
        }
        at
    };
    let (start, end) = (offset(&range["start"]), offset(&range["end"]));
    let end = end.max(start);
    let mut all = units[..start].to_vec();
    all.extend(piece.encode_utf16());
    all.extend(&units[end..]);
    String::from_utf16(&all).unwrap()
}
