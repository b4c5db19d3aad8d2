//! `plcc test --from RECORD`: writes a script that gives a record's inputs again and expects its outputs.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use plcc_files::FileIdentity;
use plcc_host::session::replay::recorded_simulation;
use plcc_host::simulation::Simulation;
use plcc_record::{Action, RecordedProgram, RecordedSources, Recording};
use plcc_runtime::{Event, EventBody, Executive, Names, VariableKey};

use crate::args::TestArgs;
use crate::failure::{DONE, Failure};
use crate::input::machine_beside;
use crate::output;
use crate::recorded::Found;
use crate::replay_input::{check_outputs, chosen_run, replayer, tell_damage};
use crate::report::Report;

/// The longest statement, in bytes; a script's lines may be 4000 bytes long.
const MAX_STATEMENT: usize = 3800;
/// How many conditions an `expect` has.
const CONDITIONS: usize = 8;

/// Writes the script of a record.
///
/// # Errors
/// When the record can't be read or replayed from its first tick, or the script can't be written.
pub(super) fn from_record(record: &Path, args: &TestArgs, report: &Report) -> Result<u8, Failure> {
    let out = args.output.as_deref().unwrap_or(Path::new("-"));
    check_outputs(record, &[], [out])?;
    let recording = Recording::open(record).map_err(|error| Failure::usage(error.to_string()))?;
    let run = chosen_run(&recording, None, record, report)?;
    tell_damage(&recording, run, report);
    let generations = run.generations();
    let first = generations.first().copied().unwrap_or(0);
    let recorded =
        run.program_of(first).ok_or_else(|| Failure::file(record, "its program is missing"))?;
    let sources = sources(recorded).ok_or_else(|| {
        Failure::file(record, "it holds no sources, so that no script can name the program")
    })?;
    let found = Found::in_record(recorded).map_err(|why| Failure::file(record, why))?;
    let engine = found.engine(found.usual_engine());
    let mut engine = engine.map_err(|why| Failure::file(record, why))?;
    let mut replayer = replayer(record, &recording, run, first, &found)?;
    let failed = |error: &dyn std::fmt::Display| Failure::file(record, error);
    let (begin, _) = replayer.range().map_err(|error| failed(&error))?;
    if begin != 0 {
        let what = format!(
            "its first ticks are no longer kept: it begins with tick {begin}, and a test begins at power-up"
        );
        return Err(Failure::file(record, what));
    }
    replayer.go_to(0, engine.as_mut()).map_err(|error| failed(&error))?;
    let names = replayer.executive().names();
    let fresh = crate::replay_input::fresh(record, run, &found)?;
    let mut writer = Writer::new(&*names, replayer.executive(), fresh.as_ref());
    let (mut skipped, mut cut) = (0, false);
    let mut events: Vec<Event> = vec![];
    loop {
        let actions = replayer.next().map(|next| next.actions.clone()).unwrap_or_default();
        skipped += actions.iter().filter(|action| matches!(action, Action::Skip(_))).count();
        events.clear();
        let step = replayer.step(engine.as_mut(), &mut events).map_err(|error| failed(&error))?;
        let Some(replayed) = step else { break };
        if replayed.cut {
            cut = true;
            break;
        }
        writer.tick(&actions, replayer.executive(), &events, replayed.stop.map(|stop| stop.code));
    }
    let body = writer.finish();
    let name = record.file_stem().unwrap_or_default().to_string_lossy().replace('"', "'");
    let mut text = format!("# Made of the record {}.\n", record.display());
    let files: Vec<&str> =
        sources.files.iter().take(sources.named).map(|file| file.path.as_str()).collect();
    let simulation = recorded_simulation(&run.header);
    let machine = simulation.as_ref().and_then(Simulation::machine_file);
    for file in files.iter().map(Path::new).chain(machine).filter(|file| !file.is_file()) {
        report.warn(&format!("{} does not exist here, and the script names it", file.display()));
    }
    if let Some(part_program) = simulation.as_ref().and_then(Simulation::own_part_program) {
        report.warn(&format!(
            "the run had the part program {} by --part-program; a script takes that of the machine file, so write \
             `part_program` into its table [simulator]",
            part_program.display()
        ));
    }
    text.push_str(&head(out, &files, machine, simulation.is_some()));
    let _ = write!(text, "\ntest \"as in {name}\"\n{body}end\n");
    if skipped > 0 {
        report.warn(&format!(
            "the clock left ticks out {skipped} times; a test runs in simulated time, where none is left out"
        ));
    }
    if cut {
        report.warn("the watchdog stopped a scan; the script ends before that tick");
    }
    if generations.len() > 1 {
        report.warn("the program was changed while it ran; the script ends before that");
    }
    output::write(out, text.as_bytes(), &plcc_diag::SourceMap::new(), &[record.to_owned()])?;
    Ok(DONE)
}

/// The lines of a script above its tests: the files of the program, the machine file unless it is found beside the program, and
/// whether the other side answers.
pub(super) fn head(out: &Path, files: &[&str], machine: Option<&Path>, simulate: bool) -> String {
    let named = |path: &Path| from_folder_of(out, path).display().to_string();
    let mut text = String::new();
    for file in files {
        let _ = writeln!(text, "program \"{}\"", named(Path::new(file)));
    }
    let beside = files.first().and_then(|file| machine_beside(Path::new(file)));
    let beside = beside.map(|path| FileIdentity::of(&path));
    let is_beside = |path: &&Path| {
        beside.as_ref().is_some_and(|beside| beside.is_same(&FileIdentity::of(path)))
    };
    if let Some(machine) = machine.filter(|path| !is_beside(path)) {
        let _ = writeln!(text, "machine \"{}\"", named(machine));
    }
    if simulate {
        text.push_str("simulate\n");
    }
    text
}

/// The sources of a recorded program.
fn sources(recorded: &RecordedProgram) -> Option<RecordedSources> {
    match recorded {
        RecordedProgram::Sources(sources) => Some(sources.clone()),
        RecordedProgram::Artifact(bytes) => {
            let artifact = plcc_load::Artifact::parse(bytes, None).ok()?;
            RecordedSources::from_bytes(&artifact.sources)
        }
        RecordedProgram::Unknown => None,
    }
}

/// A path as it is named from the folder of a script.
pub(super) fn from_folder_of(script: &Path, path: &Path) -> PathBuf {
    let folder = match output::is_stdout(script) {
        true => Path::new(""),
        false => script.parent().unwrap_or(Path::new("")),
    };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (Ok(folder), Ok(full)) = (folder.canonicalize(), path.canonicalize()) else {
        return path.to_owned();
    };
    let common = folder.components().zip(full.components()).take_while(|(a, b)| a == b).count();
    if common <= 1 {
        return full;
    }
    let mut relative: PathBuf = folder.components().skip(common).map(|_| "..").collect();
    relative.extend(full.components().skip(common));
    let is_same = FileIdentity::of(&folder.join(&relative)).is_same(&FileIdentity::of(&full));
    if is_same { relative } else { full }
}

/// Writes the statements of a test tick by tick.
pub(super) struct Writer<'n> {
    names: &'n dyn Names,
    text: String,
    /// The outputs, with the values that they had last.
    outputs: Vec<(String, VariableKey, Option<String>)>,
    /// The outputs that were ever expected, with their values now.
    expected: BTreeMap<usize, String>,
    /// How many ticks have to be run that nothing has happened in.
    ticks: u64,
    forced: Vec<VariableKey>,
}

impl<'n> Writer<'n> {
    /// A test that begins in the state of `recorded`, which may have other retained values than `fresh`.
    pub(super) fn new(
        names: &'n dyn Names,
        recorded: &dyn Executive,
        fresh: &dyn Executive,
    ) -> Self {
        let outputs = names.outputs().into_iter().map(|(name, key)| (name, key, None)).collect();
        let (expected, forced) = (BTreeMap::new(), vec![]);
        let mut writer = Self { names, text: String::new(), outputs, expected, ticks: 0, forced };
        let mut rows = vec![];
        for (_, key) in names.declared() {
            for element in names.elements(key) {
                let (value, other) = (recorded.read(element), fresh.read(element));
                if value != other {
                    rows.push(format!("{} = {value}", names.canonical(element)));
                }
            }
        }
        writer.list("set", &rows);
        writer
    }

    /// A statement with a list, divided into several where it is long.
    fn list(&mut self, word: &str, items: &[String]) {
        for chunk in items.chunks(CONDITIONS) {
            // Writing to memory does not fail.
            let _ = writeln!(self.text, "  {word} {}", chunk.join(", "));
        }
    }

    /// A tick: what acted before it, and what came of it.
    pub(super) fn tick(
        &mut self,
        actions: &[Action],
        executive: &dyn Executive,
        events: &[Event],
        stop: Option<String>,
    ) {
        let mut rows: Vec<String> = vec![];
        for action in actions {
            match action {
                Action::Write(key, value) => {
                    rows.push(format!("set {} = {value}", self.names.canonical(*key)))
                }
                Action::Force(key, Some(value)) => {
                    self.forced.push(*key);
                    rows.push(format!("force {} = {value}", self.names.canonical(*key)));
                }
                Action::Force(key, None) => {
                    if self.forced.contains(key) {
                        self.forced.retain(|forced| forced != key);
                        rows.push(format!("release {}", self.names.canonical(*key)));
                    }
                }
                Action::Skip(_) | Action::SafeOutputs => {}
            }
        }
        if !rows.is_empty() {
            self.pass();
            for row in rows {
                let _ = writeln!(self.text, "  {row}");
            }
        }
        let mut changed = vec![];
        for (number, (name, key, last)) in self.outputs.iter_mut().enumerate() {
            let value = executive.read(*key).to_string();
            // Outputs that are off from the beginning are not named before they are on.
            if last.as_deref().unwrap_or("0") != value {
                changed.push(format!("{name} = {value}"));
                self.expected.insert(number, value.clone());
            }
            *last = Some(value);
        }
        let texts = texts(events);
        if changed.is_empty() && texts.is_empty() && stop.is_none() {
            self.ticks += 1;
            return;
        }
        // What was expected before did not hold in this tick.
        if changed.is_empty() {
            self.ticks += 1;
            self.pass();
        } else {
            self.pass_before(&changed);
            self.text.push_str("  run 1 tick\n");
            self.list("expect", &changed);
        }
        let messages: Vec<String> =
            texts.iter().map(|text| format!("message \"{text}\"")).collect();
        self.list("expect", &messages);
        if let Some(code) = stop {
            let _ = writeln!(self.text, "  expect stop \"{}\"", code.replace('"', ""));
        }
    }

    /// Runs the ticks before one in which outputs have changed, with the values that they had until then.
    fn pass_before(&mut self, changed: &[String]) {
        if self.ticks == 0 {
            return;
        }
        // The values before are those of the last statements, so they are kept apart from the new ones.
        let now = std::mem::take(&mut self.expected);
        let names: Vec<&str> = changed.iter().filter_map(|row| row.split(" = ").next()).collect();
        let before = now.iter().filter(|(number, _)| {
            let name = self.outputs.get(**number).map_or("", |(name, ..)| name.as_str());
            !names.contains(&name)
        });
        self.expected = before.map(|(number, value)| (*number, value.clone())).collect();
        self.pass();
        self.expected = now;
    }

    /// Runs the ticks that nothing has happened in.
    fn pass(&mut self) {
        let ticks = match std::mem::take(&mut self.ticks) {
            0 => return,
            1 => "1 tick".to_owned(),
            ticks => format!("{ticks} ticks"),
        };
        let held = self.expected.iter().filter_map(|(number, value)| {
            Some(format!("{} = {value}", self.outputs.get(*number)?.0))
        });
        let held = held.collect::<Vec<_>>().join(", ");
        let _ = match held.is_empty() || held.len() > MAX_STATEMENT {
            true => writeln!(self.text, "  run {ticks}"),
            false => writeln!(self.text, "  hold {held} for {ticks}"),
        };
    }

    pub(super) fn finish(mut self) -> String {
        self.pass();
        self.text
    }
}

/// The texts of a tick's events, as far as a script can name them.
fn texts(events: &[Event]) -> Vec<String> {
    let text = |event: &Event| {
        let text = match &event.body {
            EventBody::Fault { text, state: "on", .. } => text.to_string(),
            EventBody::Message { text, state: "on", .. } => text.to_string(),
            EventBody::Send { text, .. } | EventBody::Command { text, .. } => text.to_string(),
            EventBody::Display { text, .. } => text.to_string(),
            _ => return None,
        };
        let can_be_named =
            !text.is_empty() && !text.contains(['"', '\n', '\r']) && text.len() < 200;
        can_be_named.then_some(text)
    };
    let mut texts: Vec<String> = vec![];
    for text in events.iter().filter_map(text) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    texts
}
