//! Runs the commands of the documentation and compares what they print with what the page shows.
//!
//! Each page is one session of a shell, in a folder of its own that holds `examples/` and, of a page
//! `docs/NAME.md`, what lies in `docs/NAME/`, there and in the folder itself. In a page
//!
//! - a block fenced as ```` ```LANGUAGE FILE ```` (a second word with a point in it) is written to that
//!   file, as a reader would save it;
//! - a block fenced as ```` ```console ```` holds commands, each on a line that begins with `$ `, and
//!   below each what it prints. A line `…` stands for any number of lines, and `…` within a line for any
//!   text; every other line must occur, in this order, as part of a line of the output. Where no `…`
//!   stands between two lines, they must follow each other.
//!
//! After `console` may stand the name of a processor (the block is for that one alone), `fails` (the
//! block's last command must end with another exit status than 0; all others end with 0), and
//! `background` (the command goes on while the page's others run, and is ended after them; what it
//! has printed is compared then).
//!
//! A block fenced as ```` ```sh ```` holds commands that are not run here, since they need other rights,
//! another computer or the network; one fenced as ```` ```text ```` holds none. No line of another block may
//! begin with one of our programs.
#![cfg(unix)]
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::indexing_slicing, clippy::panic)]

mod support;

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use support::programs;

/// Our programs.
const PROGRAMS: [&str; 3] = ["plcc", "plcrt", "plcctl"];
/// What may stand after `console` besides the name of a processor.
const FAILS: &str = "fails";
const BACKGROUND: &str = "background";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All pages, as paths from the root.
fn pages() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open: Vec<PathBuf> = ["", "docs", "examples", "tests"].map(PathBuf::from).into();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(root().join(&folder)).unwrap() {
            let path = folder.join(entry.unwrap().file_name());
            if path.extension().is_some_and(|ending| ending == "md") {
                found.push(path);
            } else if folder.starts_with("docs") && root().join(&path).is_dir() {
                open.push(path);
            }
        }
    }
    found.sort();
    found
}

/// A fenced block of a page.
struct Block {
    /// The line of its first fence, from 1.
    line: usize,
    /// The words after the first fence.
    info: Vec<String>,
    lines: Vec<String>,
}

impl Block {
    fn language(&self) -> &str {
        self.info.first().map_or("", String::as_str)
    }

    fn has(&self, word: &str) -> bool {
        self.info.iter().skip(1).any(|known| known == word)
    }

    /// Whether it holds commands that this machine can run.
    fn is_session(&self) -> bool {
        let known = [FAILS, BACKGROUND, std::env::consts::ARCH];
        self.language() == "console"
            && self.info.iter().skip(1).all(|w| known.contains(&w.as_str()))
    }

    /// The file to which it is written.
    fn file(&self) -> Option<&str> {
        let name = self.info.get(1).filter(|word| word.contains('.'))?;
        (self.language() != "console").then_some(name)
    }
}

/// The fenced blocks of a page, and the lines outside of them with their numbers.
fn blocks(page: &str) -> (Vec<Block>, Vec<(usize, &str)>) {
    let mut found = Vec::new();
    let mut outside = Vec::new();
    let mut open: Option<Block> = None;
    for (line, number) in page.lines().zip(1..) {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(info)) => {
                let info = info.split_whitespace().map(str::to_owned).collect();
                open = Some(Block { line: number, info, lines: Vec::new() });
            }
            (Some(_), Some(_)) => found.extend(open.take()),
            (Some(block), None) => block.lines.push(line.to_owned()),
            (None, None) => outside.push((number, line)),
        }
    }
    assert!(open.is_none(), "a fence is not closed");
    (found, outside)
}

/// A documented command.
#[derive(Default)]
struct Shown {
    /// The line of the page.
    line: usize,
    /// What is typed; it has several lines where they end with `\`.
    command: String,
    /// The lines shown below it.
    output: Vec<String>,
    fails: bool,
    background: bool,
}

/// The commands of a block.
fn commands(block: &Block) -> Vec<Shown> {
    let mut found: Vec<Shown> = Vec::new();
    for (text, line) in block.lines.iter().zip(block.line + 1..) {
        if let Some(command) = text.strip_prefix("$ ") {
            let background = block.has(BACKGROUND);
            found.push(Shown { line, command: command.into(), background, ..Shown::default() });
            continue;
        }
        let shown = found.last_mut().expect("a block begins with a command");
        if shown.command.ends_with('\\') {
            shown.command.push('\n');
            shown.command.push_str(text);
        } else {
            shown.output.push(text.clone());
        }
    }
    if let Some(last) = found.last_mut() {
        last.fails = block.has(FAILS);
    }
    found
}

/// Begins and ends what a command prints, in front of its line's number.
const BEGIN: char = '\u{1}';
const END: char = '\u{2}';

/// What the shell does for a page, and the commands whose output it gives.
///
/// A program may take a moment to open its socket, and a reader to go to another terminal: so
/// `plcctl` waits for the socket.
fn script(blocks: Vec<Block>) -> (String, Vec<Shown>) {
    let mut script = String::from(
        "exec 2>&1\n\
         begin() { local s=$?; printf '\\n\\001%s\\n' \"$1\"; return $s; }\n\
         end() { local s=$?; printf '\\n\\002%s %s\\n' \"$1\" \"$s\"; return $s; }\n\
         plcctl() {\n\
         for i in $(seq 600); do [ -S \"$1\" ] && break; sleep 0.1; done\n\
         command plcctl \"$@\"\n}\n",
    );
    let mut ends = String::from("kill $(jobs -p) 2>/dev/null\nwait\n");
    let mut all = Vec::new();
    for block in blocks {
        if let Some(name) = block.file() {
            let text = block.lines.join("\n");
            let _ = writeln!(script, "cat >{name} <<'END OF FILE'\n{text}\nEND OF FILE");
        } else if block.is_session() {
            for shown in commands(&block) {
                let Shown { line, command, background, .. } = &shown;
                let _ = if *background {
                    let _ = writeln!(ends, "begin {line}; cat .out{line}; end {line}");
                    writeln!(script, "(exec {command}) >.out{line} 2>&1 </dev/null &")
                } else {
                    writeln!(script, "begin {line}\n{command}\nend {line}")
                };
                all.push(shown);
            }
        }
    }
    (script + &ends, all)
}

/// What a command printed and its exit status.
fn printed(output: &str, line: usize) -> Option<(Vec<&str>, i32)> {
    let (_, rest) = output.split_once(&format!("\n{BEGIN}{line}\n"))?;
    let (text, rest) = rest.split_once(&format!("\n{END}{line} "))?;
    let status = rest.lines().next()?.parse().ok()?;
    Some((text.lines().collect(), status))
}

/// Whether a printed line has the parts of the shown one, in their order.
fn has_parts(printed: &str, shown: &str) -> bool {
    let mut rest = printed;
    shown.split('…').all(|part| match rest.find(part.trim_end()) {
        Some(at) => {
            rest = &rest[at + part.trim_end().len()..];
            true
        }
        None => false,
    })
}

/// Where the lines shown first fail to match the lines printed.
fn mismatch<'a>(shown: &'a [String], printed: &[&str]) -> Option<&'a str> {
    let mut at = 0;
    let mut gap = false;
    for line in shown {
        if line == "…" {
            gap = true;
            continue;
        }
        let rest = printed.get(at..).unwrap_or_default();
        let found = rest.iter().take(if gap { usize::MAX } else { 1 }).position(|printed| {
            has_parts(printed, line) && (!line.is_empty() || printed.is_empty())
        });
        match found {
            Some(skipped) => at += skipped + 1,
            None => return Some(line),
        }
        gap = false;
    }
    (!gap && at < printed.len()).then_some("the end of the output")
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

/// Runs a page; what differs.
fn run(page: &Path) -> Vec<String> {
    let path = root().join(page);
    let (blocks, _) = blocks(&fs::read_to_string(&path).unwrap());
    let (script, commands) = script(blocks);
    if commands.is_empty() {
        return Vec::new();
    }
    let folder = tempfile::tempdir().unwrap();
    copy(&root().join("examples"), &folder.path().join("examples"));
    let own = path.with_extension("");
    if own.is_dir() {
        copy(&own, folder.path());
        copy(&own, &folder.path().join(page.with_extension("")));
    }
    let found = std::env::var("PATH").unwrap_or_default();
    let output = Command::new("timeout")
        .args(["300", "bash", "-c", &script])
        .env("PATH", format!("{}:{found}", programs().display()))
        .env("LANG", "C.UTF-8")
        .current_dir(&folder)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let output = String::from_utf8(output.stdout).unwrap();
    let mut wrong = Vec::new();
    for Shown { line, command, output: shown, fails, background } in &commands {
        let place = format!("{}:{line}: {command}", page.display());
        let Some((lines, status)) = printed(&output, *line) else {
            wrong.push(format!("{place}\nwas not run"));
            continue;
        };
        if (status != 0) != *fails && !background {
            wrong.push(format!("{place}\nended with exit status {status}\n{}", lines.join("\n")));
        } else if let Some(missing) = mismatch(shown, &lines) {
            wrong.push(format!("{place}\n{missing:?} is not there in\n{}", lines.join("\n")));
        }
    }
    wrong
}

#[test]
fn every_page_shows_what_its_commands_print() {
    programs();
    let pages = pages();
    let wrong: Vec<String> = thread::scope(|scope| {
        let running: Vec<_> = pages.iter().map(|page| scope.spawn(|| run(page))).collect();
        running.into_iter().flat_map(|page| page.join().unwrap()).collect()
    });
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn every_command_of_ours_stands_in_a_block_that_is_run() {
    let is_ours = |line: &str| {
        let line = line.strip_prefix("$ ").unwrap_or(line);
        PROGRAMS.iter().any(|program| {
            line.strip_prefix(program).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
        })
    };
    let mut wrong = Vec::new();
    let mut count = 0;
    for page in pages() {
        let text = fs::read_to_string(root().join(&page)).unwrap();
        let (blocks, outside) = blocks(&text);
        let mut complain = |number: usize, line: &str| {
            wrong.push(format!("{}:{number}: {line}", page.display()));
        };
        for (number, line) in outside {
            if line.strip_prefix("    ").is_some_and(|line| is_ours(line.trim_start())) {
                complain(number, line);
            }
        }
        for block in blocks {
            if block.language() == "console" {
                count += commands(&block).len();
                continue;
            }
            for (line, number) in block.lines.iter().zip(block.line + 1..) {
                if is_ours(line) && block.language() != "text" && block.file().is_none() {
                    complain(number, line);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "these are not run:\n{}", wrong.join("\n"));
    assert!(count >= 20, "{count} commands are not all");
}

#[test]
fn a_page_that_shows_something_else_is_noticed() {
    let shown = |lines: &[&str]| lines.iter().map(|line| (*line).to_owned()).collect::<Vec<_>>();
    let printed = ["one", "two", "three", ""];
    assert_eq!(mismatch(&shown(&["one", "two", "three", ""]), &printed), None);
    assert_eq!(mismatch(&shown(&["one", "…"]), &printed), None);
    assert_eq!(mismatch(&shown(&["…", "three", ""]), &printed), None);
    assert_eq!(mismatch(&shown(&["o…e", "t…", "thr…e", ""]), &printed), None);
    assert_eq!(mismatch(&shown(&["one", "three"]), &printed), Some("three"));
    assert_eq!(mismatch(&shown(&["…", "two", "one"]), &printed), Some("one"));
    assert_eq!(mismatch(&shown(&["e…o", "…"]), &printed), Some("e…o"));
    assert_eq!(mismatch(&shown(&["one", "", "…"]), &printed), Some(""));
    assert_eq!(mismatch(&shown(&["one"]), &printed), Some("the end of the output"));
}

#[test]
fn a_page_becomes_a_session() {
    let page = "```text a.txt\nfirst\n```\n```console\n$ cat \\\n  a.txt\nfirst\n```\n\
                ```console fails\n$ true\n$ exit_status 7\n```\n```console pdp11\n$ false\n```\n";
    let (blocks, outside) = blocks(page);
    assert!(outside.is_empty());
    let (script, commands) = script(blocks);
    assert!(script.contains("cat >a.txt") && script.contains("cat \\\n  a.txt\n"), "{script}");
    let seen: Vec<_> = commands.iter().map(|c| (c.line, c.output.len(), c.fails)).collect();
    assert_eq!(seen, [(5, 1, false), (10, 0, false), (11, 0, true)]);
}

#[test]
fn what_a_command_printed_is_found() {
    let output = "\n\u{1}5\nfirst\nsecond\n\n\u{2}5 0\n\n\u{1}6\n\n\u{2}6 3\n";
    assert_eq!(printed(output, 5), Some((vec!["first", "second"], 0)));
    assert_eq!(printed(output, 6), Some((vec![], 3)));
    assert_eq!(printed(output, 7), None);
}
