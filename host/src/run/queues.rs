//! Trace and events in real time: the thread that runs the ticks puts them into queues of fixed size, and
//! threads of their own write them. Where a queue is full, because its file takes nothing, rows and
//! events are lost and counted; no tick waits for them.

use std::fs::File;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::journal::{Journal, LossCounter};
use plcc_control::Watch;
use plcc_runtime::{Event, Executive, Names, Setting, Value};

use super::output_thread::OutputThread;
use super::{TraceFormat, TraceText};

/// How many events wait at most to be written.
const EVENTS: usize = 1 << 13;
/// How many values wait at most to be written; more where one tick may have more.
const VALUES: usize = 1 << 16;
/// Arrays of the trace have room for so many elements at least: an online change may make them longer, up to
/// the most that a PMI program can have (PMI 2.2.7).
const ARRAY: usize = 255;
/// How many bytes of text are made before they are written.
const PORTION: usize = 1 << 16;
/// How long the end of a run waits for the outputs.
const END_WAIT: Duration = Duration::from_secs(1);

/// The queues of a run in real time.
#[derive(Debug, Default)]
pub struct ReportQueues {
    trace: Option<TraceQueue>,
    events: Option<EventQueue>,
}

impl ReportQueues {
    /// No queues: nothing is reported.
    pub fn new() -> Self {
        Self::default()
    }

    /// Writes events to a file from now on, a JSON object a line. `watch` says how they show names, of which `names` are those of
    /// the program with which the run begins.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn write_events(
        &mut self,
        to: File,
        watch: &Watch,
        names: Arc<dyn Names>,
        journal: &Journal,
    ) -> io::Result<()> {
        let watch = watch.clone();
        let (queue, mut events) = rtrb::RingBuffer::<Event>::new(EVENTS);
        let lost = LossCounter::default();
        journal.tell_losses("events", lost.clone());
        let fill = move |buffer: &mut Vec<u8>| {
            while buffer.len() < PORTION {
                let Ok(event) = events.pop() else { return };
                // Writing to memory does not fail.
                let _ = serde_json::to_writer(&mut *buffer, &*watch.shown_event(&event, &*names));
                buffer.push(b'\n');
            }
        };
        let thread = OutputThread::start("events", to, vec![], journal.clone(), fill)?;
        self.events = Some(EventQueue { queue, lost, thread });
        Ok(())
    }

    /// Writes the changes of the watched variables to a file from now on.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn write_trace(
        &mut self,
        to: File,
        watch: &Watch,
        format: TraceFormat,
        executive: &dyn Executive,
        journal: &Journal,
    ) -> io::Result<()> {
        let mut text = TraceText::new(watch, format, &*executive.names());
        let mut header = vec![];
        text.header(&mut header)?;
        let get = |variable| with_room(executive.read(variable));
        let values = || watch.variables().map(get).collect::<Vec<Value>>();
        let elements = values().iter().map(room).sum::<usize>();
        // The end of the trace is a sample too.
        let (queue, samples) = rtrb::RingBuffer::new(VALUES.max(4 * elements) + 1);
        let lost = LossCounter::default();
        journal.tell_losses("trace", lost.clone());
        let mut samples = Samples { queue: samples, text, values: values() };
        let fill = move |buffer: &mut Vec<u8>| samples.fill(buffer);
        let thread = OutputThread::start("trace", to, header, journal.clone(), fill)?;
        self.trace = Some(TraceQueue {
            queue,
            lost,
            thread,
            present: values(),
            before: values(),
            sent: values(),
            never_sent: true,
            changed: Vec::with_capacity(elements),
        });
        Ok(())
    }

    /// Reports a tick: the values of the variables of `watch` that have changed in it, and its events, which are taken out of
    /// `events`. The tick began `time_ns` nanoseconds after the first one.
    pub(super) fn tick(
        &mut self,
        (tick, time_ns): (u64, u64),
        watch: &Watch,
        executive: &dyn Executive,
        events: &mut Vec<Event>,
    ) {
        if let Some(queue) = &mut self.events {
            for event in events.drain(..) {
                if queue.queue.push(event).is_err() {
                    queue.lost.add(1);
                }
            }
        }
        events.clear();
        if let Some(trace) = &mut self.trace {
            trace.tick((tick, time_ns), watch, executive);
        }
    }

    /// Reports the end of the run, `time_ns` nanoseconds after the first tick began.
    pub(super) fn end(&mut self, time_ns: u64) {
        if let Some(trace) = &mut self.trace {
            // Without room the trace ends without its last time.
            let _ = trace.queue.push(Sample::End { time_ns });
        }
    }

    /// Whether the trace has values that were lost and not sent since.
    #[cfg(test)]
    pub(super) fn has_unsent(&self) -> bool {
        self.trace.as_ref().is_some_and(|trace| trace.sent != trace.present)
    }

    /// Waits until everything is written, at most a second. Outputs that are stuck are left behind, and
    /// the journal tells it.
    pub fn finish(self) {
        let deadline = Instant::now() + END_WAIT;
        let threads = [self.trace.map(|trace| trace.thread), self.events.map(|it| it.thread)];
        for thread in threads.into_iter().flatten() {
            thread.finish(deadline);
        }
    }
}

#[derive(Debug)]
struct EventQueue {
    queue: rtrb::Producer<Event>,
    lost: LossCounter,
    thread: OutputThread,
}

/// A value on its way to the thread that writes the trace.
#[derive(Clone, Copy, Debug)]
enum Sample {
    /// A watched variable, or an element of one, has a new value at the end of a tick.
    Value {
        tick: u64,
        time_ns: u64,
        /// The variable's place in the list of watched ones.
        index: u32,
        element: u32,
        /// How many elements the variable has, if it is an array.
        elements: Option<u32>,
        value: Setting,
        /// Whether no further elements of this variable follow for this tick.
        complete: bool,
    },
    /// The run has ended.
    End { time_ns: u64 },
}

#[derive(Debug)]
struct TraceQueue {
    queue: rtrb::Producer<Sample>,
    lost: LossCounter,
    thread: OutputThread,
    /// The values now; arrays keep their memory from tick to tick.
    present: Vec<Value>,
    /// The values at the end of the tick before, by which rows that are lost are counted.
    before: Vec<Value>,
    /// The values that were sent last. Where something was lost, the next values that fit are compared
    /// with these, so that the trace is right again from there on.
    sent: Vec<Value>,
    never_sent: bool,
    changed: Vec<Sample>,
}

impl TraceQueue {
    fn tick(&mut self, (tick, time_ns): (u64, u64), watch: &Watch, executive: &dyn Executive) {
        self.changed.clear();
        let mut rows_of_tick = 0;
        let variables = watch.variables().zip(&mut self.present);
        let known = self.before.iter_mut().zip(&self.sent);
        for (((variable, value), (before, sent)), index) in variables.zip(known).zip(0..) {
            executive.read_into(variable, value);
            if value != before {
                rows_of_tick += 1;
                copy(value, before);
            }
            if value == sent && !self.never_sent {
                continue;
            }
            let first = self.changed.len();
            let elements = match &*value {
                Value::Array(values) => u32::try_from(values.len()).ok(),
                Value::Int(_) | Value::Float(_) => None,
            };
            // After an online change an array may have another number of elements.
            let all = self.never_sent || parts(value).len() != parts(sent).len();
            for (now, element) in parts(value).iter().zip(0..) {
                if all || parts(sent).get(element as usize) != Some(now) {
                    let (value, complete) = (setting(now), false);
                    let sample =
                        Sample::Value { tick, time_ns, index, element, elements, value, complete };
                    self.changed.push(sample);
                }
            }
            if let Some(Sample::Value { complete, .. }) =
                self.changed.get_mut(first..).and_then(<[_]>::last_mut)
            {
                *complete = true;
            }
        }
        // One place is kept for the end.
        if self.queue.slots() <= self.changed.len() {
            self.lost.add(if self.never_sent { self.sent.len() as u64 } else { rows_of_tick });
            return;
        }
        if self.changed.is_empty() {
            return;
        }
        for sample in &self.changed {
            // There is room, since only this thread fills the queue.
            let _ = self.queue.push(*sample);
        }
        for (sent, present) in self.sent.iter_mut().zip(&self.present) {
            if sent != present {
                copy(present, sent);
            }
        }
        self.never_sent = false;
    }
}

/// The elements of an array, or a value alone.
fn parts(value: &Value) -> &[Value] {
    match value {
        Value::Array(values) => values,
        Value::Int(_) | Value::Float(_) => std::slice::from_ref(value),
    }
}

/// How many elements of a variable there is room for.
fn room(value: &Value) -> usize {
    match value {
        Value::Array(values) => values.capacity(),
        Value::Int(_) | Value::Float(_) => 1,
    }
}

/// A value with room for the longest arrays.
fn with_room(mut value: Value) -> Value {
    if let Value::Array(values) = &mut value {
        values.reserve(ARRAY.saturating_sub(values.len()));
    }
    value
}

/// Copies a value, an array into the memory that it has there.
fn copy(from: &Value, to: &mut Value) {
    match (from, to) {
        (Value::Array(from), Value::Array(to)) => to.clone_from(from),
        (from, to) => *to = from.clone(),
    }
}

/// A single value as one that is copied without allocating memory.
fn setting(value: &Value) -> Setting {
    match value {
        Value::Int(value) => Setting::Int(*value),
        Value::Float(value) => Setting::Float(*value),
        // An array has no arrays as elements.
        Value::Array(_) => Setting::Int(0),
    }
}

/// The other end of the trace's queue: makes rows of the samples.
struct Samples {
    queue: rtrb::Consumer<Sample>,
    text: TraceText,
    values: Vec<Value>,
}

impl Samples {
    fn fill(&mut self, buffer: &mut Vec<u8>) {
        while buffer.len() < PORTION {
            let Ok(sample) = self.queue.pop() else { return };
            match sample {
                Sample::Value { tick, time_ns, index, element, elements, value, complete } => {
                    let Some(whole) = self.values.get_mut(index as usize) else { continue };
                    match (&mut *whole, elements) {
                        (Value::Array(values), Some(count)) => {
                            values.resize(count as usize, Value::Int(0));
                        }
                        (Value::Array(_), None) => *whole = Value::Int(0),
                        (_, Some(count)) => {
                            *whole = Value::Array(vec![Value::Int(0); count as usize]);
                        }
                        (_, None) => {}
                    }
                    let part = match whole {
                        Value::Array(values) => values.get_mut(element as usize),
                        Value::Int(_) | Value::Float(_) => Some(&mut *whole),
                    };
                    if let Some(part) = part {
                        *part = match value {
                            Setting::Int(value) => Value::Int(value),
                            Setting::Float(value) => Value::Float(value),
                        };
                    }
                    if complete {
                        let value = whole.clone();
                        // Writing to memory does not fail.
                        let _ = self.text.row((tick, time_ns), index as usize, value, buffer);
                    }
                }
                Sample::End { time_ns } => {
                    let _ = self.text.end(time_ns, buffer);
                }
            }
        }
    }
}
