//! A control with its program, by safe functions.

use std::collections::VecDeque;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use clap::Parser;
use plcc_abi::place::{Number, Place};
use plcc_control::{ControlArgs, Watch, dump};
use plcc_load::Artifact;
use plcc_runtime::{
    Event, EventBody, Executive, Names, NativeEngine, Purpose, Stop, Value, VariableKey,
};

/// How many events are kept at most until they are taken. When a further one comes, the oldest is lost.
const MAX_EVENTS: usize = 1 << 16;

/// A variable that can be set, found by [`Control::find_settable`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settable(pub(crate) VariableKey);

/// The options that a control can be made with: those of `plcrt` under "Control".
#[derive(Parser)]
#[command(name = "options", no_binary_name = true, disable_help_flag = true)]
struct Options {
    #[command(flatten)]
    control: ControlArgs,
}

/// A control with its program, at some tick.
pub struct Control {
    artifact: Artifact,
    engine: NativeEngine,
    executive: Box<dyn Executive>,
    names: Arc<dyn Names>,
    ticks: u64,
    stop: Option<Stop>,
    /// The events of the last tick; kept so that a tick allocates no memory for the list.
    events_of_tick: Vec<Event>,
    /// The events that were not taken yet, the oldest first.
    events: VecDeque<Event>,
    lost_events: u64,
    /// Whether events are kept.
    keeps_events: bool,
}

impl Control {
    /// A control at power-up with the program of an artifact. `options` are words as `plcrt` takes
    /// them, separated by blanks: `--period 10`. They may be empty.
    ///
    /// # Errors
    /// When the file can't be read or is not an artifact for this machine, or an option is wrong.
    pub fn open(path: &Path, options: &str) -> Result<Self, String> {
        let artifact = Artifact::open(path, None);
        Self::from_artifact(
            artifact.map_err(|error| format!("{}: {error}", path.display()))?,
            options,
        )
    }

    /// The same, with the bytes of an artifact.
    ///
    /// # Errors
    /// When they are not an artifact for this machine, or an option is wrong.
    pub fn load(bytes: &[u8], options: &str) -> Result<Self, String> {
        let artifact = Artifact::parse(bytes, None).map_err(|error| error.to_string())?;
        Self::from_artifact(artifact, options)
    }

    fn from_artifact(artifact: Artifact, options: &str) -> Result<Self, String> {
        let options = Options::try_parse_from(options.split_whitespace());
        let options = options.map_err(|error| error.render().to_string().trim_end().to_owned())?;
        let engine = NativeEngine::new(&artifact.code, &artifact.program);
        let engine = engine.map_err(|error| error.to_string())?;
        let executive = plcc_control::executive(&artifact.program, &options.control, false, None);
        let executive = executive.map_err(|error| error.to_string())?;
        Ok(Self {
            artifact,
            engine,
            names: executive.names(),
            executive,
            ticks: 0,
            stop: None,
            events_of_tick: vec![],
            events: VecDeque::new(),
            lost_events: 0,
            keeps_events: true,
        })
    }

    /// Runs one base tick: a PMI scan, an NCT slice, a PMAC servo cycle. Gives whether the program
    /// goes on; once it is stopped, further calls do nothing and give `false`.
    pub fn tick(&mut self) -> bool {
        if self.stop.is_some() {
            return false;
        }
        self.events_of_tick.clear();
        let tick = self.ticks;
        self.ticks += 1;
        if let Err(stop) = self.executive.tick(&mut self.engine, &mut self.events_of_tick) {
            let (file, line) = stop.place.clone().map(|place| (place.file, place.line)).unzip();
            let body = EventBody::Stop { code: stop.code.clone(), file, line };
            self.events_of_tick.push(Event { tick, body });
            self.stop = Some(stop);
        }
        if !self.keeps_events {
            return self.stop.is_none();
        }
        for event in self.events_of_tick.drain(..) {
            if self.events.len() >= MAX_EVENTS {
                self.events.pop_front();
                self.lost_events += 1;
            }
            self.events.push_back(event);
        }
        self.stop.is_none()
    }

    /// How many ticks have been begun.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// The length of a tick in nanoseconds of the control's time.
    pub fn tick_ns(&self) -> u64 {
        self.executive.tick_ns()
    }

    /// The language of the program: `pmi`, `nct` or `pmac`.
    pub fn dialect(&self) -> &'static str {
        self.artifact.program.dialect().name()
    }

    /// Why the control stopped the program, if it did.
    pub fn stop(&self) -> Option<&Stop> {
        self.stop.as_ref()
    }

    /// The oldest event that was not taken yet, as the JSON object that `--events` writes.
    pub fn next_event(&mut self) -> Option<String> {
        let event = self.events.pop_front()?;
        // An event has only strings and numbers, which JSON can hold.
        serde_json::to_string(&event).ok()
    }

    /// Says whether events are kept from now on; they are at first. Without them a tick neither allocates
    /// memory nor calls the operating system, but the tick in which the program is stopped.
    pub fn keep_events(&mut self, keep: bool) {
        self.keeps_events = keep;
        // The events of a tick go through this list also when nobody is given them.
        self.events_of_tick.reserve(256);
    }

    /// How many events were lost because more than 65 536 waited to be taken.
    pub fn lost_events(&self) -> u64 {
        self.lost_events
    }

    /// Looks a variable up to read it, by its name in the language's spelling. A whole array is allowed.
    ///
    /// # Errors
    /// When the program has no such variable.
    pub fn find(&self, name: &str) -> Result<VariableKey, String> {
        self.names.find(name, Purpose::Watch).map_err(|error| error.to_string())
    }

    /// Looks a variable up to set it, by its name in the language's spelling.
    ///
    /// # Errors
    /// When the program has no such variable, or it can't be set.
    pub fn find_settable(&self, name: &str) -> Result<Settable, String> {
        let found = self.names.find(name, Purpose::Stimulus);
        found.map(Settable).map_err(|error| error.to_string())
    }

    /// The place of the physical lines of an input or output; `None` for everything that has none.
    pub(crate) fn lines(&self, variable: VariableKey) -> Option<Place> {
        self.names.properties(variable).line
    }

    /// What is on physical lines. Allocates nothing.
    ///
    /// # Errors
    /// When they lie outside the process image.
    pub(crate) fn read_lines(&self, place: Place) -> Result<f64, String> {
        let value = place.read(self.executive.image()).map(Number::float);
        value.ok_or_else(|| "the lines lie outside the process image".into())
    }

    /// Gives the physical outputs their safe values.
    pub fn make_safe(&mut self) {
        self.executive.drive_safe_outputs();
    }

    /// The keys of a variable: one for each element.
    pub(crate) fn keys(&self, variable: VariableKey) -> Vec<VariableKey> {
        self.names.elements(variable)
    }

    /// Sets a variable to a number, as [`set_variable`](Self::set_variable) does. Allocates nothing, but to
    /// say why the variable can't take the value.
    ///
    /// # Errors
    /// When the variable can't take the value.
    pub(crate) fn set_number(&mut self, variable: Settable, value: f64) -> Result<(), String> {
        // The longest text of a double is one of 1075 digits, a sign, a zero and a point.
        let mut text = [0; 1100];
        let mut rest = text.as_mut_slice();
        let _ = write!(rest, "{value}");
        let unused = rest.len();
        let written = text.get(..text.len() - unused).unwrap_or_default();
        let text = std::str::from_utf8(written).map_err(|error| error.to_string())?;
        self.set_variable(variable, text)
    }

    /// The value of a variable. Allocates nothing but the elements of an array.
    pub fn get(&self, variable: VariableKey) -> Value {
        self.executive.read(variable)
    }

    /// Sets a variable as the machine or the operator would: as a row of a stimulus does.
    ///
    /// # Errors
    /// When the text is not a value that the variable can take.
    pub fn set_variable(&mut self, variable: Settable, value: &str) -> Result<(), String> {
        let setting = self.names.parse(variable.0, value).map_err(|error| error.to_string())?;
        self.executive.write(variable.0, setting);
        Ok(())
    }

    /// Sets a variable by its name; see [`set_variable`](Self::set_variable).
    ///
    /// # Errors
    /// When the program has no such variable, or it can't take the value.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        let variable = self.find_settable(name)?;
        self.set_variable(variable, value)
    }

    /// The state as `--dump` writes it: one line of JSON.
    ///
    /// # Errors
    /// The state is written to memory, which does not fail.
    pub fn dump(&mut self) -> Result<String, String> {
        let dialect = self.artifact.program.dialect();
        let (executive, watch) = (self.executive.as_ref(), Watch::default());
        let mut text = vec![];
        dump(&mut text, dialect, executive, &watch, self.ticks, self.stop.as_ref())
            .map_err(|error| error.to_string())?;
        String::from_utf8(text).map_err(|error| error.to_string())
    }

    /// The data that survives power-off; `None` where the program keeps none.
    pub fn retained(&self) -> Option<Vec<u8>> {
        self.executive.retained()
    }

    /// Takes back what [`retained`](Self::retained) gave, before the first tick. Of the data of another program
    /// of the same language, it takes the variables that have the same name and type.
    ///
    /// # Errors
    /// When the bytes are not retained data of this language, or a tick has been run.
    pub fn restore(&mut self, retained: &[u8]) -> Result<(), String> {
        if self.ticks > 0 {
            return Err("retained data is taken back only before the first tick".into());
        }
        self.executive.restore(retained).map(|_| ())
    }
}
