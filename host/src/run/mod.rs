//! Runs a program tick by tick: applies the stimulus, has the executive do the tick, and writes trace
//! and events.
//!
//! [`Run`] is what `plcc run` and `plcrt` do, for callers in the same process; any [`Write`] can take
//! the place of a file.

#[cfg(target_os = "linux")]
mod dump_image;
mod hook;
mod output_thread;
mod pace;
mod queues;
mod timing;
mod trace;
mod waveform_shape;

#[cfg(test)]
mod test_control;
#[cfg(test)]
mod tests;

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use plcc_abi::Engine;
use thiserror::Error;

use crate::journal::{EntryKind, ScanJournal};
use plcc_control::Watch;
use plcc_files::why_not_written;
use plcc_runtime::{Event, EventBody, Executive, Stop};

#[cfg(target_os = "linux")]
pub use dump_image::{dump_image, dump_image_alone};
pub use hook::{AfterTick, BeforeTick, Hook};
pub use pace::{Beginning, Clock, OverrunPolicy, Pacer, Punctuality, SystemClock};
pub use plcc_protocol::{TaskSummary, TimesSummary, TimingSummary};
pub use plcc_runtime::stimulus::{LineError, Player, Stimulus, StimulusError};
pub use queues::ReportQueues;
use timing::Budget;
pub use timing::{TimedEngine, Times, Timing};
pub use trace::{Trace, TraceFormat, TraceText};
pub use waveform_shape::WaveformShape;

/// Room for the events of one tick, so that no tick allocates memory for them unless its program was written
/// for that.
const EVENTS_OF_TICK: usize = 1024;

/// Everything that a run needs.
pub struct Run<'a> {
    /// The executive of the program, at power-up.
    pub executive: &'a mut dyn Executive,
    /// The engine that executes the program.
    pub engine: &'a mut dyn Engine,
    /// The stimulus, to be applied tick by tick.
    pub player: Player,
    /// The variables that the trace shows.
    pub watch: Watch,
    /// Where the trace is written, if it is.
    pub trace: Option<&'a mut dyn Write>,
    /// How the trace is written.
    pub trace_format: TraceFormat,
    /// Where the events are written, if they are, a JSON object a line.
    pub events: Option<&'a mut dyn Write>,
    /// In real time, the queues by which other threads write trace and events, in the place of `trace` and
    /// `events`.
    pub queues: Option<&'a mut ReportQueues>,
    /// How many ticks are run; `None` runs until the program is stopped or the flag `interrupt` is set.
    pub ticks: Option<u64>,
    /// The clock that says when each tick begins; without one the ticks follow each other as fast
    /// as they can.
    pub clock: Option<&'a dyn Clock>,
    /// What is done about ticks that begin too late, where a clock paces them.
    pub overrun: OverrunPolicy,
    /// Where it is recorded how late ticks begin and how long they take, where a clock paces them. A tick
    /// that needs more than four fifths of its time gets an entry in the journal.
    pub timing: Option<&'a Timing>,
    /// A flag that, once set, ends the run before its next tick. The physical outputs then take their
    /// safe values, as they do where an output of the run fails.
    pub interrupt: Option<&'a AtomicBool>,
    /// What else is done before and after each tick, in this order.
    pub hooks: Vec<&'a mut dyn Hook>,
    /// Where this thread writes entries about overruns and the like.
    pub journal: ScanJournal,
}

impl<'a> Run<'a> {
    /// A run of a program that nothing acts on, that writes nothing and goes on until it stops: the
    /// base for runs with some fields of their own.
    pub fn new(executive: &'a mut dyn Executive, engine: &'a mut dyn Engine) -> Self {
        Self {
            executive,
            engine,
            player: Player::new(Stimulus::default(), false),
            watch: Watch::default(),
            trace: None,
            trace_format: TraceFormat::default(),
            events: None,
            queues: None,
            ticks: None,
            clock: None,
            overrun: OverrunPolicy::Skip,
            timing: None,
            interrupt: None,
            hooks: vec![],
            journal: ScanJournal::discarding(),
        }
    }
}

/// How a run ended, and how far it came.
#[derive(Debug, Default)]
pub struct End {
    /// How many ticks have begun.
    pub ticks: u64,
    /// Why the control stopped the program in the last tick, if it did.
    pub stop: Option<Stop>,
    /// Whether the flag `interrupt` ended the run.
    pub interrupted: bool,
    /// How late ticks began, where a clock paced them.
    pub punctuality: Punctuality,
    /// Why an output could not be written, which ended the run.
    pub failure: Option<RunError>,
}

/// Why a run could not go on.
#[derive(Debug, Error)]
pub enum RunError {
    /// The trace can't be written.
    #[error("the trace can't be written: {}", why_not_written(.0))]
    Trace(io::Error),
    /// The events can't be written.
    #[error("the events can't be written: {}", why_not_written(.0))]
    Events(io::Error),
}

impl RunError {
    /// Whether the reader of the output has closed it (`plcc run … --trace - | head`), which is not an
    /// error.
    pub fn is_closed_pipe(&self) -> bool {
        let (Self::Trace(error) | Self::Events(error)) = self;
        error.kind() == io::ErrorKind::BrokenPipe
    }
}

impl Run<'_> {
    /// Runs until all ticks are done, the program is stopped, the flag is set or an output can't be
    /// written.
    pub fn go(mut self) -> End {
        let mut end = End::default();
        end.failure = self.run_ticks(&mut end).and_then(|()| self.flush()).err();
        // A program that was stopped has had its outputs made safe by the executive.
        if end.interrupted || end.failure.is_some() {
            self.executive.drive_safe_outputs();
        }
        end
    }

    /// Runs the ticks and notes in `end` how far the run comes.
    fn run_ticks(&mut self, end: &mut End) -> Result<(), RunError> {
        let mut trace = Trace::new(&self.watch, self.trace_format, &*self.executive.names());
        if let Some(out) = &mut self.trace {
            trace.header(out).map_err(RunError::Trace)?;
        }
        let mut time_ns: u64 = 0;
        let mut events_of_tick: Vec<Event> = Vec::with_capacity(EVENTS_OF_TICK);
        let mut budget = Budget::default();
        let mut pacer = self.clock.map(|clock| (Pacer::new(self.overrun), clock));
        // Whether a hook has the program stand still.
        let mut held = false;
        while self.ticks.is_none_or(|ticks| end.ticks < ticks) {
            let mut beginning = Beginning::default();
            let before = end.punctuality;
            if let Some((pacer, clock)) = &mut pacer {
                let tick = Duration::from_nanos(self.executive.tick_ns());
                let left = self.ticks.map(|ticks| ticks - end.ticks);
                beginning = pacer.wait(*clock, tick, left, self.interrupt).unwrap_or_default();
                end.punctuality = pacer.punctuality();
            }
            if held {
                // Time stands still for the program, so none of its ticks is late.
                beginning = Beginning { late: beginning.late, ..Beginning::default() };
                end.punctuality = before;
                if let Some((pacer, _)) = &mut pacer {
                    pacer.set_punctuality(before);
                }
            }
            if self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                end.interrupted = true;
                break;
            }
            if beginning.skip > 0 {
                let skipped_ns = self.executive.tick_ns().saturating_mul(beginning.skip);
                time_ns = time_ns.saturating_add(skipped_ns);
                self.skip(end.ticks, beginning.skip);
                end.ticks += beginning.skip;
            }
            if beginning.overrun {
                let Beginning { late, skip, .. } = beginning;
                self.journal.write(end.ticks, EntryKind::Overrun { late, skipped: skip });
                if let Some(timing) = self.timing {
                    timing.count_overrun(skip);
                }
            }
            let tick = end.ticks;
            let tick_ns = self.executive.tick_ns();
            self.journal.begin_tick(tick);
            held = false;
            for hook in &mut self.hooks {
                let mut now = BeforeTick {
                    tick,
                    executive: self.executive,
                    engine: self.engine,
                    player: &mut self.player,
                    watch: &mut self.watch,
                    hold: false,
                    journal: &mut self.journal,
                };
                hook.before_tick(&mut now);
                held |= now.hold;
            }
            if held {
                continue;
            }
            end.ticks += 1;
            let result = if beginning.stop {
                self.executive.drive_safe_outputs();
                Err(overrun_stop(beginning.late))
            } else {
                self.player.apply(tick, self.executive);
                let begun = self.clock.map(|clock| clock.now());
                if let (Some(timing), Some(begun)) = (self.timing, begun) {
                    timing.tick_begins(begun);
                }
                let result = self.executive.tick(self.engine, &mut events_of_tick);
                if let (Some(timing), Some(clock), Some(begun)) = (self.timing, self.clock, begun) {
                    let now = clock.now();
                    timing.lateness.record(beginning.late);
                    timing.ticks.record(now.saturating_duration_since(begun));
                    budget.check(
                        tick,
                        now - begun,
                        Duration::from_nanos(tick_ns),
                        now,
                        &mut self.journal,
                    );
                }
                result
            };
            if let Err(stop) = result {
                let (file, line) = stop.place.clone().map(|place| (place.file, place.line)).unzip();
                let body = EventBody::Stop { code: stop.code.clone(), file, line };
                events_of_tick.push(Event { tick, body });
                end.stop = Some(stop);
            }
            if self.clock.is_some() {
                self.announce(&events_of_tick);
            }
            self.write(tick, time_ns, &mut events_of_tick, &mut trace)?;
            time_ns = time_ns.saturating_add(tick_ns);
            let next_tick = pacer.as_ref().and_then(|(pacer, clock)| Some((*clock, pacer.due()?)));
            for hook in &mut self.hooks {
                hook.after_tick(&mut AfterTick {
                    ticks: end.ticks,
                    executive: self.executive,
                    engine: self.engine,
                    stop: end.stop.as_ref(),
                    next_tick,
                    journal: &mut self.journal,
                });
            }
            if end.stop.is_some() {
                break;
            }
        }
        if let Some(queues) = &mut self.queues {
            queues.end(time_ns);
        }
        if let Some(out) = &mut self.trace {
            trace.end(time_ns, out).map_err(RunError::Trace)?;
        }
        Ok(())
    }

    /// Skips `count` ticks, from the tick `first` on: their time passes, and their stimulus acts, in order.
    /// The rows of a skipped tick act before the timers go down by the time of that tick.
    fn skip(&mut self, first: u64, count: u64) {
        let (mut tick, end) = (first, first.saturating_add(count));
        while tick < end {
            self.player.apply(tick, self.executive);
            let next = self.player.next_after(tick).min(end);
            self.executive.skip_ticks(next - tick);
            tick = next;
        }
    }

    /// Tells people on standard error of faults and messages that come and go.
    fn announce(&mut self, events_of_tick: &[Event]) {
        for event in events_of_tick {
            if let Some(kind) = EntryKind::announced(&event.body) {
                self.journal.write(event.tick, kind);
            }
        }
    }

    /// Writes the events of a tick and what has changed in it. The tick began `time_ns` nanoseconds
    /// after the first one.
    fn write(
        &mut self,
        tick: u64,
        time_ns: u64,
        events_of_tick: &mut Vec<Event>,
        trace: &mut Trace,
    ) -> Result<(), RunError> {
        if let Some(queues) = &mut self.queues {
            queues.tick((tick, time_ns), &self.watch, self.executive, events_of_tick);
            return Ok(());
        }
        if let Some(out) = &mut self.events {
            let any = !events_of_tick.is_empty();
            let names = self.executive.names();
            for event in events_of_tick.iter() {
                serde_json::to_writer(&mut *out, &*self.watch.shown_event(event, &*names))
                    .map_err(io::Error::from)
                    .and_then(|()| out.write_all(b"\n"))
                    .map_err(RunError::Events)?;
            }
            if any && self.clock.is_some() {
                out.flush().map_err(RunError::Events)?;
            }
        }
        events_of_tick.clear();
        if let Some(out) = &mut self.trace {
            let any = trace
                .rows((tick, time_ns), &self.watch, self.executive, out)
                .map_err(RunError::Trace)?;
            if any && self.clock.is_some() {
                out.flush().map_err(RunError::Trace)?;
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), RunError> {
        if let Some(out) = &mut self.trace {
            out.flush().map_err(RunError::Trace)?;
        }
        match &mut self.events {
            Some(out) => out.flush().map_err(RunError::Events),
            None => Ok(()),
        }
    }
}

/// The stop of a program whose tick began only when a later one was already due (`--overrun stop`). That
/// tick counts, and is not scanned.
fn overrun_stop(late: Duration) -> Stop {
    let late = late.as_secs_f64() * 1000.0;
    let message = format!(
        "the tick began {late:.1} ms late, when a later one was already due; it was not scanned"
    );
    Stop { code: "OVERRUN".into(), message, place: None }
}
