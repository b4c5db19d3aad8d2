//! The flow: what the statements of a program read and wrote in the last scan of each task, up to a tick. This is what
//! displays of statements show beside the text.

use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};

use plcc_frontend::common::{Accessed, Observer, Value};
use plcc_replay::observers::TickObserver;
use plcc_replay::trace::{Access, Call};

/// How many ticks are searched for the last scan of each task. A PMAC runs its up to 31 background
/// PLCs in turn, one a tick.
pub(crate) const LOOK_BACK: u64 = 40;

/// How many traces of ticks are kept.
const MAX_TRACES: usize = 3 * LOOK_BACK as usize;

/// The statements of a tick, without the process images that a debugger's trace has.
#[derive(Clone, Debug, Default)]
pub(crate) struct TickSteps {
    pub(crate) calls: Vec<Call>,
    /// Statement and number of its call, in order of execution.
    pub(crate) steps: Vec<(u32, usize)>,
    /// For each step the index of its first access in `accesses`.
    first_access: Vec<usize>,
    accesses: Vec<Access>,
    /// How long the interpreter took for each step.
    times: Vec<Duration>,
}

impl TickSteps {
    /// How long the statement interpreter took for a step, the taking down of its values included.
    pub(crate) fn time(&self, step: usize) -> Duration {
        self.times.get(step).copied().unwrap_or_default()
    }

    /// What a step read and wrote.
    pub(crate) fn accesses(&self, step: usize) -> &[Access] {
        let Some(&from) = self.first_access.get(step) else { return &[] };
        let to = self.first_access.get(step + 1).copied().unwrap_or(self.accesses.len());
        self.accesses.get(from..to).unwrap_or(&[])
    }
}

/// Records the statements of a tick.
#[derive(Debug)]
pub(crate) struct StepsRecorder<'a> {
    /// By a statement's number, whether it has a place in the source; others are not recorded.
    placed: &'a [bool],
    steps: TickSteps,
    /// Whether the statement that is executed now has a place in the source.
    in_step: bool,
    /// When the statement that runs has begun.
    begun: Instant,
}

impl<'a> StepsRecorder<'a> {
    pub(crate) fn new(placed: &'a [bool]) -> Self {
        Self { placed, steps: TickSteps::default(), in_step: false, begun: Instant::now() }
    }

    pub(crate) fn finish(self) -> TickSteps {
        self.steps
    }

    /// Notes how long the statement took that has ended.
    fn end_step(&mut self) {
        if self.in_step {
            self.steps.times.push(self.begun.elapsed());
        }
        self.in_step = false;
    }

    fn access(&mut self, variable: Accessed, value: Value, is_write: bool) {
        if self.in_step {
            self.steps.accesses.push(Access { variable, value, is_write });
        }
    }
}

impl Observer for StepsRecorder<'_> {
    fn statement(&mut self, statement: u32, _: &[u8]) {
        self.end_step();
        self.in_step = self.placed.get(statement as usize).copied().unwrap_or(false);
        if self.in_step {
            self.steps.steps.push((statement, self.steps.calls.len().saturating_sub(1)));
            self.steps.first_access.push(self.steps.accesses.len());
            self.begun = Instant::now();
        }
    }

    fn read(&mut self, variable: Accessed, value: Value) {
        self.access(variable, value, false);
    }

    fn write(&mut self, variable: Accessed, value: Value) {
        self.access(variable, value, true);
    }
}

impl TickObserver for StepsRecorder<'_> {
    fn call_begins(&mut self, task: usize, resumed: bool, _: &[u8]) {
        self.steps.calls.push(Call { task, resumed, suspended: false });
        self.end_step();
    }

    fn call_ends(&mut self, suspended: bool, _: &[u8]) {
        self.end_step();
        if let Some(call) = self.steps.calls.last_mut() {
            call.suspended = suspended;
        }
    }
}

/// The ticks whose statements are known.
#[derive(Debug, Default)]
pub(crate) struct Traces {
    ticks: BTreeMap<u64, TickSteps>,
}

impl Traces {
    pub(crate) fn insert(&mut self, tick: u64, steps: TickSteps) {
        self.ticks.insert(tick, steps);
        while self.ticks.len() > MAX_TRACES {
            // The trace of the tick that is farthest from this one is dropped.
            let first = self.ticks.keys().next().copied().unwrap_or(tick);
            let last = self.ticks.keys().next_back().copied().unwrap_or(tick);
            let farthest = if tick.abs_diff(first) >= tick.abs_diff(last) { first } else { last };
            self.ticks.remove(&farthest);
        }
    }

    /// Forgets all, since their statements are those of another version of the program.
    pub(crate) fn clear(&mut self) {
        self.ticks.clear();
    }

    pub(crate) fn get(&self, tick: u64) -> Option<&TickSteps> {
        self.ticks.get(&tick)
    }

    pub(crate) fn has(&self, tick: u64) -> bool {
        self.ticks.contains_key(&tick)
    }

    /// The ticks that are known without a gap up to `tick`, the newest first.
    fn back_from(&self, tick: u64) -> impl Iterator<Item = (u64, &TickSteps)> {
        let first = (tick + 1).saturating_sub(LOOK_BACK);
        (first..=tick).rev().map_while(|tick| Some((tick, self.ticks.get(&tick)?)))
    }
}

/// An execution of a statement.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Executed {
    /// How often the scan has executed it.
    pub(crate) times: u32,
    /// What it read and wrote when it was executed last.
    pub(crate) accesses: Vec<Access>,
}

/// The last scan of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TaskScan {
    /// The tick in which it began.
    pub(crate) begun: u64,
    /// The tick of its last call.
    pub(crate) tick: u64,
    /// Whether the task waits in the middle of its text.
    pub(crate) waits: bool,
    /// The statement that it executed last.
    pub(crate) last: Option<u32>,
    /// How many statements it has executed.
    pub(crate) statements: usize,
}

/// What the statements did.
#[derive(Clone, Debug, Default)]
pub(crate) struct Flow {
    /// By statement.
    pub(crate) executed: HashMap<u32, Executed>,
    /// By task.
    pub(crate) tasks: BTreeMap<usize, TaskScan>,
    /// How often a scan of each task began in the ticks that were looked at.
    pub(crate) begun: BTreeMap<usize, u64>,
    /// How many ticks were looked at.
    pub(crate) ticks: u64,
}

impl Flow {
    /// The last scan of each task, up to a tick. `scans_go_on` says what a scan is that was suspended: see
    /// [`Language::scans_go_on`](plcc_frontend::Language::scans_go_on).
    pub(crate) fn new(traces: &Traces, tick: u64, scans_go_on: bool) -> Self {
        let mut flow = Self::default();
        // The tasks whose last scan has been taken in from its beginning.
        let mut complete: Vec<usize> = vec![];
        for (tick, steps) in traces.back_from(tick) {
            flow.ticks += 1;
            for (number, call) in steps.calls.iter().enumerate().rev() {
                if !(call.resumed && scans_go_on) {
                    *flow.begun.entry(call.task).or_default() += 1;
                }
                if complete.contains(&call.task) {
                    continue;
                }
                flow.take(tick, steps, number, *call);
                if !(call.resumed && scans_go_on) {
                    complete.push(call.task);
                }
            }
        }
        flow
    }

    /// Adds a call of a task. Calls are added from the last to the first, so later calls of the same scan have been
    /// added before.
    fn take(&mut self, tick: u64, steps: &TickSteps, number: usize, call: Call) {
        let mut count = 0;
        let mut last = None;
        let of_call = steps.steps.iter().enumerate().rev().filter(|(_, step)| step.1 == number);
        for (at, &(statement, _)) in of_call {
            count += 1;
            last.get_or_insert(statement);
            let executed = self
                .executed
                .entry(statement)
                .or_insert_with(|| Executed { times: 0, accesses: steps.accesses(at).to_vec() });
            executed.times += 1;
        }
        let scan = self.tasks.entry(call.task).or_insert(TaskScan {
            begun: tick,
            tick,
            waits: call.suspended,
            last: None,
            statements: 0,
        });
        scan.begun = tick;
        scan.last = scan.last.or(last);
        scan.statements += count;
    }
}
