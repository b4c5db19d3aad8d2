//! The answers to requests that look at the program or move in its run.

use std::collections::HashMap;
use std::io::Write;

use plcc_diag::FileId;
use serde_json::{Value, json};

use plcc_replay::DebugError;
use plcc_replay::breakpoints::{DataBreakpoint, LineBreakpoint, SetBreakpoint, show_value};
use plcc_replay::variables::Shown;
use plcc_replay::{Direction, StepKind, StopAt, Stopped};

use super::protocol::{
    Breakpoint, DataBreakpointInfoArguments, EvaluateArguments, LocationsArguments, OwnArguments,
    SetBreakpointsArguments, SetDataBreakpointsArguments, SetExceptionBreakpointsArguments,
    SetVariableArguments, Source, SourceArguments, SourceBreakpoint, StackFrame,
    StackTraceArguments, StepArguments, Variable, VariablesArguments,
};
use super::server::{Server, read};

/// What can be unfolded in the client. The client knows it by a number, the protocol's `variablesReference`.
#[derive(Clone, Debug)]
pub(super) enum Unfolded {
    /// What the statement reads and writes.
    Accesses,
    /// Variables.
    Variables(Vec<String>),
    /// The parts of a variable.
    Parts(String),
}

/// The body of an answer, and where the program has stopped now, if the request has moved it.
pub(super) type Answer = Result<(Value, Option<Stopped>), DebugError>;

impl<W: Write> Server<'_, W> {
    /// Answers a request.
    pub(super) fn answer(&mut self, command: &str, arguments: Value) -> Answer {
        let body = match command {
            "setBreakpoints" => self.set_breakpoints(read(arguments)?)?,
            "breakpointLocations" => self.locations(&read(arguments)?)?,
            "dataBreakpointInfo" => self.data_breakpoint_info(&read(arguments)?)?,
            "setDataBreakpoints" => self.set_data_breakpoints(&read(arguments)?)?,
            "setExceptionBreakpoints" => self.set_filters(&read(arguments)?)?,
            "setFunctionBreakpoints" => json!({"breakpoints": []}),
            "exceptionInfo" => json!({
                "exceptionId": self.reason.clone(),
                "description": self.reason.clone(),
                "breakMode": "always",
            }),
            "threads" => self.threads()?,
            "stackTrace" => self.stack_trace(&read(arguments)?)?,
            "scopes" => self.scopes()?,
            "variables" => self.variables(&read(arguments)?)?,
            "setVariable" => self.set_variable(&read(arguments)?)?,
            "setExpression" => {
                let EvaluateArguments { expression: name, value, .. } = read(arguments)?;
                self.set_variable(&SetVariableArguments { name, value })?
            }
            "evaluate" => return self.evaluate(&read(arguments)?),
            "loadedSources" => self.loaded_sources()?,
            "source" => self.source_text(&read(arguments)?)?,
            "next" => return self.step(&read(arguments)?, StepKind::Over, Direction::Forward),
            "stepIn" => {
                return self.step(&read(arguments)?, StepKind::Statement, Direction::Forward);
            }
            "stepOut" => return self.step(&read(arguments)?, StepKind::Out, Direction::Forward),
            "stepBack" => {
                return self.step(&read(arguments)?, StepKind::Statement, Direction::Back);
            }
            "plcc/scanForward" => return self.move_by(StepKind::Scan, Direction::Forward),
            "plcc/scanBack" => return self.move_by(StepKind::Scan, Direction::Back),
            "plcc/lastWriter" => {
                let OwnArguments { name, .. } = read(arguments)?;
                let stopped = self.debugger()?.go_to_last_writer(&name)?;
                return Ok((self.position()?, Some(stopped)));
            }
            "plcc/lastChange" => {
                let OwnArguments { name, .. } = read(arguments)?;
                let stopped = self.debugger()?.go_to_last_change(&name)?;
                return Ok((self.position()?, Some(stopped)));
            }
            "plcc/goToTick" => {
                let OwnArguments { tick, .. } = read(arguments)?;
                self.debugger()?.go_to_tick(tick)?;
                return Ok((self.position()?, Some(Stopped::Step)));
            }
            "plcc/position" => self.position()?,
            other => return Err(DebugError(format!("`{other}` is not supported"))),
        };
        Ok((body, None))
    }

    /// A line or column that came from the client, as one from 1.
    fn one_based(&self, number: i64, starts_at_1: bool) -> u32 {
        u32::try_from(number.saturating_add(i64::from(!starts_at_1))).unwrap_or(0).max(1)
    }

    /// A line or column from 1, as the client counts it.
    fn for_client(&self, number: u32, starts_at_1: bool) -> i64 {
        i64::from(number) - i64::from(!starts_at_1)
    }

    fn line(&self, line: u32) -> i64 {
        self.for_client(line, self.initialize.lines_start_at1)
    }

    fn column(&self, column: u32) -> i64 {
        self.for_client(column, self.initialize.columns_start_at1)
    }

    /// The file of a source that the client names.
    fn file(&mut self, source: &Source) -> Result<FileId, DebugError> {
        let debugger = self.debugger()?;
        let by_number = source.source_reference.filter(|&number| number > 0);
        // A source of another version of the program is the file of the same path in this one.
        let by_number =
            by_number.filter(|number| (number - 1) >> 16 == i64::from(debugger.generation()));
        let by_number = by_number.map(|number| FileId((number - 1) as u32 & 0xFFFF));
        let file = by_number.or_else(|| debugger.file(source.path.as_deref().unwrap_or_default()));
        file.ok_or_else(|| DebugError::new("the program has no such source file"))
    }

    /// A file for the client: by its path, or by a number where there is no file with this text. The number has that of the
    /// program's version in it, since each version may have another text.
    fn source(&mut self, file: FileId) -> Result<Source, DebugError> {
        let debugger = self.debugger()?;
        let generation = i64::from(debugger.generation());
        let program = debugger.program();
        let path = program.path(file);
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let source_reference =
            (!program.is_on_disk(file)).then_some((generation << 16 | i64::from(file.0)) + 1);
        Ok(Source { name, path: Some(path.to_string_lossy().into_owned()), source_reference })
    }

    fn set_breakpoints(&mut self, arguments: SetBreakpointsArguments) -> Result<Value, DebugError> {
        let SetBreakpointsArguments { source, mut breakpoints, lines } = arguments;
        if breakpoints.is_empty() {
            let of = |line| SourceBreakpoint { line, ..SourceBreakpoint::default() };
            breakpoints.extend(lines.into_iter().map(of));
        }
        let (lines_at_1, columns_at_1) =
            (self.initialize.lines_start_at1, self.initialize.columns_start_at1);
        let wanted: Vec<_> = breakpoints
            .into_iter()
            .map(|breakpoint| LineBreakpoint {
                line: self.one_based(breakpoint.line, lines_at_1),
                column: breakpoint.column.map(|column| self.one_based(column, columns_at_1)),
                condition: breakpoint.condition,
                hits: breakpoint.hit_condition,
                log: breakpoint.log_message,
            })
            .collect();
        let set = match self.file(&source) {
            Ok(file) => self.debugger()?.set_line_breakpoints(file.0, &wanted),
            Err(error) => {
                let none = |_: &LineBreakpoint| SetBreakpoint { id: -1, place: Err(error.clone()) };
                wanted.iter().map(none).collect()
            }
        };
        Ok(json!({"breakpoints": self.told_breakpoints(set, true)}))
    }

    fn told_breakpoints(&self, set: Vec<SetBreakpoint>, has_place: bool) -> Vec<Breakpoint> {
        let told = |SetBreakpoint { id, place }| match place {
            Ok((line, column)) => Breakpoint {
                id,
                verified: true,
                message: None,
                line: has_place.then(|| self.line(line)),
                column: has_place.then(|| self.column(column)),
            },
            Err(error) => Breakpoint { id, message: Some(error.0), ..Breakpoint::default() },
        };
        set.into_iter().map(told).collect()
    }

    fn locations(&mut self, arguments: &LocationsArguments) -> Result<Value, DebugError> {
        let file = self.file(&arguments.source)?;
        let at_1 = self.initialize.lines_start_at1;
        let first = self.one_based(arguments.line, at_1);
        let last = arguments.end_line.map_or(first, |line| self.one_based(line, at_1));
        let places = self.debugger()?.program().places().statements_between(file, first, last);
        let told = |place: &plcc_frontend::presentation::StatementPlace| {
            json!({
                "line": self.line(place.line),
                "column": self.column(place.column),
                "endLine": self.line(place.end_line),
                "endColumn": self.column(place.end_column),
            })
        };
        Ok(json!({"breakpoints": places.iter().map(told).collect::<Vec<_>>()}))
    }

    fn data_breakpoint_info(
        &mut self,
        arguments: &DataBreakpointInfoArguments,
    ) -> Result<Value, DebugError> {
        let name = arguments.name.split(' ').next().unwrap_or_default();
        Ok(match self.debugger()?.program().expression(name) {
            Ok(_) => json!({
                "dataId": name,
                "description": format!("{name} changes"),
                "accessTypes": ["write"],
                "canPersist": true,
            }),
            Err(error) => json!({"dataId": null, "description": error.0}),
        })
    }

    fn set_data_breakpoints(
        &mut self,
        arguments: &SetDataBreakpointsArguments,
    ) -> Result<Value, DebugError> {
        let wanted: Vec<_> = arguments
            .breakpoints
            .iter()
            .map(|wanted| DataBreakpoint {
                name: wanted.data_id.clone(),
                condition: wanted.condition.clone(),
                hits: wanted.hit_condition.clone(),
            })
            .collect();
        let set = self.debugger()?.set_data_breakpoints(&wanted);
        Ok(json!({"breakpoints": self.told_breakpoints(set, false)}))
    }

    fn set_filters(
        &mut self,
        arguments: &SetExceptionBreakpointsArguments,
    ) -> Result<Value, DebugError> {
        let has = |filter: &str| arguments.filters.iter().any(|given| given == filter);
        let stop_at =
            StopAt { program_stops: has("stop"), faults: has("fault"), messages: has("message") };
        self.debugger()?.stop_at = stop_at;
        Ok(Value::Null)
    }

    fn threads(&mut self) -> Result<Value, DebugError> {
        let tasks = &self.debugger()?.program().tables().tasks;
        let thread = |(id, task): (i64, &plcc_abi::Task)| json!({"id": id, "name": task.name});
        Ok(json!({"threads": (1..).zip(tasks).map(thread).collect::<Vec<_>>()}))
    }

    fn stack_trace(&mut self, arguments: &StackTraceArguments) -> Result<Value, DebugError> {
        let debugger = self.debugger()?;
        let (position, image) = (debugger.position(), debugger.image()?);
        let here = debugger.step_here()?;
        let (count, last) = {
            let steps = &debugger.trace()?.steps;
            (steps.len(), steps.last().copied())
        };
        let task_name = |task: usize| {
            debugger.program().tables().tasks.get(task).map_or_else(String::new, |t| t.name.clone())
        };
        let mut statements = vec![];
        match here.or(last) {
            Some(step) if step.task as i64 + 1 == arguments.thread_id => {
                let name = match here {
                    Some(_) => format!(
                        "tick {}, statement {} of {count}",
                        position.tick,
                        position.step + 1
                    ),
                    None => format!("tick {}, after its last statement", position.tick),
                };
                statements.push((step.statement, format!("{} ({name})", task_name(step.task))));
                let calls = match here {
                    Some(_) => debugger.program().checked().calls(&image),
                    None => vec![],
                };
                statements.extend(calls.into_iter().rev().map(|call| (call, "called here".into())));
            }
            _ => {}
        }
        let total = statements.len();
        let levels = if arguments.levels == 0 { usize::MAX } else { arguments.levels };
        let mut frames = vec![];
        for (id, (statement, name)) in
            (1..).zip(statements).skip(arguments.start_frame).take(levels)
        {
            let Some(place) = self.debugger()?.program().places().place(statement) else {
                continue;
            };
            frames.push(StackFrame {
                id,
                name,
                source: Some(self.source(place.file)?),
                line: self.line(place.line),
                column: self.column(place.column),
                end_line: Some(self.line(place.end_line)),
                end_column: Some(self.column(place.end_column)),
            });
        }
        Ok(json!({"stackFrames": frames, "totalFrames": total}))
    }

    /// A number for something to be unfolded.
    fn reference(&mut self, what: Unfolded) -> i64 {
        self.unfolded.push(what);
        self.unfolded.len() as i64
    }

    fn scopes(&mut self) -> Result<Value, DebugError> {
        let classes = self.debugger()?.classes()?;
        let accesses = self.reference(Unfolded::Accesses);
        let mut scopes = vec![json!({
            "name": "This statement",
            "presentationHint": "locals",
            "variablesReference": accesses,
            "expensive": false,
        })];
        for class in classes {
            let count = class.names.len();
            let reference = self.reference(Unfolded::Variables(class.names));
            scopes.push(json!({
                "name": class.title,
                "variablesReference": reference,
                "namedVariables": count,
                "expensive": count > 200,
            }));
        }
        Ok(json!({"scopes": scopes}))
    }

    fn variables(&mut self, arguments: &VariablesArguments) -> Result<Value, DebugError> {
        let at = usize::try_from(arguments.variables_reference.saturating_sub(1)).ok();
        let what = at.and_then(|at| self.unfolded.get(at)).cloned();
        let what = what.ok_or_else(|| DebugError::new("these variables are from another stop"))?;
        let debugger = self.debugger()?;
        let count = if arguments.count == 0 { usize::MAX } else { arguments.count };
        let wanted = arguments.start..arguments.start.saturating_add(count);
        let part =
            |all: Vec<Shown>| all.into_iter().skip(wanted.start).take(count).collect::<Vec<_>>();
        let shown = match what {
            Unfolded::Accesses => part(accesses(debugger)?),
            // Values are only read of those that are asked for: a client may ask for a few at a time.
            Unfolded::Variables(names) => {
                let end = wanted.end.min(names.len());
                debugger.values(names.get(wanted.start.min(end)..end).unwrap_or_default())?
            }
            Unfolded::Parts(name) => part(debugger.parts(&name)?),
        };
        let mut variables = vec![];
        for shown in shown {
            let Shown { name, mut value, full_name, has_parts } = shown;
            if arguments.format.hex
                && let Some(hex) = self.debugger()?.hexadecimal(&value)
            {
                value = hex;
            }
            let parts = full_name.clone().filter(|_| has_parts);
            let variables_reference = parts.map_or(0, |name| self.reference(Unfolded::Parts(name)));
            variables.push(Variable { name, value, evaluate_name: full_name, variables_reference });
        }
        Ok(json!({"variables": variables}))
    }

    pub(super) fn set_variable(
        &mut self,
        arguments: &SetVariableArguments,
    ) -> Result<Value, DebugError> {
        let name = arguments.name.split(' ').next().unwrap_or_default();
        let debugger = self.debugger()?;
        let tick = debugger.change(name, Some(&arguments.value), false)?;
        let value = match tick == debugger.position().tick && !debugger.changes_control() {
            true => debugger.evaluate(name)?,
            false => format!("{} (from tick {tick} on)", arguments.value),
        };
        Ok(json!({"value": value, "variablesReference": 0}))
    }

    fn loaded_sources(&mut self) -> Result<Value, DebugError> {
        let count = self.debugger()?.program().sources().len() as u32;
        let sources: Result<Vec<_>, _> = (0..count).map(|id| self.source(FileId(id))).collect();
        Ok(json!({"sources": sources?}))
    }

    fn source_text(&mut self, arguments: &SourceArguments) -> Result<Value, DebugError> {
        let mut source = arguments.source.clone();
        source.source_reference = source.source_reference.or(Some(arguments.source_reference));
        let file = self.file(&source)?;
        Ok(json!({"content": self.debugger()?.program().sources().text(file)}))
    }

    /// A step; with the granularity `line` it goes on as long as it stays in the line, since NCT has
    /// several statements in one.
    fn step(&mut self, arguments: &StepArguments, kind: StepKind, way: Direction) -> Answer {
        let by_line = arguments.granularity == "line";
        let from = self.line_here()?;
        loop {
            let stopped = self.debugger()?.step(kind, way)?;
            if !by_line || stopped != Stopped::Step || self.line_here()? != from {
                return Ok((Value::Null, Some(stopped)));
            }
        }
    }

    /// Tick, file and line of the statement at the position.
    fn line_here(&mut self) -> Result<Option<(u64, FileId, u32)>, DebugError> {
        let debugger = self.debugger()?;
        let tick = debugger.position().tick;
        let place = debugger
            .step_here()?
            .and_then(|step| debugger.program().places().place(step.statement));
        Ok(place.map(|place| (tick, place.file, place.line)))
    }

    fn move_by(&mut self, kind: StepKind, way: Direction) -> Answer {
        let stopped = self.debugger()?.step(kind, way)?;
        Ok((Value::Null, Some(stopped)))
    }

    /// Where the program stands: tick, time, and the known ticks.
    pub(super) fn position(&mut self) -> Result<Value, DebugError> {
        let debugger = self.debugger()?;
        let position = debugger.position();
        let milliseconds = position.tick as f64 * debugger.tick_ns() as f64 / 1e6;
        Ok(json!({
            "tick": position.tick,
            "statement": position.step,
            "milliseconds": milliseconds,
            "firstTick": debugger.first_tick(),
            "knownTicks": debugger.known_ticks(),
        }))
    }
}

/// What the statement reads and writes; each name once for reading and once for writing.
fn accesses(debugger: &mut plcc_replay::Debugger<'_>) -> Result<Vec<Shown>, DebugError> {
    let mut all: Vec<Shown> = vec![];
    let mut places: HashMap<String, usize> = HashMap::new();
    for access in debugger.accesses()? {
        let Some(full) = debugger.program().name(access.variable) else { continue };
        let now = show_value(access.value);
        let (name, value) = if access.is_write {
            let before = debugger.evaluate(&full).ok();
            let value = match before.filter(|before| *before != now) {
                Some(before) => format!("{before} → {now}"),
                None => now,
            };
            (format!("{full} (written)"), value)
        } else {
            (format!("{full} (read)"), now)
        };
        let shown = Shown { name, value, full_name: Some(full), has_parts: false };
        let place = *places.entry(shown.name.clone()).or_insert(all.len());
        match all.get_mut(place) {
            Some(known) => *known = shown,
            None => all.push(shown),
        }
    }
    Ok(all)
}
