//! A record as an MCAP file (<https://mcap.dev/spec>), which Foxglove Studio, Lichtblick and PlotJuggler open. The crate
//! `mcap` writes the file; this module says what stands in it.
//!
//! Each class of variables, such as the inputs, is a channel with the topic `/inputs`. A message is a JSON object with the
//! values of all its variables after a tick, and the number of the tick:
//!
//! ```json
//! {"tick":150,"CHUCK":1,"_CP100":0}
//! ```
//!
//! There is a message where a value has changed, and one for the tick before it, so that a plot shows a step and not a ramp.
//! A field's name has letters, digits and `_` alone, since these programs take no other characters in the path of a
//! field (`/inputs.CHUCK`); the channel's schema has the variable's own name as the field's title. The channel `/events` has
//! faults, messages and texts in the form of `foxglove.Log`.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions, Writer};
use plcc_files::open_output;
use plcc_frontend::language;
use plcc_host::run::{TraceText, WaveformShape};
use plcc_record::RecordedRun;
use plcc_runtime::{Event, EventBody, Executive, Properties, Value, VariableKey};
use serde_json::{Map, Value as Json, json};

use super::{RanProgram, Watches};

/// The levels of `foxglove.Log`.
const INFO: u8 = 2;
const WARNING: u8 = 3;
const ERROR: u8 = 4;
const FATAL: u8 = 5;

/// The file, written from its beginning to its end, so that it may be a device or a pipe.
type Out = Writer<NoSeek<BufWriter<File>>>;

/// An MCAP file that is being written.
pub(super) struct Mcap {
    out: Out,
    groups: Vec<Group>,
    /// The channel of the events, and how many it has.
    events: (u16, u32),
    /// When the run began, in nanoseconds since 1970; 0 for one in simulated time.
    began_ns: u64,
    /// The tick that was taken in last, and its time.
    last: Option<(u64, u64)>,
}

/// A class of variables before its channel is made.
struct Class<'a> {
    title: &'a str,
    /// As in [`Group`].
    fields: Vec<(usize, String)>,
    /// What the schema says of each field.
    properties: Map<String, Json>,
}

/// The variables of a class.
struct Group {
    channel: u16,
    messages: u32,
    /// The index of each variable in the text, and the name of its field.
    fields: Vec<(usize, String)>,
    values: Map<String, Json>,
    /// The tick of the last message.
    written: Option<u64>,
}

impl Mcap {
    /// Creates the file with the variables of the text. `programs` are those of `watches`.
    pub(super) fn create(
        path: &Path,
        text: &TraceText,
        watches: &Watches,
        programs: &[RanProgram],
        run: &RecordedRun,
    ) -> io::Result<Self> {
        let library = concat!("plcc ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new()
            .library(library)
            .compression(Some(Compression::Lz4))
            .disable_seeking(true);
        let file = NoSeek::new(BufWriter::new(open_output(path, false)?));
        let out = options.create(file).map_err(as_io)?;
        let began_ns =
            if run.header.clocked { run.header.began_ms.saturating_mul(1_000_000) } else { 0 };
        let mut mcap = Self { out, groups: vec![], events: (0, 0), began_ns, last: None };
        let mut classes: Vec<Class<'_>> = vec![];
        let mut used = BTreeSet::from(["tick".to_owned()]);
        let known = watches.iter().zip(programs).map(|((watch, of_program), program)| {
            let names = watch.names().iter().map(|(name, variable)| (name.as_str(), *variable));
            let names: HashMap<&str, VariableKey> = names.collect();
            let program = &program.found.program;
            (names, of_program, language(program.dialect()).titles(&program.tables))
        });
        let known: Vec<_> = known.collect();
        for (index, (name, shown)) in text.shown_names().enumerate() {
            // The first program that has it says what it is.
            let found = known.iter().find_map(|(names, of_program, titles)| {
                Some((titles(name), of_program.properties(*names.get(name)?)))
            });
            let Some((class, properties)) = found else { continue };
            let at = classes.iter().position(|one| one.title == class);
            let at = at.unwrap_or_else(|| {
                let tick = json!({"type": "integer", "title": "number of the tick"});
                let properties = Map::from_iter([("tick".to_owned(), tick)]);
                classes.push(Class { title: class, fields: vec![], properties });
                classes.len() - 1
            });
            let field = field_name(shown, &mut used);
            if let Some(class) = classes.get_mut(at) {
                class.properties.insert(field.clone(), schema_of(shown, &properties));
                class.fields.push((index, field));
            }
        }
        for Class { title, fields, properties } in classes {
            let schema = json!({"title": title, "type": "object", "properties": properties});
            let channel =
                mcap.channel(&topic(title), &format!("plcc.{}", plain(title)), &schema)?;
            let (values, written) = (Map::new(), None);
            mcap.groups.push(Group { channel, messages: 0, fields, values, written });
        }
        mcap.events.0 = mcap.channel("/events", "foxglove.Log", &log_schema())?;
        Ok(mcap)
    }

    fn channel(&mut self, topic: &str, name: &str, schema: &Json) -> io::Result<u16> {
        let schema = schema.to_string();
        let schema = self.out.add_schema(name, "jsonschema", schema.as_bytes()).map_err(as_io)?;
        self.out.add_channel(schema, topic, "json", &BTreeMap::new()).map_err(as_io)
    }

    /// Writes the values that have changed in a tick, and its events. `at` is the number of the tick and its time since
    /// the beginning of the run in nanoseconds.
    pub(super) fn tick(
        &mut self,
        at: (u64, u64),
        variables: &[Option<VariableKey>],
        executive: &dyn Executive,
        events: &[Event],
    ) -> io::Result<()> {
        for group in &mut self.groups {
            let mut values = Map::new();
            for (index, field) in &group.fields {
                // What the program that runs has not keeps no value.
                let Some(variable) = variables.get(*index).copied().flatten() else { continue };
                values.insert(field.clone(), json_of(&executive.read(variable)));
            }
            if group.written.is_some() && values == group.values {
                continue;
            }
            if let Some(before) =
                self.last.filter(|(tick, _)| group.written.is_some_and(|it| it < *tick))
            {
                group.write(before, self.began_ns, &mut self.out)?;
            }
            group.values = values;
            group.write(at, self.began_ns, &mut self.out)?;
        }
        for event in events {
            let time = self.began_ns.saturating_add(at.1);
            let (channel, number) = &mut self.events;
            write(&mut self.out, *channel, *number, time, &log(event, time))?;
            *number += 1;
        }
        self.last = Some(at);
        Ok(())
    }

    /// Writes the last values and the end of the file.
    pub(super) fn finish(mut self) -> io::Result<()> {
        if let Some(last) = self.last {
            for group in self.groups.iter_mut().filter(|group| group.written != Some(last.0)) {
                group.write(last, self.began_ns, &mut self.out)?;
            }
        }
        self.out.finish().map_err(as_io)?;
        self.out.into_inner().into_inner().flush()
    }
}

impl Group {
    /// Writes the values as they are after a tick.
    fn write(
        &mut self,
        (tick, time_ns): (u64, u64),
        began_ns: u64,
        out: &mut Out,
    ) -> io::Result<()> {
        let mut message = Map::from_iter([("tick".to_owned(), Json::from(tick))]);
        message.extend(self.values.clone());
        let time = began_ns.saturating_add(time_ns);
        write(out, self.channel, self.messages, time, &Json::Object(message))?;
        self.messages = self.messages.wrapping_add(1);
        self.written = Some(tick);
        Ok(())
    }
}

/// Writes a message of a channel. `sequence` is its number within the channel, `time` is in nanoseconds.
fn write(
    out: &mut Out,
    channel_id: u16,
    sequence: u32,
    time: u64,
    message: &Json,
) -> io::Result<()> {
    let header = MessageHeader { channel_id, sequence, log_time: time, publish_time: time };
    out.write_to_known_channel(&header, message.to_string().as_bytes()).map_err(as_io)
}

/// The error of the file where there is one, so that the message can say why it was not written.
fn as_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

/// A text in small letters, in which everything but letters and digits is `_`.
fn plain(text: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    text.chars().map(plain).collect()
}

fn topic(title: &str) -> String {
    format!("/{}", plain(title))
}

/// The name of a variable's field, which no other field has.
fn field_name(name: &str, used: &mut BTreeSet<String>) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut field: String = name.chars().map(plain).collect();
    while !used.insert(field.clone()) {
        field.push('_');
    }
    field
}

fn schema_of(name: &str, properties: &Properties) -> Json {
    let number = match properties.class {
        plcc_runtime::Class::Fraction => json!({"type": "number"}),
        plcc_runtime::Class::Logical | plcc_runtime::Class::Integer => {
            match WaveformShape::of(properties).range() {
                Some((least, most)) => {
                    json!({"type": "integer", "minimum": least, "maximum": most})
                }
                None => json!({"type": "integer"}),
            }
        }
    };
    let mut schema = match properties.elements {
        Some(_) => json!({"type": "array", "items": number}),
        None => number,
    };
    schema["title"] = name.into();
    schema
}

fn json_of(value: &Value) -> Json {
    match value {
        Value::Int(value) => (*value).into(),
        Value::Float(value) => (*value).into(),
        Value::Array(values) => values.iter().map(json_of).collect(),
    }
}

/// An event in the form of `foxglove.Log`.
fn log(event: &Event, time: u64) -> Json {
    let (mut place, mut line_number) = (String::new(), 0);
    let (level, name, message) = match &event.body {
        EventBody::Fault { name, state, text } => {
            let level = if *state == "on" { ERROR } else { INFO };
            (level, name.clone(), format!("{state}: {text}"))
        }
        EventBody::Message { name, flag, state, text, .. } => {
            let name = name.clone().or_else(|| flag.clone()).unwrap_or_default();
            (if *state == "on" { WARNING } else { INFO }, name, format!("{state}: {text}"))
        }
        EventBody::Send { text, .. } => (INFO, "SEND".into(), text.to_string()),
        EventBody::Display { text, .. } => (INFO, "DISPLAY".into(), text.to_string()),
        EventBody::Command { text, error } => match error {
            Some(error) => (WARNING, "COMMAND".into(), format!("{text}: {error}")),
            None => (INFO, "COMMAND".into(), text.to_string()),
        },
        EventBody::Macro { text } => (INFO, "MACRO".into(), text.to_string()),
        EventBody::Simulator(event) => (INFO, "simulator".into(), event.to_string()),
        EventBody::Motion(report) => {
            let level = if report.is_warning() { WARNING } else { INFO };
            (level, "motion".into(), report.to_string())
        }
        EventBody::Stop { code, file, line } => {
            place = file.as_ref().map(ToString::to_string).unwrap_or_default();
            line_number = line.map_or(0, u64::from);
            (FATAL, "stop".into(), code.to_string())
        }
    };
    json!({
        "timestamp": {"sec": time / 1_000_000_000, "nsec": time % 1_000_000_000},
        "level": level,
        "message": message,
        "name": name,
        "file": place,
        "line": line_number,
        "tick": event.tick,
    })
}

/// The schema of `foxglove.Log`, with the number of the tick besides.
fn log_schema() -> Json {
    let integer = json!({"type": "integer"});
    json!({
        "title": "foxglove.Log",
        "type": "object",
        "properties": {
            "timestamp": {
                "type": "object",
                "title": "time",
                "properties": {"sec": integer, "nsec": integer},
            },
            "level": {
                "title": "foxglove.LogLevel",
                "oneOf": [
                    {"title": "UNKNOWN", "const": 0},
                    {"title": "DEBUG", "const": 1},
                    {"title": "INFO", "const": INFO},
                    {"title": "WARNING", "const": WARNING},
                    {"title": "ERROR", "const": ERROR},
                    {"title": "FATAL", "const": FATAL},
                ],
            },
            "message": {"type": "string"},
            "name": {"type": "string"},
            "file": {"type": "string"},
            "line": integer,
            "tick": integer,
        },
    })
}
