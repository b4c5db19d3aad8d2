//! Replies as text for people.

use std::fmt::Write;

use serde_json::Value as Json;

use crate::args::Command;

/// The text of a reply.
pub(crate) fn result(command: &Command, result: &Json) -> String {
    match command {
        Command::Status => table(result),
        Command::Stat => timing(result),
        Command::List { .. } => list(result),
        Command::Get { .. } => values(result),
        Command::Swap { dry_run, .. } => {
            let end = if *dry_run { "nothing was changed (--dry-run)\n" } else { "" };
            format!("{}{}{end}", changes(result), swapped(result))
        }
        Command::Rollback => format!("{}{}", changes(result), swapped(result)),
        Command::Set { .. }
        | Command::Force { .. }
        | Command::Unforce { .. }
        | Command::Start
        | Command::Stop => String::new(),
    }
}

/// A text without control characters, which could do something to a terminal.
pub(crate) fn harmless(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{FFFD}' } else { c }).collect()
}

/// A value in one line.
fn plain(value: &Json) -> String {
    match value {
        Json::String(text) => harmless(text),
        Json::Null => "-".into(),
        Json::Array(items) if items.is_empty() => "none".into(),
        Json::Array(items) => items.iter().map(plain).collect::<Vec<_>>().join(", "),
        Json::Object(map) => match (map.get("name"), map.get("value")) {
            (Some(name), Some(value)) => format!("{}={}", plain(name), plain(value)),
            _ => map.iter().map(|(k, v)| format!("{k} {}", plain(v))).collect::<Vec<_>>().join(" "),
        },
        other => harmless(&other.to_string()),
    }
}

/// An object, an entry a line.
fn table(result: &Json) -> String {
    let Some(map) = result.as_object() else { return format!("{}\n", plain(result)) };
    let width = map.keys().map(|key| key.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for (key, value) in map {
        // Writing to a String does not fail.
        let _ = writeln!(text, "{:width$}  {}", harmless(key), plain(value));
    }
    text
}

/// How long ticks take: a row for each thing that is timed.
fn timing(result: &Json) -> String {
    const COLUMNS: [(&str, &str); 7] = [
        ("count", "count"),
        ("last us", "last_us"),
        ("mean us", "mean_us"),
        ("p50 us", "p50_us"),
        ("p99 us", "p99_us"),
        ("p99.9 us", "p999_us"),
        ("max us", "max_us"),
    ];
    let mut rows: Vec<(String, &Json)> = [("lateness", "lateness"), ("tick", "ticks")]
        .into_iter()
        .filter_map(|(name, key)| Some((name.to_owned(), result.get(key)?)))
        .collect();
    for task in result.get("tasks").and_then(Json::as_array).into_iter().flatten() {
        rows.push((task.get("name").map(plain).unwrap_or_default(), task));
    }
    let mut text = format!("{:10}", "");
    // Writing to a String does not fail.
    for (title, _) in COLUMNS {
        let _ = write!(text, " {title:>10}");
    }
    text.push('\n');
    for (name, row) in rows {
        let _ = write!(text, "{name:10}");
        for (_, key) in COLUMNS {
            let _ = write!(text, " {:>10}", row.get(key).map(plain).unwrap_or_default());
        }
        text.push('\n');
    }
    for key in ["start_us", "overruns", "skipped", "forces"] {
        if let Some(value) = result.get(key) {
            let _ = writeln!(text, "{key:10} {:>10}", plain(value));
        }
    }
    text
}

fn list(result: &Json) -> String {
    let mut text = String::new();
    for variable in result.get("variables").and_then(Json::as_array).into_iter().flatten() {
        let name = variable.get("name").map(plain).unwrap_or_default();
        let _ = match variable.get("elements").and_then(Json::as_u64) {
            Some(count) => writeln!(text, "{name}[{count}]"),
            None => writeln!(text, "{name}"),
        };
    }
    text
}

fn values(result: &Json) -> String {
    let mut text = String::new();
    for (name, value) in result.get("values").and_then(Json::as_object).into_iter().flatten() {
        let value = match value {
            Json::Array(_) => value.to_string(),
            other => plain(other),
        };
        let _ = writeln!(text, "{}={value}", harmless(name));
    }
    text
}

/// What an online change keeps and what not; nothing for a reply that does not say.
pub(crate) fn changes(result: &Json) -> String {
    let mut text = String::new();
    let Some(rows) = result.get("changes").and_then(Json::as_array) else { return text };
    for row in rows {
        let part = |key: &str| row.get(key).map(plain).unwrap_or_default();
        let what = match (row.get("old"), row.get("new")) {
            (Some(old), Some(new)) => format!("{} -> {}", plain(old), plain(new)),
            (Some(one), None) | (None, Some(one)) => plain(one),
            (None, None) => String::new(),
        };
        let accept = match row.get("needs_accept") {
            Some(Json::Bool(true)) => format!("  (--accept {})", part("name")),
            _ => String::new(),
        };
        let _ = writeln!(text, "{:8} {:12} {what}{accept}", part("change"), part("name"));
    }
    if let Some(kept) = result.get("kept").and_then(Json::as_u64) {
        let _ = writeln!(text, "{kept} variables keep their values");
    }
    text
}

fn swapped(result: &Json) -> String {
    match (result.get("ticks"), result.get("took_us").and_then(Json::as_f64)) {
        (Some(ticks), Some(took)) => {
            format!("the program runs from tick {ticks} on; the change took {took:.1} us\n")
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn values_and_forces_are_shown_as_they_are_set() {
        let get = Command::Get { names: vec![] };
        let reply = json!({"ticks": 3, "values": {"A": 1, "B": [1, 2]}});
        assert_eq!(result(&get, &reply), "A=1\nB=[1,2]\n");
        let status = json!({"forces": [{"name": "X", "value": "1"}], "state": "running"});
        assert_eq!(result(&Command::Status, &status), "forces  X=1\nstate   running\n");
    }

    #[test]
    fn timing_is_a_table() {
        let times = json!({"count": 3, "last_us": 1.5, "mean_us": 2, "p50_us": 2, "p99_us": 3,
                           "p999_us": 3, "max_us": 3.25, "name": "scan"});
        let reply = json!({"lateness": times, "ticks": times, "tasks": [times], "overruns": 1,
                           "skipped": 0, "forces": []});
        let text = result(&Command::Stat, &reply);
        let lines: Vec<Vec<&str>> =
            text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[3], ["scan", "3", "1.5", "2", "2", "3", "3", "3.25"]);
        assert_eq!((lines[1][0], lines[2][0]), ("lateness", "tick"));
        assert_eq!(lines[4], ["overruns", "1"]);
    }

    #[test]
    fn nothing_that_a_terminal_obeys_is_shown() {
        let status = json!({"program": "a\u{1b}[2J"});
        assert_eq!(result(&Command::Status, &status), "program  a\u{FFFD}[2J\n");
    }

    #[test]
    fn an_online_change_is_a_table() {
        let reply = json!({
            "kept": 2, "ticks": 7, "took_us": 12.34,
            "changes": [
                {"name": "A", "change": "new", "new": "LOGICAL", "needs_accept": false},
                {"name": "B", "change": "changed", "old": "LONG", "new": "LOGICAL", "needs_accept": true},
            ],
        });
        let text = result(&Command::Rollback, &reply);
        assert_eq!(
            text,
            "new      A            LOGICAL\n\
             changed  B            LONG -> LOGICAL  (--accept B)\n\
             2 variables keep their values\n\
             the program runs from tick 7 on; the change took 12.3 us\n"
        );
    }
}
