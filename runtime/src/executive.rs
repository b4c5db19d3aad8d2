//! The interface between a run and a control: [`Executive`].

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use plcc_abi::Engine;

use crate::checkpoint::CheckpointError;
use crate::clock_decisions::ClockDecision;
use crate::event::Event;
use crate::names::Names;
use crate::online_change::{Plan, TakeOver};
use crate::retained::Restored;
use crate::safe_outputs::SafeLines;
use crate::stop::Stop;
use crate::value::Value;
use crate::variable::{Setting, VariableKey};
use crate::watchdog::Watchdog;

/// Whether a task runs when its turn comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskStatus {
    /// It runs.
    Enabled,
    /// It is passed over until it is enabled.
    Disabled,
    /// It is passed over until it is resumed; then it goes on where it was.
    Paused,
}

/// An assignment that the program has asked for earlier and the control has carried out, such as a PMAC's synchronous assignment,
/// which waits for its move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeferredAssignment<'a> {
    /// The variable that was assigned.
    pub variable: VariableKey,
    /// The file of the statement.
    pub file: &'a str,
    /// The line of the statement, from 1.
    pub line: u32,
}

/// What a control does around its program: it latches inputs, counts timers, calls tasks, drives
/// outputs and reports events. An executive holds the process image and all other state of the control.
/// The engine that executes the program is given to each tick, and can be any engine of the program.
pub trait Executive {
    /// The length of a base tick in nanoseconds of simulated time.
    fn tick_ns(&self) -> u64;

    /// Does one base tick, after the stimulus of that tick has been applied. Its events are appended to
    /// `events`, each with the tick's number, which the executive counts from 0.
    ///
    /// # Errors
    /// When the control stops the program. This was its last tick then; the caller adds the event
    /// `stop`.
    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop>;

    /// Lets the time of `count` base ticks pass that are not run: they count as ticks, and timers and
    /// everything else that time alone moves go on by them. Nothing is scanned, no input is latched,
    /// no output driven. Not to be called before the first tick.
    fn skip_ticks(&mut self, count: u64);

    /// The names of the program's variables, with the keys by which they are read and set here, and what is known of
    /// them.
    fn names(&self) -> Arc<dyn Names>;

    /// Reads a variable by its key; 0 for the key of another control. It does not wait, and allocates memory for an
    /// array only.
    fn read(&self, key: VariableKey) -> Value;

    /// Reads a variable into `value`. Where that holds an earlier value of the same variable, the memory of
    /// an array in it is used again, and nothing is allocated.
    fn read_into(&self, key: VariableKey, value: &mut Value);

    /// Sets a variable as the machine or the operator would. It neither allocates memory nor waits.
    fn write(&mut self, key: VariableKey, value: Setting);

    /// Appends the data that survives power-off, to be put into a file, and says whether there is
    /// any. It allocates nothing but more room for `out`.
    fn retained_into(&self, out: &mut Vec<u8>) -> bool;

    /// A number that tells whether the data that survives power-off may have changed: if it is the same as
    /// at an earlier call, the data is the same too. No two executives of a process give the same number.
    /// `None` where the control does not notice changes, so that the data itself has to be compared.
    fn retained_revision(&self) -> Option<u64>;

    /// The data that survives power-off; `None` where there is nothing to keep.
    fn retained(&self) -> Option<Vec<u8>> {
        let mut out = vec![];
        self.retained_into(&mut out).then_some(out)
    }

    /// Takes back what [`retained`](Self::retained) gave, before the first tick, and says what became
    /// of it. Of what another program of the same language has left, it takes what has the same name
    /// and type in this one.
    ///
    /// # Errors
    /// When it has another form; nothing is changed then.
    fn restore(&mut self, retained: &[u8]) -> Result<Restored, String>;

    /// The shortest time that the control itself gives a task in real time, if it limits any.
    fn shortest_time_limit(&self) -> Option<Duration>;

    /// Has every scan watched from now on: a program is stopped if a scan takes longer than the
    /// watchdog's limit.
    fn set_watchdog(&mut self, watchdog: Watchdog);

    /// The process image.
    fn image(&self) -> &[u8];

    /// Puts another process image of the same program, of the same length, in the place of this one,
    /// so that variables can be read as they were at that moment. The state outside the image stays;
    /// this is for executives that run nothing.
    fn set_image(&mut self, image: &[u8]);

    /// Says what the physical outputs become at a stop; all are switched off without it. The names give these lines:
    /// [`Names::safe_lines`].
    fn set_safe_lines(&mut self, lines: SafeLines);

    /// Where the physical outputs are in the process image, and what they become at a stop.
    fn safe_lines(&self) -> &SafeLines;

    /// Gives the physical outputs their safe values. [`tick`](Self::tick) does it itself when it stops
    /// the program, within that tick; this is for the caller that ends a run for another reason.
    /// Nothing is allocated. All variables that are not themselves physical outputs keep their values.
    fn drive_safe_outputs(&mut self);

    /// The whole state between two ticks, as bytes: the image and the state outside it. Events are not
    /// part of it, since they do not outlive a tick; neither is what was measured on the clock, by which
    /// watchdogs decide in real time.
    fn checkpoint(&self) -> Vec<u8>;

    /// Takes the state of a [`checkpoint`](Self::checkpoint) of the same program; ticks go on from there.
    /// An executive that has run ticks before must keep its engine, whose code may depend on assumptions
    /// that the process image notes. One that has not may be given any engine of the program. The options
    /// of the run stay this executive's own.
    ///
    /// # Errors
    /// When the bytes are not a checkpoint, are damaged, or belong to another program or version;
    /// nothing is changed then.
    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError>;

    /// Appends the state outside the process image, in the form in which a checkpoint holds it after
    /// the image. It allocates nothing but more room for `out`.
    fn state_into(&self, out: &mut Vec<u8>);

    /// Sorted ranges of the process image that hold the same bytes in every engine between two ticks:
    /// all but the places that engines use in their own way while a scan runs, or while their code
    /// assumes something of the program.
    fn compared_ranges(&self) -> Vec<Range<u32>>;

    /// What the clock alone has decided in the last tick, such as how far a module came within its
    /// time. Empty where every run of the tick goes the same way.
    fn clock_decisions(&self) -> &[ClockDecision];

    /// Has the next tick go as it went when the clock decided `decisions`, whatever the clock says
    /// now; `None` leaves it to the clock again.
    fn follow_clock(&mut self, decisions: Option<&[ClockDecision]>);

    /// Forces an input or a physical output: until the force ends, the program sees this value of the
    /// input whatever is latched, or the output's lines have this value whatever the program assigns.
    /// A stop of the program gives outputs their safe values whether they are forced or not. `None` ends
    /// the force. At most [`MAX_FORCES`](crate::variable::MAX_FORCES) can be in effect. It neither allocates memory nor waits.
    ///
    /// # Errors
    /// When the variable can't be forced; the reason follows its name.
    fn force(&mut self, key: VariableKey, value: Option<Setting>) -> Result<(), &'static str>;

    /// Shows `see` each force in effect: which variable is held, at what value. Nothing else keeps a list of them. It
    /// neither allocates memory nor waits.
    fn each_force(&self, see: &mut dyn FnMut(VariableKey, Setting));

    /// The forces in effect.
    fn forces(&self) -> Vec<(VariableKey, Setting)> {
        let mut forces = vec![];
        self.each_force(&mut |key, value| forces.push((key, value)));
        forces
    }

    /// Whether a force holds all of the variable, so that nothing would come of setting it. An output whose lines alone are
    /// held is not among them: its variable can be set.
    fn is_held(&self, key: VariableKey) -> bool;

    /// Shows `see` the deferred assignments that the last tick has carried out, in their order. Languages without them
    /// have none.
    fn each_deferred_assignment(&self, see: &mut dyn FnMut(DeferredAssignment<'_>));

    /// Whether each task of the program runs when its turn comes, by the tasks' numbers. Empty in languages
    /// whose tasks always run.
    fn task_statuses(&self) -> Vec<TaskStatus>;

    /// A number that tells the program from others, and is the same in every process.
    fn fingerprint(&self) -> u64;

    /// The parts of the process image that the program is known to use. Empty where all of it counts as
    /// used.
    fn used_ranges(&self) -> Vec<Range<u32>>;

    /// Takes over the state of an executive of another program of the same control, as `plan` says,
    /// between two ticks. It neither allocates memory nor waits.
    fn take_over(&mut self, old: &mut dyn Executive, plan: &Plan) -> TakeOver;

    /// What people are to be told when the run has ended, such as what a simulated control still waits for.
    fn notes_at_end(&self) -> Vec<String> {
        vec![]
    }

    /// The executive as a value of its own type, for an online change, which takes the state of one
    /// executive over into another one of the same control.
    fn as_any_mut(&mut self) -> &mut dyn Any;
}
