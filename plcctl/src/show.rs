//! Replies as text for people.

use std::fmt::Write;

use plcc_protocol::{
    ChangedVariable, Comparison, OnlineChange, Stat, TimesSummary, TimingSummary, Values, Variable,
    Variables,
};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;

use crate::args::Command;

/// The text of a reply.
///
/// # Errors
/// When the reply is of another version.
pub(crate) fn result(command: &Command, result: &Json) -> serde_json::Result<String> {
    Ok(match command {
        // What a newer control says besides is shown too.
        Command::Status => table(result),
        Command::Stat => timing(&Stat::deserialize(result)?),
        Command::List { .. } => list(&Variables::deserialize(result)?),
        Command::Get { .. } => values(&Values::deserialize(result)?),
        Command::Swap { dry_run: true, .. } => {
            let changes = changes(&Comparison::deserialize(result)?);
            format!("{changes}nothing was changed (--dry-run)\n")
        }
        Command::Swap { .. } | Command::Rollback { .. } => {
            swapped(&OnlineChange::deserialize(result)?)
        }
        Command::Set { .. }
        | Command::Force { .. }
        | Command::Unforce { .. }
        | Command::Cancel
        | Command::Start
        | Command::Stop => String::new(),
    })
}

/// A part of a reply as JSON, with its keys in alphabetical order as in a reply.
pub(crate) fn json(part: &impl Serialize) -> Json {
    // Texts, numbers and lists can always be written.
    let mut json = serde_json::to_value(part).unwrap_or_default();
    json.sort_all_objects();
    json
}

/// A text on one line, without characters that could do something to a terminal.
pub(crate) fn harmless(text: &str) -> String {
    plcc_protocol::printable(text).replace(['\n', '\t'], " ")
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
fn timing(Stat { timing, forces, .. }: &Stat) -> String {
    let TimingSummary { start_us, overruns, skipped, lateness, ticks, tasks } = timing;
    let mut text = format!("{:10}", "");
    // Writing to a String does not fail.
    for title in ["count", "last us", "mean us", "p50 us", "p99 us", "p99.9 us", "max us"] {
        let _ = write!(text, " {title:>10}");
    }
    text.push('\n');
    let tasks = tasks.iter().map(|task| (harmless(&task.name), &task.times));
    let rows = [("lateness".to_owned(), lateness), ("tick".to_owned(), ticks)];
    for (name, times) in rows.into_iter().chain(tasks) {
        let TimesSummary { count, last_us, mean_us, p50_us, p99_us, p999_us, max_us } = times;
        let _ = write!(text, "{name:10} {count:>10}");
        for time in [last_us, mean_us, p50_us, p99_us, p999_us, max_us] {
            // As in JSON, with a point.
            let _ = write!(text, " {time:>10?}");
        }
        text.push('\n');
    }
    let _ = writeln!(text, "{:10} {start_us:>10?}", "start_us");
    for (name, count) in [("overruns", overruns), ("skipped", skipped)] {
        let _ = writeln!(text, "{name:10} {count:>10}");
    }
    let _ = writeln!(text, "{:10} {:>10}", "forces", plain(&json(forces)));
    text
}

fn list(Variables { variables, .. }: &Variables) -> String {
    let mut text = String::new();
    for Variable { name, elements, alias, text: said, .. } in variables {
        let name = harmless(name);
        let count = elements.map(|count| format!("[{count}]")).unwrap_or_default();
        let said = [alias, said].map(|part| harmless(part));
        let said = said.iter().filter(|part| !part.is_empty()).map(|part| format!("  {part}"));
        // Writing to a String does not fail.
        let _ = writeln!(text, "{name}{count}{}", said.collect::<String>());
    }
    text
}

fn values(Values { values, .. }: &Values) -> String {
    let mut text = String::new();
    for (name, value) in values {
        let value = match value {
            Json::Array(_) => value.to_string(),
            other => plain(other),
        };
        let _ = writeln!(text, "{}={value}", harmless(name));
    }
    text
}

/// What an online change keeps and what not.
pub(crate) fn changes(Comparison { kept, changes }: &Comparison) -> String {
    let mut text = String::new();
    for ChangedVariable { name, change, old, new, needs_accept } in changes {
        let name = harmless(name);
        let what: Vec<String> =
            [old, new].into_iter().flatten().map(|text| harmless(text)).collect();
        let accept = if *needs_accept { format!("  (--accept {name})") } else { String::new() };
        let change = plain(&json(change));
        let _ = writeln!(text, "{change:8} {name:12} {}{accept}", what.join(" -> "));
    }
    let _ = writeln!(text, "{kept} variables keep their values");
    text
}

fn swapped(OnlineChange { comparison, ticks, took_us, .. }: &OnlineChange) -> String {
    let changes = changes(comparison);
    format!("{changes}the program runs from tick {ticks} on; the change took {took_us:.1} us\n")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::args::Wait;

    #[test]
    fn values_and_forces_are_shown_as_they_are_set() {
        let get = Command::Get { names: vec![] };
        let reply = json!({"ticks": 3, "values": {"A": 1, "B": [1, 2]}});
        assert_eq!(result(&get, &reply).unwrap(), "A=1\nB=[1,2]\n");
        let status = json!({"forces": [{"name": "X", "value": "1"}], "state": "running"});
        assert_eq!(result(&Command::Status, &status).unwrap(), "forces  X=1\nstate   running\n");
    }

    #[test]
    fn timing_is_a_table() {
        let times = json!({"count": 3, "last_us": 1.5, "mean_us": 2.0, "p50_us": 2.0,
                           "p99_us": 3.0, "p999_us": 3.0, "max_us": 3.25, "name": "scan"});
        let reply = json!({"lateness": times, "ticks": times, "tasks": [times], "overruns": 1,
                           "skipped": 0, "forces": []});
        let text = result(&Command::Stat, &reply).unwrap();
        let lines: Vec<Vec<&str>> =
            text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[3], ["scan", "3", "1.5", "2.0", "2.0", "3.0", "3.0", "3.25"]);
        assert_eq!((lines[1][0], lines[2][0]), ("lateness", "tick"));
        assert_eq!(lines[4..6], [["start_us", "0.0"], ["overruns", "1"]]);
    }

    #[test]
    fn nothing_that_a_terminal_obeys_is_shown() {
        let status = json!({"program": "a\u{1b}[2J\u{202e}b\nc"});
        assert_eq!(result(&Command::Status, &status).unwrap(), "program  a?[2J\u{FFFD}b c\n");
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
        let text = result(&Command::Rollback { wait: Wait { seconds: 0.0 } }, &reply).unwrap();
        assert_eq!(
            text,
            "new      A            LOGICAL\n\
             changed  B            LONG -> LOGICAL  (--accept B)\n\
             2 variables keep their values\n\
             the program runs from tick 7 on; the change took 12.3 us\n"
        );
    }
}
