//! Sessions of small programs, for tests.

use plcc_abi::{Dialect, GivenName, Program};
use plcc_control::ControlArgs;
use plcc_diag::SourceMap;
use plcc_frontend::common::{MemoryLoader, Options};
use plcc_frontend::language;
use plcc_replay::{DebuggedProgram, Launched};
use plcc_runtime::stimulus::{Player, Stimulus};

use crate::view::{Body, Screen, StatementLine, StatementsView, TargetKind};
use crate::{Session, Target};

/// A program with a stimulus, opened, before its first tick.
pub(crate) fn open(dialect: Dialect, text: &str, stimulus: &str) -> Session<'static> {
    open_with(dialect, text, stimulus, &ControlArgs::default(), vec![])
}

/// The same with what a machine file says of variables.
pub(crate) fn open_with_names(
    dialect: Dialect,
    text: &str,
    stimulus: &str,
    names: Vec<GivenName>,
) -> Session<'static> {
    open_with(dialect, text, stimulus, &ControlArgs::default(), names)
}

/// The same of a PMAC whose motors are simulated.
pub(crate) fn open_with_motors(text: &str, stimulus: &str) -> Session<'static> {
    let mut args = ControlArgs::default();
    args.pmac.motors = Some(vec![]);
    open_with(Dialect::Pmac, text, stimulus, &args, vec![])
}

fn open_with(
    dialect: Dialect,
    text: &str,
    stimulus: &str,
    args: &ControlArgs,
    names: Vec<GivenName>,
) -> Session<'static> {
    let mut sources = SourceMap::new();
    let file = sources.add("main".to_owned(), text.as_bytes());
    let options = Options::default();
    let loader = MemoryLoader::new();
    let (checked, diagnostics) = language(dialect).check(&mut sources, &[file], &loader, &options);
    let checked = checked.unwrap_or_else(|| panic!("{diagnostics:?}"));
    let tables = Program { names, ..checked.lower().unwrap().program };
    let make = || plcc_control::executive(&tables, args, false, None).unwrap();
    let (executive, view) = (make(), make());
    let stimulus = format!("tick,name,value\n{stimulus}");
    let stimulus =
        Stimulus::parse(stimulus.as_bytes(), &*executive.names(), executive.tick_ns()).unwrap();
    let player = Player::new(stimulus, false);
    let history = Launched::new(executive, checked.interpreter(), player, None);
    let program = DebuggedProgram::new(checked, sources, tables);
    let run = plcc_replay::Session::offline(program, Box::new(history), view, true);
    Session::open(Target {
        kind: TargetKind::Program,
        name: "main".into(),
        run: Some(run),
        socket: None,
        state_folder: None,
        speed: 0.0,
        operator: false,
        rebuilder: None,
    })
}

impl Session<'_> {
    /// Runs the program up to a tick, and shows that.
    pub(crate) fn run_to(&mut self, tick: u64) {
        while self.status().last_tick < tick {
            self.poll();
        }
        self.apply(crate::Command::GoToTick { tick }).unwrap();
    }

    /// All statements.
    pub(crate) fn statements(&mut self) -> StatementsView {
        match self.view(&Screen::Statements { first: Some(0), count: 10_000 }).body {
            Body::Statements(view) => view,
            other => panic!("{other:?}"),
        }
    }
}

/// A line as text: `~` before what was not executed, `_` around what is true, `=value` after numbers.
pub(crate) fn drawn(line: &StatementLine) -> String {
    use crate::view::Execution;
    let mut text = String::new();
    if line.execution == Execution::NotExecuted {
        text.push('~');
    }
    for token in &line.tokens {
        match (&token.truth, &token.value) {
            (Some(true), _) => text.push_str(&format!("_{}_", token.text)),
            (_, Some(value)) => text.push_str(&format!("{}={value}", token.text)),
            _ => text.push_str(&token.text),
        }
    }
    text
}
