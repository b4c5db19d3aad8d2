//! Tasks: where each waits, and how often it runs.

use plcc_abi::Tables;
use plcc_runtime::TaskStatus;

use super::Session;
use crate::Refusal;
use crate::view::{Fact, TaskRow, TaskState, TasksView};

impl Session<'_> {
    pub(super) fn tasks_view(&mut self) -> Result<TasksView, Refusal> {
        let waits = self.waiting_rows()?;
        let flow = self.flow()?.clone();
        let (tick, executive_tick) = (self.time.shown, self.executive_tick);
        let debugger = self.debugger()?;
        let names: Vec<String> =
            debugger.program().tables().tasks.iter().map(|task| task.name.clone()).collect();
        let seconds = flow.ticks as f64 * debugger.tick_ns() as f64 / 1e9;
        let statuses = if tick >= debugger.history().known() {
            vec![]
        } else if executive_tick == Some(tick) {
            debugger.history_mut().executive().task_statuses()
        } else {
            debugger.go_to_end_of_tick(tick)?;
            debugger.view()?.task_statuses()
        };
        if executive_tick != Some(tick) {
            self.executive_tick = None;
        }
        let mut rows = vec![];
        for (task, name) in names.iter().enumerate() {
            // The statements of a PMAC's COMMANDs are tasks for the engine alone.
            if name.starts_with("COMMAND") {
                continue;
            }
            let scan = flow.tasks.get(&task);
            let row = waits.iter().find(|(waiting, _)| waiting == name).map(|(_, row)| *row);
            let state = match (statuses.get(task), scan) {
                (Some(TaskStatus::Disabled), _) => TaskState::Disabled,
                (Some(TaskStatus::Paused), _) => TaskState::Paused,
                (_, Some(scan)) if scan.waits => TaskState::Waiting,
                (_, Some(_)) => TaskState::Running,
                (_, None) => TaskState::Idle,
            };
            let begun = flow.begun.get(&task).copied().unwrap_or(0);
            rows.push(TaskRow {
                name: name.clone(),
                state,
                row,
                place: row
                    .and_then(|row| self.text.rows.get(row))
                    .map(|content| format!("{} {}", content.number, content.text().trim())),
                tick: scan.map(|scan| scan.tick),
                scans_per_second: if seconds > 0.0 { begun as f64 / seconds } else { 0.0 },
                statements: scan.map_or(0, |scan| scan.statements),
            });
        }
        let facts = self.facts(&names)?;
        Ok(TasksView { rows, facts })
    }

    /// The length of a tick; of a PMAC also I5, I8, two timers, and the numbers of the PLCs without text.
    fn facts(&mut self, tasks: &[String]) -> Result<Vec<Fact>, Refusal> {
        let tick_ns = self.debugger()?.tick_ns();
        let fact = |title: &str, value: String| Fact { title: title.into(), value };
        let mut facts = vec![fact("tick", format!("{} ms", tick_ns as f64 / 1e6))];
        let Some(Tables::Pmac(_)) = self.tables() else { return Ok(facts) };
        let names = ["I5", "I8", "X:$700", "Y:$700", "X:$701", "Y:$701"];
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let moment = self.read(&names)?;
        for name in &names {
            let Some(&value) = moment.values.get(name) else { continue };
            let text = match name.starts_with('I') {
                true => plcc_runtime::value::number(value),
                // The timers count servo cycles down; 24 bits with a sign.
                false => {
                    let signed = if value >= f64::from(1 << 23) {
                        value - f64::from(1 << 24)
                    } else {
                        value
                    };
                    format!("{signed} cycles, {:.1} ms", signed * tick_ns as f64 / 1e6)
                }
            };
            facts.push(fact(name, text));
        }
        for (title, kind) in [("empty PLCs", "PLC"), ("empty PLCCs", "PLCC")] {
            let is_empty = |number: &u32| !tasks.contains(&format!("{kind}{number}"));
            facts.push(fact(title, ranges((0..32).filter(is_empty))));
        }
        Ok(facts)
    }

    /// The task that a row belongs to, where the text says so.
    pub(super) fn task_of_row(&self, row: usize) -> Option<usize> {
        let program = self.debugger.as_ref()?.program();
        let name = program.checked().task_of(&self.text.rows, row)?;
        program.tables().tasks.iter().position(|task| task.name == name)
    }
}

/// The PLC that a line opens, `PLC3` or `PLCC3`; `None` if it opens none.
pub(super) fn opened_plc(line: &str) -> Option<String> {
    let text = line.to_uppercase().replace(char::is_whitespace, "");
    let rest = text.strip_prefix("OPENPLC")?;
    let (letters, rest) = match rest.strip_prefix('C') {
        Some(rest) if !rest.starts_with('L') => ("PLCC", rest),
        _ => ("PLC", rest),
    };
    let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
    Some(format!("{letters}{digits}"))
}

/// Numbers as a list of ranges.
fn ranges(numbers: impl Iterator<Item = u32>) -> String {
    let mut found: Vec<(u32, u32)> = vec![];
    for number in numbers {
        match found.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => found.push((number, number)),
        }
    }
    let text = |&(first, last): &(u32, u32)| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    };
    found.iter().map(text).collect::<Vec<_>>().join(" ")
}
