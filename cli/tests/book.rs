//! The book: its table of contents, its links, and the pages that are made from tables.
//!
//! `BLESS=1 cargo test -p plcc --test book` writes those pages anew.
#![allow(clippy::unwrap_used, clippy::indexing_slicing)]

#[path = "../../tests/src/tools.rs"]
mod tools;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use plcc_diag::CodeInfo;
use plcc_diag::code::TABLES;
use plcc_diag::lints::{Level, lint_of_code};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(page: &Path) -> String {
    fs::read_to_string(root().join(page)).unwrap()
}

/// All pages below some folders, as paths from the root.
fn pages(folders: &[&str]) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    let mut open: Vec<PathBuf> = folders.iter().map(PathBuf::from).collect();
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(root().join(&folder)).unwrap() {
            let path = folder.join(entry.unwrap().file_name());
            if path.extension().is_some_and(|ending| ending == "md") {
                found.insert(path);
            } else if folder.starts_with("docs") && root().join(&path).is_dir() {
                open.push(path);
            }
        }
    }
    found
}

/// The lines of a page that are not code, with their numbers.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let fence = line.starts_with("```");
        fenced ^= fence;
        !fenced && !fence
    })
}

/// The targets of the links of a line, code in it aside.
fn targets(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut rest = line;
    let mut code = false;
    while let Some(at) = rest.find(['`', ']']) {
        let (mark, behind) = (&rest[at..=at], &rest[at + 1..]);
        code ^= mark == "`";
        // The text of a link may be code, its target is not.
        if mark == "]"
            && !code
            && let Some(target) = behind.strip_prefix('(')
        {
            found.extend(target.split_once(')').map(|(target, _)| target));
        }
        rest = behind;
    }
    found
}

/// The name by which links find a heading, as GitHub and mdBook make it.
fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    // Of a link in a heading its text remains.
    let mut plain = String::new();
    let mut rest = heading.as_str();
    while let Some((before, behind)) = rest.split_once("](") {
        plain.push_str(before);
        rest = behind.split_once(')').map_or("", |(_, rest)| rest);
    }
    plain.push_str(rest);
    let kept = plain.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn anchors(page: &Path) -> BTreeSet<String> {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let text = read(page);
    let headings = prose(&text).filter(|(_, line)| line.starts_with('#'));
    headings
        .map(|(_, line)| {
            let anchor = anchor(line);
            let count = seen.entry(anchor.clone()).or_default();
            *count += 1;
            if *count > 1 { format!("{anchor}-{}", *count - 1) } else { anchor }
        })
        .collect()
}

/// A path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir if normal.pop() => {}
            Component::CurDir => {}
            part => normal.push(part),
        }
    }
    normal
}

#[test]
fn every_table_has_rows() {
    let mut all = pages(&["docs"]);
    all.extend(["README.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(PathBuf::from));
    for page in all {
        let text = read(&page);
        let lines: Vec<_> = prose(&text).collect();
        for (at, (number, line)) in lines.iter().enumerate() {
            let next = lines.get(at + 1).map_or("", |(_, next)| next);
            let is_empty = line.starts_with("| ---") && !next.starts_with('|');
            assert!(!is_empty, "{}:{number}: a table without rows", page.display());
        }
    }
}

#[test]
fn every_link_leads_somewhere() {
    let mut wrong = Vec::new();
    let mut count = 0;
    let mut known: BTreeMap<PathBuf, BTreeSet<String>> = BTreeMap::new();
    for page in pages(&["", "docs", "examples", "tests"]) {
        let text = read(&page);
        for (number, line) in prose(&text) {
            for target in targets(line).into_iter().filter(|target| !target.contains("://")) {
                count += 1;
                let mut complain = |why: &str| {
                    wrong.push(format!("{}:{number}: {target} {why}", page.display()));
                };
                let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
                let path = match file {
                    "" => page.clone(),
                    file => normal(&page.parent().unwrap().join(file)),
                };
                if !root().join(&path).exists() {
                    complain("does not exist");
                } else if page.starts_with("docs") && !path.starts_with("docs") {
                    complain("leads out of the book: name the file instead");
                } else if !anchor.is_empty() {
                    let known = known.entry(path.clone()).or_insert_with(|| anchors(&path));
                    if !known.contains(anchor) {
                        complain("is not a heading of that page");
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= 100, "{count} links are not all");
}

#[test]
fn the_table_of_contents_has_each_page_once() {
    let book: String = read(Path::new("book.toml"));
    assert!(book.lines().any(|line| line == "src = \"docs\""), "{book}");
    let text = read(Path::new("docs/SUMMARY.md"));
    let listed: Vec<PathBuf> =
        text.lines().flat_map(targets).map(|page| Path::new("docs").join(page)).collect();
    let mut once: BTreeSet<PathBuf> = listed.iter().cloned().collect();
    assert_eq!(once.len(), listed.len(), "a page is there twice in {listed:?}");
    once.insert("docs/SUMMARY.md".into());
    assert_eq!(once, pages(&["docs"]));
}

#[test]
fn links_and_headings_are_read_as_on_github() {
    assert_eq!(targets("a [b](c.md) and [`d`](e.md#f), `[g](h)`"), ["c.md", "e.md#f"]);
    let heading = "## Trace: `--watch NAME,NAME… --trace OUT.csv`";
    assert_eq!(anchor(heading), "trace---watch-namename---trace-outcsv");
    assert_eq!(anchor("### A [link](x.md) here"), "a-link-here");
    assert_eq!(normal(Path::new("docs/../a/./b")), Path::new("a/b"));
}

/// The targets of the links of a page of the built book, and the names that links to it may have.
fn html(text: &str) -> (Vec<&str>, BTreeSet<&str>) {
    let values = |attribute: &'static str| {
        text.split(attribute)
            .skip(1)
            .filter_map(|rest| rest.split_once('"').map(|(value, _)| value))
    };
    let targets = values(" href=\"").chain(values(" src=\"")).collect();
    (targets, values(" id=\"").collect())
}

/// Where mdBook is installed, the book is built, and the links between its pages are followed.
#[test]
fn the_book_can_be_built() {
    let folder = tempfile::tempdir().unwrap();
    let mut build = Command::new("mdbook");
    build.arg("build").arg("--dest-dir").arg(folder.path()).arg(root());
    if !tools::is_there("mdbook") {
        return;
    }
    let output = build.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !said.contains("WARN"), "{said}");
    let mut wrong = Vec::new();
    let mut count = 0;
    for page in pages(&["docs"]) {
        let page = page.strip_prefix("docs").unwrap().with_extension("html");
        let page = match page.to_str() {
            Some("SUMMARY.html") => continue,
            Some("README.html") => "index.html".into(),
            _ => page,
        };
        let text = fs::read_to_string(folder.path().join(&page)).unwrap();
        for target in html(&text).0.into_iter().filter(|target| !target.contains(':')) {
            count += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = match file {
                "" => page.clone(),
                file => normal(&page.parent().unwrap().join(file)),
            };
            let found = folder.path().join(&path);
            let leads = found.is_file()
                && (anchor.is_empty() || {
                    html(&fs::read_to_string(&found).unwrap()).1.contains(anchor)
                });
            if !leads {
                wrong.push(format!("{}: {target}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "these lead nowhere:\n{}", wrong.join("\n"));
    assert!(count >= 1000, "{count} links are not all");
}

/// Text of a table as Markdown: characters that mean something there are escaped, except in code.
fn markdown(text: &str) -> String {
    let mut out = String::new();
    let mut code = false;
    for c in text.chars() {
        code ^= c == '`';
        if !code && "\\<>*_[]|".contains(c) {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

const MADE: &str =
    "<!-- BLESS=1 cargo test -p plcc --test book makes this page; do not edit it. -->\n";

/// The page of a language's diagnostics.
fn diagnostics(codes: &[CodeInfo]) -> String {
    let title = codes[0].code.split_once('-').unwrap().0;
    let mut page = match title {
        "SIM" => format!(
            "{MADE}\n# Diagnostics of part programs\n\n\
             What `plcc explain CODE` says of each. A [simulated control](../simulate.md) reads part programs.\n"
        ),
        "TEST" => format!(
            "{MADE}\n# Diagnostics of test scripts\n\n\
             What `plcc explain CODE` says of each. `plcc test` runs [test scripts](../test-scripts.md).\n"
        ),
        _ => format!(
            "{MADE}\n# Diagnostics of {title}\n\n\
             What `plcc explain CODE` says of each. Numbers without a letter are those of the manual. With X begin \
             errors that plcc has added, with W warnings and with N notes.\n"
        ),
    };
    for CodeInfo { code, title, meaning, fix } in codes {
        let _ =
            write!(page, "\n## {code}: {}\n\n{}\n", markdown(title), markdown(meaning.trim_end()));
        if let Some(lint) = lint_of_code(code) {
            let on = if lint.default == Level::Allow { "off" } else { "on" };
            let _ = write!(
                page,
                "\nThis is the [lint](../lints.md) `{}`, which is {on} if nothing else is said.\n",
                lint.name
            );
        }
        let _ = write!(page, "\n```text\n{}\n```\n", fix.trim_end());
    }
    page
}

/// The page of the names that a language and its control have.
fn names(language: &str) -> String {
    let list = Command::new(env!("CARGO_BIN_EXE_plcc"))
        .args(["explain", "--list", "--dialect", language])
        .output()
        .unwrap();
    let list = String::from_utf8(list.stdout).unwrap();
    let title = language.to_uppercase();
    let mut page = format!(
        "{MADE}\n# Words and names of {title}\n\n\
         Keywords, and the variables, flags, registers and words of memory that the control has. \
         `plcc explain --dialect {language} NAME` says more of each: its type, its range, its \
         section in the manual.\n\n| name | means |\n| --- | --- |\n"
    );
    let prefix = format!("{title} ");
    for line in list.lines().filter_map(|line| line.strip_prefix(&prefix)) {
        // The name may be a colon, and it may hold one, as in X:$0700.
        let at = 1 + line[1..].find(": ").unwrap();
        let (name, meaning) = (&line[..at], &line[at + 2..]);
        let _ = writeln!(page, "| `{}` | {} |", name.replace('|', "\\|"), markdown(meaning));
    }
    page
}

#[test]
fn pages_made_from_tables_are_up_to_date() {
    let mut made: Vec<(PathBuf, String)> = Vec::new();
    for codes in TABLES {
        let language = codes[0].code.split_once('-').unwrap().0.to_lowercase();
        made.push((format!("docs/diagnostics/{language}.md").into(), diagnostics(codes)));
        if plcc_abi::Dialect::ALL.iter().any(|dialect| dialect.name() == language) {
            made.push((format!("docs/names/{language}.md").into(), names(&language)));
        }
    }
    let bless = std::env::var_os("BLESS").is_some();
    for (path, text) in made {
        assert!(text.lines().count() > 50, "{}:\n{text}", path.display());
        let path = root().join(path);
        if bless {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, &text).unwrap();
        }
        let found = fs::read_to_string(&path).unwrap_or_default();
        let differs = found.lines().zip(text.lines()).find(|(found, made)| found != made);
        assert!(
            found == text,
            "{}: {differs:?}; BLESS=1 cargo test -p plcc --test book writes it anew",
            path.display()
        );
    }
}
