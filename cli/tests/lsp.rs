//! `plcc lsp` over its standard input and output, as an editor talks to it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// An editor that talks to the program.
struct Editor {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    next: u64,
}

impl Editor {
    fn start() -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_plcc"))
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (to, from) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let mut editor = Self { child, to, from: BufReader::new(from), next: 0 };
        let result = editor.ask("initialize", json!({"capabilities": {}}));
        assert_eq!(result["serverInfo"]["name"], "plcc");
        editor.tell("initialized", json!({}));
        editor
    }

    fn send(&mut self, message: &Value) {
        let text = message.to_string();
        write!(self.to, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        self.to.flush().unwrap();
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({"jsonrpc": "2.0", "method": method, "params": params}));
    }

    fn receive(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            self.from.read_line(&mut line).unwrap();
            match line.trim().strip_prefix("Content-Length: ") {
                Some(number) => length = number.parse().unwrap(),
                None if line.trim().is_empty() => break,
                None => {}
            }
        }
        let mut bytes = vec![0; length];
        self.from.read_exact(&mut bytes).unwrap();
        serde_json::from_slice(&bytes).unwrap()
    }

    /// The result of a request; other messages are passed over.
    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let id = self.next;
        self.send(&json!({"jsonrpc": "2.0", "id": id, "method": method, "params": params}));
        loop {
            let message = self.receive();
            if message["id"] == id {
                assert!(message["error"].is_null(), "{message}");
                return message["result"].clone();
            }
        }
    }

    /// The hints in a document from a line on.
    fn labels(&mut self, uri: &str, line: u32) -> Vec<String> {
        let place = |line: u32| json!({"line": line, "character": 0});
        let range = json!({"start": place(line), "end": place(1000)});
        let hints = json!({"textDocument": {"uri": uri}, "range": range});
        let hints = self.ask("textDocument/inlayHint", hints);
        let hints = hints.as_array().unwrap().iter();
        hints.map(|it| it["label"].as_str().unwrap().to_owned()).collect()
    }

    /// Says goodbye, and gives the exit status.
    fn leave(mut self) -> Option<i32> {
        self.ask("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        self.child.wait().unwrap().code()
    }
}

/// A name is changed in all its places, and the program is compiled to see that it stays the same.
#[test]
fn a_name_is_changed_where_the_machine_code_stays() {
    let text = "$INPUT\nDOOR = 1/0\nKEY1 = 1/1\n$OUTPUT\nLAMP = 2/0\nMOTOR = 2/1\n$INTEGER\nM, N\n$END\nLAMP = DOOR & KEY1\n\
                MOTOR = LAMP & /DOOR\nN = N + 1\nIF (N > 5)\nN = 0\nENDIF\nM = N * 3\n";
    let mut editor = Editor::start();
    let uri = "file:///nowhere/a.pmi";
    editor.tell(
        "textDocument/didOpen",
        json!({"textDocument": {"uri": uri, "languageId": "pmi", "version": 1, "text": text}}),
    );
    let place = json!({"textDocument": {"uri": uri}, "position": {"line": 9, "character": 8}});
    let hover = editor.ask("textDocument/hover", place.clone());
    assert!(hover["contents"]["value"].as_str().unwrap().contains("port 1, bit 0"), "{hover}");
    let mut params = place;
    // A name that comes last in the alphabet, so that an order by names would change the program.
    params["newName"] = json!("ZZZ");
    let edit = editor.ask("textDocument/rename", params.clone());
    let edits = edit["changes"][uri].as_array().unwrap();
    assert_eq!(edits.len(), 3);
    // Variables lie in the order of their names, so that M and N exchange their places.
    params["position"] = json!({"line": 15, "character": 0});
    let edit = editor.ask("textDocument/rename", params);
    assert_eq!(edit["changes"][uri].as_array().map(Vec::len), Some(2), "{edit}");
    assert_eq!(editor.leave(), Some(0));
}

/// The values of a record stand beside the names, of any tick of it.
#[test]
fn values_of_a_record_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = "$INTEGER\nN, M\n$END\nN = N + 1\nM = N * 2\n";
    std::fs::write(path("a.pmi"), text).unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_plcc"))
        .args(["run", &path("a.pmi"), "--ticks", "50", "--record", &path("a.plcrec")])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let mut editor = Editor::start();
    let uri = format!("file://{}", path("a.pmi"));
    editor.tell(
        "textDocument/didOpen",
        json!({"textDocument": {"uri": uri, "languageId": "pmi", "version": 1, "text": text}}),
    );
    for (tick, shown, values) in [
        (Value::Null, 49, ["= 50", "= 50", "= 100", "= 50"]),
        (json!(7), 7, ["= 8", "= 8", "= 16", "= 8"]),
    ] {
        let wanted = json!({"textDocument": {"uri": uri}, "run": "a.plcrec", "tick": tick});
        let answer = editor.ask("plcc/showValues", wanted);
        assert_eq!(answer, json!({"tick": shown, "first": 0, "last": 49}));
        assert_eq!(editor.labels(&uri, 3), values);
    }
    let why = editor.ask("plcc/why", json!({"name": "M"}));
    let text = why["text"].as_str().unwrap();
    assert!(text.starts_with("M has been 16 since tick 7 (0.14 s), because N is 8.\n"), "{text}");
    assert_eq!(editor.leave(), Some(0));
}

/// A control that is ended with the test.
struct Control(Child);

impl Drop for Control {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The values of a running control stand beside the names, and it is changed from the editor.
#[test]
fn values_of_a_running_control_are_shown_and_changed() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = "$INTEGER\nN, M, A[2]\n$END\nM = N * 2\nA[0] = M\n";
    std::fs::write(path("a.pmi"), text).unwrap();
    let mut control = Command::new(env!("CARGO_BIN_EXE_plcc"));
    control.args(["run", &path("a.pmi"), "--realtime", "--socket", &path("a.sock")]);
    let control = control.args(["--allow", "write"]).stderr(Stdio::null()).spawn();
    let _control = Control(control.unwrap());
    let mut editor = Editor::start();
    let uri = format!("file://{}", path("a.pmi"));
    editor.tell(
        "textDocument/didOpen",
        json!({"textDocument": {"uri": uri, "languageId": "pmi", "version": 1, "text": text}}),
    );
    while UnixStream::connect(path("a.sock")).is_err() {
        std::thread::sleep(Duration::from_millis(10));
    }
    let shown = json!({"textDocument": {"uri": uri}, "run": "a.sock"});
    let answer = editor.ask("plcc/showValues", shown);
    assert_eq!(answer["first"], answer["last"], "of a control there is the present alone");
    // An array as a whole has no value.
    assert_eq!(editor.labels(&uri, 3), ["= 0", "= 0", "= 0"]);
    editor.ask("plcc/change", json!({"name": "N", "value": "21"}));
    let until = Instant::now() + Duration::from_secs(60);
    while editor.labels(&uri, 3) != ["= 42", "= 21", "= 42"] {
        assert!(Instant::now() < until, "{:?}", editor.labels(&uri, 3));
    }
    let why = editor.ask("plcc/why", json!({"name": "M"}));
    let text = why["text"].as_str().unwrap();
    assert!(text.starts_with("M is 42 now, because N is 21.\n"), "{text}");
}

/// Where a force holds an output, the program's value and the forced one are shown, of a control and of its record.
#[test]
fn forced_values_stand_beside_those_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let text = "$OUTPUT\nLAMP = 2/0\n$END\nLAMP = T\n";
    std::fs::write(path("a.pmi"), text).unwrap();
    let mut control = Command::new(env!("CARGO_BIN_EXE_plcc"));
    control.args(["run", &path("a.pmi"), "--realtime", "--socket", &path("a.sock")]);
    control.args(["--record", &path("a.plcrec")]);
    let control = control.args(["--allow", "force"]).stderr(Stdio::null()).spawn();
    let control = Control(control.unwrap());
    let mut editor = Editor::start();
    let uri = format!("file://{}", path("a.pmi"));
    editor.tell(
        "textDocument/didOpen",
        json!({"textDocument": {"uri": uri, "languageId": "pmi", "version": 1, "text": text}}),
    );
    while UnixStream::connect(path("a.sock")).is_err() {
        std::thread::sleep(Duration::from_millis(10));
    }
    editor.ask("plcc/showValues", json!({"textDocument": {"uri": uri}, "run": "a.sock"}));
    assert_eq!(editor.labels(&uri, 3), ["= 1"]);
    let force = |value: Value| json!({"name": "LAMP", "value": value, "force": true});
    let forced = editor.ask("plcc/change", force(json!("0")))["tick"].as_u64().unwrap();
    let wait = |editor: &mut Editor, label: &str| {
        let until = Instant::now() + Duration::from_secs(60);
        while editor.labels(&uri, 3) != [label] {
            assert!(Instant::now() < until, "{:?}", editor.labels(&uri, 3));
        }
    };
    wait(&mut editor, "= 1 (forced 0)");
    let ended = editor.ask("plcc/change", force(Value::Null))["tick"].as_u64().unwrap();
    wait(&mut editor, "= 1");
    // The record has them too, from the tick of the force to the one of its end.
    let mut show = |tick: u64| {
        let run = json!({"textDocument": {"uri": uri}, "run": "a.plcrec", "tick": tick});
        let until = Instant::now() + Duration::from_secs(60);
        loop {
            editor.send(&json!({"jsonrpc": "2.0", "id": "show", "method": "plcc/showValues", "params": run}));
            let shown = loop {
                let message = editor.receive();
                if message["id"] == "show" {
                    break message;
                }
            };
            // The last ticks are written with the next part of the record.
            if shown["error"].is_null() {
                return editor.labels(&uri, 3);
            }
            assert!(Instant::now() < until, "{shown}");
            std::thread::sleep(Duration::from_millis(100));
        }
    };
    assert!(ended > forced);
    assert_eq!(show(forced), ["= 1 (forced 0)"]);
    assert_eq!(show(ended), ["= 1"]);
    assert_eq!(show(forced.saturating_sub(1)), ["= 1"]);
    assert_eq!(show(ended.saturating_sub(1)), ["= 1 (forced 0)"]);
    drop(control);
}

/// A script is checked against its program as `plcc test` does it, from the text in the editor.
#[test]
fn mistakes_of_a_script_are_told_at_their_places() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.pmi"), "$INPUT\nDOOR = 1/0\n$END\nLAMP = DOOR\n").unwrap();
    std::fs::write(folder.path().join("bad.pmi"), "$END\nLAMP = DOOR +\n").unwrap();
    let script = folder.path().join("x.plctest");
    let uri = format!("file://{}", script.display());
    for (program, statement, code, line) in [
        ("a.pmi", "set DOR = 1", "TEST-3", 2),
        ("a.pmi", "sett DOOR = 1", "TEST-1", 2),
        ("bad.pmi", "run 1 tick", "TEST-6", 0),
        ("none.pmi", "run 1 tick", "TEST-6", 0),
    ] {
        let text = format!("program \"{program}\"\ntest \"it\"\n{statement}\nend\n");
        let mut editor = Editor::start();
        editor.tell(
            "textDocument/didOpen",
            json!({"textDocument": {"uri": uri, "languageId": "plctest", "version": 1, "text": text}}),
        );
        let told = loop {
            let message = editor.receive();
            if message["method"] == "textDocument/publishDiagnostics" {
                break message["params"]["diagnostics"].clone();
            }
        };
        assert_eq!(told[0]["code"], code, "{told}");
        assert_eq!(told[0]["range"]["start"]["line"], line, "{told}");
        assert_eq!(editor.leave(), Some(0));
    }
    assert!(!script.exists(), "the text is the editor's");
}

/// What is not the protocol ends the server with a word about it, and not with a panic.
#[test]
fn other_input_is_refused() {
    for garbage in ["hello\n", "Content-Length: x\r\n\r\n", "Content-Length: 3\r\n\r\n{]}"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_plcc"))
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(garbage.as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{garbage:?}");
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(text.contains("Language Server Protocol"), "{text}");
    }
}
