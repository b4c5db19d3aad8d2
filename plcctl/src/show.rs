//! Replies as text for people.

use std::fmt::Write;

use serde_json::Value as Json;

use crate::args::Command;

/// The text of a reply.
pub(crate) fn result(command: &Command, result: &Json) -> String {
    match command {
        Command::Status | Command::Stat => table(result),
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
