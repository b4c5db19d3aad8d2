//! Tasks: where each waits, and how often it runs.

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
        let program = debugger.program().shared();
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
            if !program.is_users_task(name) {
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

    /// The length of a tick, and what the language says of its control.
    fn facts(&mut self, tasks: &[String]) -> Result<Vec<Fact>, Refusal> {
        let debugger = self.debugger()?;
        let (tick_ns, program) = (debugger.tick_ns(), debugger.program().shared());
        let tick = Fact { title: "tick".into(), value: format!("{} ms", tick_ns as f64 / 1e6) };
        let further = program.facts(tasks, tick_ns, &mut |names| self.read_values(names));
        let further = further.map_err(Refusal::new)?;
        let further = further.into_iter().map(|fact| Fact { title: fact.title, value: fact.value });
        Ok([tick].into_iter().chain(further).collect())
    }

    /// The task that a row belongs to, where the text says so.
    pub(super) fn task_of_row(&self, row: usize) -> Option<usize> {
        let program = self.debugger.as_ref()?.program();
        let name = program.checked().task_of(&self.text.rows, row)?;
        program.tables().tasks.iter().position(|task| task.name == name)
    }
}
