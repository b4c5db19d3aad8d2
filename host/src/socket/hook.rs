//! The side of the thread that runs the ticks: before each tick it carries out commands from the
//! socket, and after each tick it writes the image file.

use std::sync::Arc;
use std::time::Instant;

use plcc_image::monotonic_ns;

use super::commands::{Answer, Batch, Command, Item, RunProgress, ScanEnd};
use crate::image_file::{Publisher, State};
use crate::replacement::Progress;
use crate::run::{AfterTick, BeforeTick, Hook};
use plcc_protocol::VALUES_PER_TICK;
use plcc_record::ReplaceableExecutive;
use plcc_runtime::Executive;
use plcc_runtime::variable::MAX_FORCES;

/// How many commands are carried out before a tick at most.
const COMMANDS_PER_TICK: usize = 16;

/// Why an input is not set that is forced; the end of a sentence that begins with its name.
const HELD_BY_FORCE: &str = "is forced, so that setting it would do nothing; end its force first (unforce), or force it to \
                             another value (force)";
/// Why an input is not set that another process gives; the end of such a sentence.
const HELD_BY_WRITER: &str = "is given by another process by the image file ([[io]]), so that setting it would do nothing; \
                              force it instead (force)";

/// What acts on a run from outside, and shows it to the outside.
pub(crate) struct InterfaceHook {
    socket: Option<ScanEnd>,
    publisher: Option<Publisher>,
    progress: Arc<RunProgress>,
    /// A command with a batch of which a part is done, or a replacement that waits. Behind the latter nothing else comes
    /// than its withdrawal, since other commands name variables of one of the two programs.
    unfinished: Option<Command>,
    /// What the image file and the socket were told last.
    state: State,
    /// Whether a client has stopped the program.
    held: bool,
    /// Whether the run has a stimulus, which may set inputs that other processes give, too.
    has_stimulus: bool,
    /// Whether a client has set variables, among which may be such inputs, or replaced the program.
    inputs_again: bool,
}

impl InterfaceHook {
    pub(crate) fn new(
        socket: Option<ScanEnd>,
        publisher: Option<Publisher>,
        progress: Arc<RunProgress>,
        has_stimulus: bool,
    ) -> Self {
        Self {
            socket,
            publisher,
            progress,
            unfinished: None,
            state: State::Prepared,
            held: false,
            has_stimulus,
            inputs_again: false,
        }
    }

    /// Writes the image file for the last time, when the run has ended. A program that the control has
    /// stopped stays stopped in it.
    pub(crate) fn end(&mut self, ticks: u64, executive: &dyn Executive) {
        if self.state != State::Stopped || self.held {
            self.state = State::Ended;
        }
        self.publish(ticks, executive);
    }

    /// Carries out a command, but for no more variables than `left`, which it lowers by those that it
    /// has done. Gives whether the whole command is done.
    fn carry_out(
        &mut self,
        command: &mut Command,
        now: &mut BeforeTick<'_>,
        left: &mut usize,
    ) -> bool {
        let (tick, executive) = (now.tick, &mut *now.executive);
        match command {
            Command::Read(batch) => {
                let is_done =
                    do_items(batch, tick, left, |item| item.value = executive.read(item.key));
                let image = executive.image();
                if is_done && batch.image.len() == image.len() {
                    batch.image.copy_from_slice(image);
                }
                is_done
            }
            Command::Write(batch) => {
                let publisher = self.publisher.as_ref();
                let why_not = |key| match publisher.is_some_and(|publisher| publisher.holds(key)) {
                    _ if executive.is_held(key) => Some(HELD_BY_FORCE),
                    true => Some(HELD_BY_WRITER),
                    false => None,
                };
                let next = batch.items.iter().enumerate().skip(batch.done).take(*left);
                let refused = |(number, item): (usize, &Item)| Some((number, why_not(item.key)?));
                batch.refused = next.filter_map(refused).next();
                if batch.refused.is_some() {
                    return true;
                }
                self.inputs_again = true;
                do_items(batch, tick, left, |item| {
                    if let Some(setting) = item.setting {
                        executive.write(item.key, setting);
                    }
                })
            }
            Command::Force(batch) => force_all(batch, executive, left),
            Command::Stop => {
                self.held = true;
                true
            }
            Command::Start => {
                self.held = false;
                true
            }
            Command::Replace(replacement) => {
                match executive.as_any_mut().downcast_mut::<ReplaceableExecutive>() {
                    Some(own) => {
                        replacement.carry_out(own, &mut self.publisher, now.player, now.watch);
                    }
                    None => {
                        let why = "the run has an executive that can't be replaced";
                        replacement.progress = Progress::Failed(why);
                    }
                }
                if replacement.progress == Progress::Done {
                    // Nothing is written of the new program yet. While it is held, no tick does that.
                    self.state = State::Prepared;
                    self.inputs_again = true;
                }
                !matches!(replacement.progress, Progress::Waits(_))
            }
            Command::Withdraw => true,
        }
    }

    fn publish(&mut self, ticks: u64, executive: &dyn Executive) {
        self.progress.set(ticks, self.state);
        if let Some(publisher) = &mut self.publisher {
            let mut forces = 0;
            executive.each_force(&mut |_, _| forces += 1);
            publisher.publish(executive.image(), ticks, monotonic_ns(), self.state, forces);
        }
    }
}

/// Does as many items of a batch as `left` allows before this tick. Gives whether the batch is done.
fn do_items(
    batch: &mut Batch,
    tick: u64,
    left: &mut usize,
    mut act: impl FnMut(&mut Item),
) -> bool {
    if batch.done == 0 {
        batch.first_tick = tick;
    }
    let items = batch.items.iter_mut().skip(batch.done).take(*left);
    let mut done = 0;
    for item in items {
        act(item);
        done += 1;
    }
    *left -= done;
    batch.done += done;
    batch.done == batch.items.len()
}

/// Whether a command is a replacement whose withdrawal has come.
fn is_withdrawn(command: &Command, socket: &mut ScanEnd) -> bool {
    matches!(command, Command::Replace(_)) && matches!(socket.commands.pop(), Ok(Command::Withdraw))
}

// So that all forces of a batch can be done before one tick.
const _: () = assert!(MAX_FORCES <= VALUES_PER_TICK);

/// Forces all variables of a batch, or, if one of them can't be forced, none: only the executive that runs
/// knows that, since a program of a PMAC may move its variables. Gives whether the batch is done; if
/// `left` does not suffice it is done before the next tick.
fn force_all(batch: &mut Batch, executive: &mut dyn Executive, left: &mut usize) -> bool {
    if batch.items.len() > *left {
        *left = 0;
        return false;
    }
    *left -= batch.items.len();
    for (number, item) in batch.items.iter().enumerate() {
        if let Err(why) = executive.force(item.key, item.setting) {
            for done in batch.items.iter().take(number).rev() {
                // It had this force before, so it can have it again. Ending a force never fails.
                let _ = executive.force(done.key, done.before);
            }
            batch.refused = Some((number, why));
            break;
        }
    }
    executive.each_force(&mut |key, setting| {
        // No more than there can be, so that nothing is allocated.
        if batch.forces.len() < batch.forces.capacity() {
            batch.forces.push((key, setting));
        }
    });
    true
}

impl Hook for InterfaceHook {
    fn before_tick(&mut self, now: &mut BeforeTick<'_>) {
        self.carry_out_commands(now);
        // A program that stands still takes no inputs.
        if let Some(publisher) = self.publisher.as_mut().filter(|_| !self.held) {
            let again = std::mem::take(&mut self.inputs_again) || self.has_stimulus;
            publisher.latch(now.executive, now.tick, again, now.journal);
        }
    }

    fn after_tick(&mut self, now: &mut AfterTick<'_>) {
        self.state = if now.stop.is_some() { State::Stopped } else { State::Running };
        self.publish(now.ticks, now.executive);
    }
}

impl InterfaceHook {
    /// Carries out what has come by the socket, and stops the program or has it go on.
    fn carry_out_commands(&mut self, now: &mut BeforeTick<'_>) {
        let Some(mut socket) = self.socket.take() else { return };
        let mut left = VALUES_PER_TICK;
        for _ in 0..COMMANDS_PER_TICK {
            // Without room for an answer a command stays where it is.
            if left == 0 || socket.answers.is_full() {
                break;
            }
            let next = self.unfinished.take().or_else(|| socket.commands.pop().ok());
            let Some(mut command) = next else { break };
            let start = Instant::now();
            let is_done = self.carry_out(&mut command, now, &mut left);
            if !is_done && !is_withdrawn(&command, &mut socket) {
                self.unfinished = Some(command);
                break;
            }
            if matches!(command, Command::Withdraw) {
                // What it withdraws was carried out before.
                continue;
            }
            let answer = Answer { command, tick: now.tick, took: start.elapsed() };
            // There is room, as was seen above; nobody else puts answers in.
            let _ = socket.answers.push(answer);
        }
        self.socket = Some(socket);
        if self.held {
            now.hold = true;
            if self.state != State::Stopped {
                self.state = State::Stopped;
                now.executive.drive_safe_outputs();
                self.publish(now.tick, now.executive);
            }
        }
    }
}
