//! Coverage as a page: the source, in which each contact has a colour, with what was seen of it and the tests that covered
//! it. The page needs nothing else.

use std::fmt::Write;

use plcc_diag::{FileId, Span};

use super::{ContactCounts, Coverage, Summary};

/// How the page looks.
const STYLE: &str = "body{font-family:sans-serif;margin:2em;color:#222}\
    table{border-collapse:collapse;font-family:monospace}td{padding:0 .6em;white-space:pre;vertical-align:top}\
    .n{color:#888;text-align:right}.no{background:#fdd}\
    b{font-weight:normal;border-radius:3px;padding:0 1px}\
    .g{background:#b6e7b0}.y{background:#fbe89a}.r{background:#f7b0a8}\
    .legend b{padding:0 .4em}h2{margin-top:2em}";

/// The page of programs, in their order.
pub fn html(all: &[Coverage]) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Coverage</title>\n<style>{STYLE}</style></head><body>\n\
         <h1>Coverage</h1>\n"
    );
    let summary = all.iter().fold(Summary::default(), |sum, one| sum.plus(one.summary()));
    // Writing to memory does not fail.
    let _ = write!(
        page,
        "<p>{}</p>\n<p class=\"legend\"><b class=\"g\">decided both ways</b> <b class=\"y\">seen 0 and 1</b> \
         <b class=\"r\">neither</b>; a red line did not run. Point at a contact for the numbers and the tests.</p>\n",
        summary.line()
    );
    for coverage in all {
        for file in coverage.files() {
            source(&mut page, coverage, file);
        }
    }
    page.push_str("</body></html>\n");
    page
}

/// A source file.
fn source(page: &mut String, coverage: &Coverage, file: FileId) {
    let sources = &coverage.sources;
    let _ = write!(page, "<h2>{}</h2>\n<table>\n", escaped(sources.path(file)));
    let mut marks: Vec<(Span, String, &str)> = vec![];
    let mut lines: std::collections::BTreeMap<u32, u64> = std::collections::BTreeMap::new();
    for statement in coverage.statements.iter().filter(|statement| statement.span.file == file) {
        let runs = lines.entry(statement.line).or_insert(u64::MAX);
        *runs = (*runs).min(statement.runs);
        for contact in &statement.contacts {
            let title = title(&contact.name, contact.counts, &contact.tests, &coverage.tests);
            marks.push((contact.span, title, color(contact.counts)));
        }
    }
    marks.sort_by_key(|(span, ..)| span.start);
    let text = sources.text(file);
    let mut begin = 0;
    let mut next = marks.iter().peekable();
    for (number, line) in (1..).zip(text.split_inclusive('\n')) {
        let end = begin + line.len();
        let runs = lines.get(&number);
        let shown = runs.map_or_else(String::new, |runs| format!("{runs}×"));
        let class = if runs == Some(&0) { " class=\"no\"" } else { "" };
        let _ = write!(
            page,
            "<tr{class}><td class=\"n\">{number}</td><td class=\"n\">{shown}</td><td>"
        );
        let mut at = begin;
        while let Some((span, title, color)) =
            next.next_if(|(span, ..)| (span.start as usize) < end)
        {
            let (from, to) = (span.start as usize, (span.end as usize).min(end));
            if from < at {
                continue;
            }
            page.push_str(&escaped(text.get(at..from).unwrap_or_default()));
            let own =
                escaped(text.get(from..to).unwrap_or_default().trim_end_matches(['\r', '\n']));
            let _ = write!(page, "<b class=\"{color}\" title=\"{}\">{own}</b>", escaped(title));
            at = to;
        }
        page.push_str(&escaped(
            text.get(at..end).unwrap_or_default().trim_end_matches(['\r', '\n']),
        ));
        page.push_str("</td></tr>\n");
        begin = end;
    }
    page.push_str("</table>\n");
}

/// The class of a contact's colour.
fn color(counts: ContactCounts) -> &'static str {
    match (counts.is_decided(), counts.is_seen()) {
        (true, _) => "g",
        (false, true) => "y",
        (false, false) => "r",
    }
}

/// How many tests are named.
const NAMED: usize = 10;

/// What is said of a contact.
fn title(name: &str, counts: ContactCounts, tests: &[usize], names: &[String]) -> String {
    let ContactCounts { zero, one, decided_zero, decided_one } = counts;
    let mut title = format!(
        "{name}: 0 in {zero}, 1 in {one} scans; decided a result 0 in {decided_zero}, 1 in {decided_one}"
    );
    let named = tests.iter().take(NAMED).filter_map(|number| names.get(*number));
    for name in named {
        title.push('\n');
        title.push_str(name);
    }
    if tests.len() > NAMED {
        let _ = write!(title, "\nand {} more tests", tests.len() - NAMED);
    }
    title
}

/// A text in HTML.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}
