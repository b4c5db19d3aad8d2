//! A program of PMI in IEC 61131-3, with what the control does around it: timers and flip-flops are written out where the
//! program assigns to them (PMI 3.1.9, 3.1.10), and what happens before and after a scan stands around the statements
//! (rulings, Scan).

mod expression;
mod scan;
mod statement;
mod variables;

use plcc_abi::GivenName;
use plcc_diag::{Diagnostic, FileId, SourceMap};
use plcc_iec::{Flow, Names, Project, Type, Variable};

use super::ast::Checked;
use super::language::COMMENT_SIGNS;
use crate::common::{CommentsInOrder, Exported, Held};
use variables::Variables;

/// The time between two scans, which is that of the timers too.
const PERIOD_US: u64 = 20_000;

/// The program under a name. `given` says what people say of its variables.
pub(super) fn export(
    checked: &Checked,
    sources: &SourceMap,
    name: &str,
    given: &[GivenName],
) -> Exported {
    let mut names = Names::new();
    let mut variables = Variables::new(checked, given, &mut names);
    let mut comments = CommentsInOrder::new(sources, COMMENT_SIGNS);
    // The comments of the declarations are beside those.
    for id in (0..sources.len() as u32).map(FileId) {
        let end = sources.text(id).lines().position(|line| line.trim_start().starts_with("$END"));
        // An included file may have statements alone.
        comments.skip_to(id, end.map_or(1, |line| line as u32 + 2));
    }
    let own = Own::new(checked, &mut names);
    // The program's variables keep their names.
    let program = names.make(name);
    let items = statement::items(checked, &variables, &own, &mut comments);
    let flow = Flow::new(&items, [], &own.next);
    if flow.has_blocks() {
        let about = "the number of the block of statements that is next, 0 at the end of the scan";
        variables.add(Variable::local(own.next.clone(), Type::Dint, about));
    }
    let rest = checked.steps.last().map(|step| comments.rest(step.span)).unwrap_or_default();
    let body = scan::body(checked, &mut variables, &own, &flow, &rest);
    own.declare(&mut variables);
    let path = sources.path(FileId(0));
    let project = Project {
        name: program,
        comments: vec![
            format!("{path}, a program of the SERIES 8 in PMI, written in IEC 61131-3 by plcc"),
            "Each call of the program is a scan of the control; between two scans are 20 ms".into(),
        ],
        variables: variables.list,
        body,
        interval_us: PERIOD_US,
    }
    .complete();
    let names = variables.pairs.into_iter();
    let names = names.map(|(name, variable)| (name, Held::Variable(variable))).collect();
    Exported { project, names, notes: notes(checked) }
}

/// Faults and messages are variables of the program; to show their texts is the control's.
fn notes(checked: &Checked) -> Vec<Diagnostic> {
    let all = checked.faults.iter().chain(&checked.messages);
    let note = |announcement: &super::ast::Announcement| {
        let symbol = checked.symbol(announcement.symbol)?;
        let text = format!(
            "the control shows the text of {}; in IEC 61131-3 it is a comment of the variable, and something else has to show it",
            symbol.name
        );
        Some(Diagnostic::standalone_note("PMI-X6", symbol.declared?, text))
    };
    all.filter_map(note).collect()
}

/// The variables that the program in IEC 61131-3 has besides those of the source.
struct Own {
    /// The number of the next block.
    next: String,
    /// The line of the statement that stopped the program, 0 while it runs.
    stop: String,
    /// Whether a statement may stop it.
    stops: bool,
    /// True in the first scan.
    first: String,
    /// Indices of arrays.
    indices: Vec<String>,
    /// The counter of each timer.
    counters: Vec<String>,
    /// The clock of each flip-flop as it was assigned last.
    clocks: Vec<String>,
}

impl Own {
    fn new(checked: &Checked, names: &mut Names) -> Self {
        let name = |id| checked.symbol(id).map_or("", |symbol| symbol.name.as_str());
        let mut behind = |id, text: &str| names.make(&format!("{}_{text}", name(id)));
        let timers = checked.timers.iter();
        let counters = timers.map(|timer| behind(timer.control, "COUNT")).collect();
        let flipflops = checked.flipflops.iter();
        let clocks = flipflops.map(|it| behind(it.clock, "BEFORE")).collect();
        let most = statement::most_indices(checked);
        Self {
            next: names.make("NEXT_BLOCK"),
            stop: names.make("STOP_LINE"),
            stops: most > 0,
            first: names.make("FIRST_SCAN"),
            indices: (1..=most).map(|n| names.make(&format!("INDEX{n}"))).collect(),
            counters,
            clocks,
        }
    }

    fn declare(&self, variables: &mut Variables) {
        for (counter, timer) in self.counters.iter().zip(variables.checked.timers.iter()) {
            let name = variables.checked.symbol(timer.control).map_or("", |it| it.name.as_str());
            let about =
                format!("the counter of the timer {name}, in units of 20 ms; -1: it does not run");
            let initial = vec!["-1".to_owned()];
            variables.add(Variable { initial, ..Variable::local(counter, Type::Dint, about) });
        }
        for (clock, flipflop) in self.clocks.iter().zip(variables.checked.flipflops.iter()) {
            let name = variables.checked.symbol(flipflop.clock).map_or("", |it| it.name.as_str());
            let about = format!("{name} as it was assigned last");
            variables.add(Variable::local(clock, Type::Bool, about));
        }
        for index in &self.indices {
            variables.add(Variable::local(index, Type::Int, "an index"));
        }
        if self.stops {
            let about =
                "the line whose index was outside its array; the control does not scan again";
            variables.add(Variable::local(&self.stop, Type::Dint, about));
        }
        if variables.needs_first_scan() {
            let initial = vec!["TRUE".to_owned()];
            let variable = Variable::local(&self.first, Type::Bool, "the first scan");
            variables.add(Variable { initial, ..variable });
        }
    }
}
