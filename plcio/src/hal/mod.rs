//! LinuxCNC's hardware abstraction layer (HAL): a component in user space, whose pins are the points of the
//! driver `hal`.
//!
//! LinuxCNC's own interface for Python makes the component, in a process of its own (`component.py`). It
//! outlives image files: after an online change, or when another control has been started, its pins are the
//! same, and still connected.

mod component;

use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use plcc_configuration::Point;
use plcc_image::hal_pin_name;
use serde_json::json;
use tokio::sync::Notify;

use crate::driver::{Driver, Making, Stages, Start, has_left};
use crate::events::Events;
use crate::hub::ControlState;
use crate::reconnection::{LONGEST_PAUSE, Reconnection};
use crate::session::Shared;
use crate::settings::Settings;
use component::Component;

/// How long the component has to begin: Python has to be loaded.
const BEGINNING: Duration = Duration::from_secs(20);
/// How often is checked whether there is a session, while there is no component.
const ROUND: Duration = Duration::from_millis(20);

/// The type of a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Bit,
    S32,
    U32,
    Float,
}

/// A pin, and the index of its point in the hub.
#[derive(Clone, Debug)]
struct Pin {
    index: usize,
    name: String,
    kind: Kind,
    is_input: bool,
    /// The safe value, of an output.
    safe: String,
}

impl Pin {
    /// Whether another session has the same pin. Its place in that session, and the value that is safe there,
    /// may be others.
    fn is_same(&self, other: &Self) -> bool {
        (&self.name, self.kind, self.is_input) == (&other.name, other.kind, other.is_input)
    }
}

impl Kind {
    fn of(point: &Point) -> Self {
        let place = point.symbol.outside();
        let is_scaled = point.entry.scale != 1.0 || point.entry.offset != 0.0;
        match place.range().filter(|_| !is_scaled) {
            None => Self::Float,
            Some(_) if place.is_bit() => Self::Bit,
            Some(range) if *range.end() > i32::MAX.into() => Self::U32,
            Some(_) => Self::S32,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Bit => "bit",
            Self::S32 => "s32",
            Self::U32 => "u32",
            Self::Float => "float",
        }
    }

    /// A value as the component reads it.
    fn text(self, value: f64) -> String {
        match self {
            Self::Float => format!("{value:?}"),
            Self::Bit => u8::from(value != 0.0).to_string(),
            Self::S32 => (value as i32).to_string(),
            Self::U32 => (value as u32).to_string(),
        }
    }
}

/// What the component exchanges values with.
enum Partner {
    /// There has been no control yet, or an online change has ended the session and the next one is about to begin: pins
    /// stay what they are for a while.
    Nobody,
    /// A session, with the pins of its points.
    Session(Shared, Vec<Pin>),
    /// A control that has died or ended: the pins that it had, and the line with their safe values.
    Gone(Vec<Pin>, String),
}

/// The component, for all sessions.
#[derive(Clone)]
struct Hal {
    partner: Arc<Mutex<Partner>>,
}

/// The driver: a thread makes the component and exchanges values with it.
struct HalDriver {
    settings: Arc<Settings>,
    events: Events,
    /// Ends `plcio`, since HAL unloads the component.
    end: Arc<Notify>,
    /// There is one from the first session on.
    hal: Option<Hal>,
}

/// Makes the driver.
pub(crate) fn driver(making: &Making<'_>) -> Box<dyn Driver> {
    Box::new(HalDriver {
        settings: Arc::clone(making.settings),
        events: making.events.clone(),
        end: Arc::clone(making.end),
        hal: None,
    })
}

impl Driver for HalDriver {
    fn start(&mut self, session: &mut Start<'_>) {
        let Self { settings, events, end, hal } = self;
        let hal = hal.get_or_insert_with(|| Hal::start(settings, events, end)).clone();
        let points = session.points.to_vec();
        session.show(hal.run(session.shared.clone(), points, session.stages.clone()));
    }
}

impl Hal {
    /// Starts the thread.
    fn start(settings: &Arc<Settings>, events: &Events, end: &Arc<Notify>) -> Self {
        let hal = Self { partner: Arc::new(Mutex::new(Partner::Nobody)) };
        let (own, settings, events, end) =
            (hal.clone(), Arc::clone(settings), events.clone(), Arc::clone(end));
        let work = move || {
            let about = vec![("device", "hal".into())];
            let mut connection = Reconnection::new(events.clone(), about);
            loop {
                let began = Instant::now();
                let Some(why) = own.component(&settings, &events) else {
                    end.notify_one();
                    return;
                };
                connection.lost(&why);
                // The component has worked for a while: the pauses begin with the shortest again.
                if began.elapsed() > LONGEST_PAUSE {
                    connection.note_connected();
                }
                std::thread::sleep(connection.next_pause());
            }
        };
        if let Err(error) = std::thread::Builder::new().name("hal".into()).spawn(work) {
            crate::say_error(error);
        }
        hal
    }

    /// Connects the points of a session until it ends.
    async fn run(self, shared: Shared, points: Vec<usize>, mut stages: Stages) {
        let pins: Vec<Pin> = {
            let hub = shared.hub();
            let pin = |index: usize| {
                let point = hub.point(index)?;
                let (kind, name) = (Kind::of(point), hal_pin_name(&point.symbol.name));
                let safe = hub.safe_value(index).unwrap_or(0.0);
                Some(Pin { index, name, kind, is_input: point.is_input, safe: kind.text(safe) })
            };
            points.into_iter().filter_map(pin).collect()
        };
        *self.partner() = Partner::Session(shared.clone(), pins.clone());
        has_left(&mut stages).await;
        // The lock of the values is given back first: an exchange takes both, that of the partner before it.
        let last = {
            let hub = shared.hub();
            let value = |index| hub.safe_value(index).or_else(|| hub.value_outside(index));
            (!hub.is_replaced()).then(|| outputs(false, &pins, value))
        };
        *self.partner() = match last {
            Some(line) => Partner::Gone(pins, line),
            None => Partner::Nobody,
        };
    }

    fn partner(&self) -> std::sync::MutexGuard<'_, Partner> {
        self.partner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The pins of the present session.
    fn pins(&self) -> Option<Vec<Pin>> {
        match &*self.partner() {
            Partner::Session(_, pins) => Some(pins.clone()),
            Partner::Nobody | Partner::Gone(..) => None,
        }
    }

    /// Waits for a session, makes the component, and works with it until it is lost: gives why, or `None`
    /// where HAL has unloaded it.
    fn component(&self, settings: &Settings, events: &Events) -> Option<String> {
        let pins = loop {
            match self.pins() {
                Some(pins) => break pins,
                None => std::thread::sleep(ROUND),
            }
        };
        let setup = json!({
            "component": settings.drivers.hal.component,
            "pins": pins.iter().map(|pin| json!({
                "name": pin.name,
                "type": pin.kind.name(),
                "input": pin.is_input,
                "safe": pin.safe,
            })).collect::<Vec<_>>(),
            "period": settings.poll.as_secs_f64(),
            "silence": settings.silence.as_secs_f64(),
        });
        let (mut component, lines) = match Component::start(&settings.drivers.hal.python, &setup) {
            Ok(started) => started,
            Err(error) => {
                return Some(format!("{}: {error}", settings.drivers.hal.python.display()));
            }
        };
        let mut connected = false;
        loop {
            let patience = if connected { settings.answer + settings.poll } else { BEGINNING };
            let line = match lines.recv_timeout(patience) {
                Ok(line) => line,
                Err(RecvTimeoutError::Timeout) => {
                    return Some("the component does not answer".into());
                }
                Err(RecvTimeoutError::Disconnected) => return Some(component.end()),
            };
            if line == "unloaded" {
                return None;
            }
            if let Some(why) = line.strip_prefix("error: ") {
                return Some(why.to_owned());
            }
            if !std::mem::replace(&mut connected, true) {
                events.write("connected", &[("device", "hal".into())]);
            }
            let answer = match self.exchange(&pins, &line) {
                Ok(answer) => answer,
                Err(why) => return Some(why),
            };
            if let Err(error) = component.answer(&answer) {
                return Some(error.to_string());
            }
        }
    }

    /// Gives the session the values of the inputs in a line, and makes the line of the outputs.
    ///
    /// # Errors
    /// Where the component does not fit the session any more.
    fn exchange(&self, pins: &[Pin], line: &str) -> Result<String, String> {
        let fits = |present: &[Pin]| {
            pins.len() == present.len() && pins.iter().zip(present).all(|(a, b)| a.is_same(b))
        };
        let partner = self.partner();
        let (shared, present) = match &*partner {
            Partner::Nobody => return Ok("-".into()),
            Partner::Session(shared, present) if fits(present) => (shared, present),
            Partner::Gone(present, line) if fits(present) => return Ok(line.clone()),
            _ => return Err("the program has other variables now".into()),
        };
        shared.refresh();
        let mut hub = shared.hub();
        let inputs = present.iter().filter(|pin| pin.is_input);
        for (pin, word) in inputs.zip(line.split_whitespace()) {
            let value = word.parse().map_err(|_| format!("`{word}` is not a value"))?;
            // A value that the variable can't have is an event of the control, and the input becomes late.
            hub.set_input(pin.index, value);
        }
        hub.publish();
        let is_running = hub.control_state() == ControlState::Running;
        Ok(outputs(is_running, present, |index| hub.value_outside(index)))
    }
}

/// The line that answers the component: whether the control runs its program, and the values of all outputs.
fn outputs(is_running: bool, pins: &[Pin], value: impl Fn(usize) -> Option<f64>) -> String {
    let mut line = String::from(if is_running { "1" } else { "0" });
    for pin in pins.iter().filter(|pin| !pin.is_input) {
        line.push(' ');
        match value(pin.index) {
            Some(value) => line.push_str(&pin.kind.text(value)),
            None => line.push_str(&pin.safe),
        }
    }
    line
}
