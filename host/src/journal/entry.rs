//! What a journal's entries say.

use std::borrow::Cow;
use std::fmt;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use plcc_image::input_area::WriterName;
use plcc_protocol::{TaskSummary, TimesSummary, TimingSummary};
use plcc_runtime::{AnnouncedText, EventBody};
use serde::{Serialize, Serializer};

use crate::Peer;

/// Something that happened around a program.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// When it happened, by the computer's clock; written as `2026-11-22T10:49:37.123456Z`.
    #[serde(serialize_with = "rfc3339")]
    pub time: SystemTime,
    /// The tick in which it happened, or before which, where it belongs to one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tick: Option<u64>,
    /// What happened.
    #[serde(flatten)]
    pub kind: EntryKind,
}

/// What happened. The variants' names, in lower case and with `_` between words, are the key
/// `kind` of a line in the log; the fields are further keys. The name of a time's key ends with its unit:
/// `_ms`, or `_us` in `timing`.
///
/// The thread that runs the ticks may make only entries that hold no allocated memory.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum EntryKind {
    /// A message that has no kind of its own.
    Note {
        /// A sentence.
        text: Cow<'static, str>,
    },
    /// A message about something that the user will want to change.
    Warning {
        /// A sentence.
        text: Cow<'static, str>,
    },
    /// A message about something that went wrong.
    Error {
        /// A sentence.
        text: Cow<'static, str>,
    },
    /// The control stopped the program.
    Stopped {
        /// In which tick, for the sentence; a line of the log has its key `tick`.
        #[serde(skip)]
        at: u64,
        /// The stop's code, as in the events.
        code: String,
        /// What happened, as in the dump.
        message: String,
    },
    /// The program tells people something: a fault or a message comes or goes. It is for standard error alone,
    /// since the log is of what happens around the program.
    #[serde(skip)]
    Announced {
        /// `fault` or `message`.
        what: &'static str,
        /// The variable.
        name: Arc<str>,
        /// Whether it comes.
        is_on: bool,
        /// Its text.
        text: AnnouncedText,
    },
    /// The control's process has died or was killed because it hung; its supervisor says so.
    ControlDied {
        /// How.
        how: String,
        /// Whether the control is started again.
        restart: bool,
    },
    /// A tick began only when a later one was already due.
    Overrun {
        /// How late it began.
        #[serde(rename = "late_ms", serialize_with = "milliseconds")]
        late: Duration,
        /// How many ticks were skipped for it.
        skipped: u64,
    },
    /// Somebody set a variable.
    Write {
        /// Its name.
        name: String,
        /// The value as it was given.
        value: String,
        /// Who.
        #[serde(flatten)]
        by: Peer,
    },
    /// Somebody forced an input or an output, or ended its force.
    Force {
        /// Its name.
        name: String,
        /// The value as it was given; `None` where the force has ended.
        value: Option<String>,
        /// Who.
        #[serde(flatten)]
        by: Peer,
    },
    /// Somebody stopped the program or had it go on.
    Control {
        /// `stop` or `start`.
        request: &'static str,
        /// Who.
        #[serde(flatten)]
        by: Peer,
    },
    /// Something has happened to inputs that another process gives by the image file.
    Inputs {
        /// `begun`, `late`, `released`, `recovered` or `refused`.
        change: &'static str,
        /// The name of the process.
        #[serde(serialize_with = "as_text")]
        writer: WriterName,
        /// The first of the inputs.
        first: Arc<str>,
        /// How many inputs.
        count: u32,
    },
    /// Another program has taken the place of the one that ran.
    Swap {
        /// The artifact that runs now.
        artifact: String,
        /// Whether it ran before and was taken back.
        rollback: bool,
        /// How long the ticks were held up.
        #[serde(rename = "took_ms", serialize_with = "milliseconds")]
        took: Duration,
        /// Who.
        #[serde(flatten)]
        by: Peer,
    },
    /// Somebody connected to the socket and was sent away, or asked for what is not allowed.
    Refused {
        /// What.
        what: String,
        /// Who.
        #[serde(flatten)]
        by: Peer,
    },
    /// A tick needed more than four fifths of its time. So that the log stays short, one entry may stand
    /// for several such ticks.
    Budget {
        /// How long the longest of them took.
        #[serde(rename = "taken_ms", serialize_with = "milliseconds")]
        taken: Duration,
        /// The time from one tick to the next.
        #[serde(rename = "period_ms", serialize_with = "milliseconds")]
        period: Duration,
        /// How many such ticks there were since the last entry of this kind.
        count: u64,
    },
    /// How long ticks took and how late they began, at the end of a run in real time.
    Timing {
        /// What was recorded.
        #[serde(flatten)]
        summary: Box<TimingSummary>,
    },
    /// An output could not take lines or rows as fast as they came, or not at all, so that some are
    /// missing.
    Lost {
        /// The output: `trace`, `events`, `log`, `standard error`.
        output: &'static str,
        /// How many are missing since the last entry of this kind about this output.
        count: u64,
    },
    /// An output can't be written at present. The attempt is repeated.
    OutputFailed {
        /// The output.
        output: &'static str,
        /// Why.
        error: String,
    },
    /// An output that could not be written can be written again.
    OutputRecovered {
        /// The output.
        output: &'static str,
    },
    /// Nobody reads an output any more. Nothing more is written to it.
    OutputClosed {
        /// The output.
        output: &'static str,
    },
    /// The retained file can't be written at present. The newest state is kept, and the attempt is
    /// repeated.
    RetainedFileFailed {
        /// Its path.
        file: String,
        /// Why.
        error: String,
    },
    /// The retained file, which could not be written, was written with the newest state.
    RetainedFileRecovered {
        /// Its path.
        file: String,
        /// How many attempts have failed.
        attempts: u64,
        /// For how long it could not be written.
        #[serde(rename = "failed_ms", serialize_with = "milliseconds")]
        failed: Duration,
    },
    /// At the start of the run something was wrong with one of the two copies of the retained data.
    RetainedFileDamaged {
        /// A sentence.
        text: String,
    },
    /// The retained data came from another program; what fits was taken.
    RetainedDataCarriedOver {
        /// A sentence with the names of what was not taken and of what is new.
        text: String,
    },
    /// An output did not take what it was given within the time that the end of a run waits for it.
    OutputStuck {
        /// The output.
        output: &'static str,
    },
}

/// How important an entry is for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// The user will want to change something.
    Warning,
    /// Something went wrong.
    Error,
    /// The program was stopped.
    Stopped,
    /// What the program itself tells people, with the word for it.
    Announced(&'static str),
}

impl Severity {
    /// The word that begins a message on standard error.
    pub fn word(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
            Self::Stopped => "stopped",
            Self::Announced(word) => word,
        }
    }
}

impl EntryKind {
    /// Whether the sentence for people names the tick.
    pub(super) fn names_tick(&self) -> bool {
        matches!(self, Self::Overrun { .. } | Self::Budget { .. } | Self::Announced { .. })
    }

    /// What the program tells people by an event, if it does: faults and messages. It shares its texts with the
    /// event.
    pub(crate) fn announced(event: &EventBody) -> Option<Self> {
        let (what, name, state, text) = match event {
            EventBody::Fault { name, state, text } => ("fault", name, *state, text.clone()),
            EventBody::Message { name, flag, state, text, .. } => {
                ("message", name.as_ref().or(flag.as_ref())?, *state, text.clone())
            }
            _ => return None,
        };
        let name = Arc::clone(name);
        Some(Self::Announced { what, name, is_on: state == "on", text })
    }

    /// Whether it is a line of the log.
    pub(super) fn is_logged(&self) -> bool {
        !matches!(self, Self::Announced { .. })
    }

    /// How important it is.
    pub fn severity(&self) -> Severity {
        match self {
            Self::Inputs { change: "begun" | "recovered", .. }
            | Self::Note { .. }
            | Self::Write { .. }
            | Self::Force { .. }
            | Self::Control { .. }
            | Self::Swap { .. }
            | Self::OutputRecovered { .. }
            | Self::Timing { .. }
            | Self::RetainedFileRecovered { .. } => Severity::Note,
            Self::Warning { .. }
            | Self::Inputs { .. }
            | Self::Overrun { .. }
            | Self::Refused { .. }
            | Self::Budget { .. }
            | Self::Lost { .. }
            | Self::OutputFailed { .. }
            | Self::OutputClosed { .. }
            | Self::OutputStuck { .. }
            | Self::RetainedFileFailed { .. }
            | Self::RetainedFileDamaged { .. }
            | Self::RetainedDataCarriedOver { .. } => Severity::Warning,
            Self::Error { .. } | Self::ControlDied { .. } => Severity::Error,
            Self::Stopped { .. } => Severity::Stopped,
            Self::Announced { what, .. } => Severity::Announced(what),
        }
    }
}

impl fmt::Display for EntryKind {
    /// The sentence for people, without a full stop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Note { text } | Self::Warning { text } | Self::Error { text } => {
                f.write_str(text)
            }
            Self::Stopped { at, code, message } => write!(f, "{code} in tick {at}: {message}"),
            Self::Announced { name, is_on: true, text, .. } => write!(f, "{text} ({name})"),
            Self::Announced { name, is_on: false, text, .. } => {
                write!(f, "no longer: {text} ({name})")
            }
            Self::Overrun { late, skipped } => {
                let late = late.as_secs_f64() * 1000.0;
                write!(f, "an overrun: the tick began {late:.1} ms late")?;
                match skipped {
                    0 => Ok(()),
                    1 => f.write_str(", and 1 tick was skipped"),
                    _ => write!(f, ", and {skipped} ticks were skipped"),
                }
            }
            Self::Write { name, value, by } => write!(f, "{name} was set to {value} by {by}"),
            Self::Force { name, value: Some(value), by } => {
                write!(f, "{name} was forced to {value} by {by}")
            }
            Self::Force { name, value: None, by } => {
                write!(f, "the force on {name} was ended by {by}")
            }
            Self::Control { request: "stop", by } => write!(f, "the program was stopped by {by}"),
            Self::Control { by, .. } => write!(f, "the program was started again by {by}"),
            Self::Inputs { change, writer, first, count } => {
                let and = match count {
                    0 | 1 => String::new(),
                    2 => " and another input".into(),
                    _ => format!(" and {} other inputs", count - 1),
                };
                let (have, them) = match count {
                    0 | 1 => ("has its safe value", "it"),
                    _ => ("have their safe values", "them"),
                };
                match *change {
                    "begun" => write!(f, "{writer} gives {first}{and} from here on"),
                    "late" => {
                        write!(f, "{first}{and} came too late from {writer}, and {have}")
                    }
                    "released" => {
                        write!(f, "{first}{and} {have}: the process that gave {them} has gone")
                    }
                    "recovered" => write!(f, "{first}{and} came from {writer} again"),
                    _ => write!(
                        f,
                        "what {writer} gives {first}{and} can't be taken; the last good value \
                         counts until it is too old"
                    ),
                }
            }
            Self::Swap { artifact, rollback, took, by } => {
                let how = if *rollback { " again" } else { "" };
                let took = took.as_secs_f64() * 1000.0;
                write!(
                    f,
                    "{artifact} runs{how} from here on; the change took {took:.3} ms; by {by}"
                )
            }
            Self::Refused { what, by } => write!(f, "{what} was refused to {by}"),
            Self::ControlDied { how, restart } => {
                let what = if *restart { "is restarted" } else { "is not restarted" };
                write!(f, "the control's process has died: {how}; it {what}")
            }
            Self::Budget { taken, period, count } => {
                let (taken, period) = (taken.as_secs_f64() * 1000.0, period.as_secs_f64() * 1000.0);
                write!(
                    f,
                    "a tick took {taken:.2} ms, more than 80 % of the {period:.2} ms that it has"
                )?;
                match count {
                    0 | 1 => Ok(()),
                    _ => write!(f, ", the longest of {count} such ticks"),
                }
            }
            Self::Timing { summary } => {
                let TimingSummary { start_us, lateness, ticks, tasks, .. } = &**summary;
                if *start_us > 0.0 {
                    let start = start_us / 1000.0;
                    write!(f, "the first tick began {start:.1} ms after the start; ")?;
                }
                write!(
                    f,
                    "{} ticks took {:.1} us on average, {:.1} us at most, and began {:.1} us late on \
                     average, {:.1} us at most",
                    ticks.count, ticks.mean_us, ticks.max_us, lateness.mean_us, lateness.max_us
                )?;
                for TaskSummary { name, times } in tasks {
                    let TimesSummary { mean_us, p999_us, max_us, .. } = times;
                    write!(
                        f,
                        "; {name}: {mean_us:.1} us, 99.9 % within {p999_us:.1} us, at most {max_us:.1} us"
                    )?;
                }
                Ok(())
            }
            Self::Lost { output, count } => {
                let what = match *output {
                    "trace" => "rows of the trace",
                    "events" => "events",
                    "log" => "entries of the log",
                    _ => "messages on standard error",
                };
                write!(f, "{count} {what} are lost: they could not be written in time")
            }
            Self::OutputFailed { output, error } => {
                write!(f, "{} can't be written, the attempt is repeated: {error}", the(output))
            }
            Self::OutputRecovered { output } => write!(f, "{} can be written again", the(output)),
            Self::OutputClosed { output } => {
                write!(f, "nobody reads {} any more; no more of it is written", the(output))
            }
            Self::RetainedFileFailed { error, .. } => {
                write!(f, "{error}; the newest state is kept, and the attempt is repeated")
            }
            Self::RetainedFileRecovered { file, attempts, failed } => {
                let times = if *attempts == 1 { "attempt" } else { "attempts" };
                let seconds = failed.as_secs_f64();
                write!(
                    f,
                    "the retained file {file} is written again, after {attempts} {times} in "
                )?;
                write!(f, "{seconds:.1} s had failed")
            }
            Self::RetainedFileDamaged { text } | Self::RetainedDataCarriedOver { text } => {
                f.write_str(text)
            }
            Self::OutputStuck { output } => {
                write!(f, "the end of {} is missing, since nobody took it in time", the(output))
            }
        }
    }
}

/// An output with its article.
fn the(output: &str) -> String {
    if output.starts_with("standard") { output.to_owned() } else { format!("the {output}") }
}

fn rfc3339<S: Serializer>(time: &SystemTime, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&humantime::format_rfc3339_micros(*time))
}

fn as_text<S: Serializer>(value: &impl fmt::Display, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

/// A time in milliseconds, exact to a microsecond.
fn milliseconds<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(time.as_micros() as f64 / 1000.0)
}
