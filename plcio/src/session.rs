//! The work for one image file, from its beginning until the control ends, makes another one, or `plcio`
//! ends.

use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use plcc_abi::Dialect;
use plcc_image::configuration::{self, Driver};
use plcc_image::{ImageReader, InputWriter, State};
use tokio::sync::watch::{self, Receiver};
use tokio::task::JoinSet;

use crate::events::Events;
use crate::hal::Hal;
use crate::hub::Hub;
use crate::modbus::{client, server};
use crate::settings::Settings;

/// What all drivers share.
#[derive(Clone, Debug)]
pub(crate) struct Shared {
    hub: Arc<Mutex<Hub>>,
    pub(crate) events: Events,
    pub(crate) settings: Arc<Settings>,
}

impl Shared {
    /// The values.
    pub(crate) fn hub(&self) -> MutexGuard<'_, Hub> {
        self.hub.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the newest tick, and reports whether the control has become silent or ends ticks again.
    fn refresh(&self) {
        let changed = self.hub().refresh();
        if let Some(safe) = changed {
            self.events.write(if safe { "control_silent" } else { "control_heard" }, &[]);
        }
    }
}

/// How far the work for an image file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// The control is there.
    Works,
    /// It has left. Drivers that write outputs give each device its safe values, also one that comes back later, until another
    /// control is found.
    Left,
    /// The drivers write the outputs for the last time and end.
    Ends,
}

/// Tells drivers that write outputs how far the work is. Other drivers end when the control has left.
pub(crate) type Stages = Receiver<Stage>;

/// Waits for the end of the work.
#[cfg(any(feature = "gpio", feature = "ethercat"))]
pub(crate) async fn is_over(stages: &mut Stages) {
    while *stages.borrow_and_update() != Stage::Ends && stages.changed().await.is_ok() {}
}

/// After how many rounds of 20 ms the session checks again whether the file of that name is still the one that it
/// has opened.
const ROUNDS_UNTIL_FILE_CHECK: u32 = 10;

/// What identifies the file at a path: the number of its device and its inode.
fn identity(path: &Path) -> Option<(u64, u64)> {
    std::fs::metadata(path).ok().map(|about| (about.dev(), about.ino()))
}

/// What outlives sessions.
pub(crate) struct Outlasting {
    /// The component of HAL, where entries name pins.
    hal: Option<Hal>,
    /// The server for OPC UA.
    #[cfg(feature = "opcua")]
    pub(crate) opcua: crate::opcua::Server,
}

impl Outlasting {
    pub(crate) fn new(hal: Option<Hal>) -> Self {
        Self {
            hal,
            #[cfg(feature = "opcua")]
            opcua: crate::opcua::Server::default(),
        }
    }
}

/// The work for one image file.
pub(crate) struct Session {
    shared: Shared,
    /// The identity of the image file.
    identity: Option<(u64, u64)>,
    /// For each driver the indices of its points.
    by_driver: Vec<(Driver, Vec<usize>)>,
}

/// The drivers that still write outputs when the control has left.
pub(crate) struct Remains {
    shared: Shared,
    stages: watch::Sender<Stage>,
    drivers: JoinSet<()>,
}

/// Waits for the end of tasks, but not for one that hangs.
async fn wait_for(tasks: &mut JoinSet<()>) {
    let wait = async { while tasks.join_next().await.is_some() {} };
    let _ = tokio::time::timeout(Duration::from_secs(2), wait).await;
}

impl Remains {
    /// Makes outputs safe that were left as they were for an online change, if that was too long ago.
    pub(crate) fn refresh(&self) {
        let mut hub = self.shared.hub();
        if !hub.is_safe() {
            hub.refresh();
        }
    }

    /// Ends the drivers, which write the outputs once more.
    pub(crate) async fn end(mut self) {
        let _ = self.stages.send(Stage::Ends);
        wait_for(&mut self.drivers).await;
    }
}

impl Session {
    /// Opens the image file of the control and claims the inputs.
    ///
    /// # Errors
    /// Why that is not possible now. It may be possible later, for example when the control has been started.
    pub(crate) fn open(settings: &Settings, events: &Events) -> Result<Self, String> {
        let path = &settings.image;
        let named = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
        let identity = identity(path);
        let reader = open_image(path)?;
        match reader.state() {
            Some(State::Prepared | State::Running | State::Stopped) => {}
            _ => return Err(named(&"the control does not run")),
        }
        let writer = InputWriter::open(path, "plcio").map_err(|error| named(&error))?;
        let session = Self::new(settings, events, reader, Some(writer), identity)?;
        events.write("control_found", &[("image", path.display().to_string().into())]);
        session.shared.refresh();
        Ok(session)
    }

    /// Begins to write the safe outputs of a control that has left before `plcio` was started, if its image file is still
    /// there.
    pub(crate) fn left(settings: &Settings, events: &Events) -> Option<Remains> {
        let reader = open_image(&settings.image).ok()?;
        matches!(reader.state(), Some(State::Ended | State::Dead)).then_some(())?;
        let session = Self::new(settings, events, reader, None, None).ok()?;
        session.shared.hub().refresh();
        let (stages, received) = watch::channel(Stage::Left);
        let drivers = session.start_outputs(&received);
        Some(Remains { shared: session.shared, stages, drivers })
    }

    /// The session for an image file; without a `writer` the control has left.
    ///
    /// # Errors
    /// Why the entries do not fit the program, or a variable can't be claimed.
    fn new(
        settings: &Settings,
        events: &Events,
        reader: ImageReader,
        writer: Option<InputWriter>,
        identity: Option<(u64, u64)>,
    ) -> Result<Self, String> {
        let dialect = Dialect::ALL.get(usize::try_from(reader.dialect()).unwrap_or(usize::MAX));
        // Numbers in names of NCT end in a bit from 0 to 7.
        let is_nct = dialect == Some(&Dialect::Nct);
        let symbols = reader.symbols();
        let checked = configuration::points(&settings.entries, &symbols, is_nct, &[]);
        if let Some(mistake) = checked.mistakes.first() {
            return Err(format!("line {}: {}", mistake.line, mistake.message));
        }
        let own = checked.points.into_iter().filter(|point| point.entry.driver != Driver::Other);
        let points: Vec<_> = own.collect();
        let mut by_driver: Vec<(Driver, Vec<usize>)> = vec![];
        for (index, point) in points.iter().enumerate() {
            match by_driver.iter_mut().find(|(driver, _)| *driver == point.entry.driver) {
                Some((_, indices)) => indices.push(index),
                None => by_driver.push((point.entry.driver, vec![index])),
            }
        }
        let hub = Hub::new(reader, writer, points, symbols, settings.silence)?;
        let hub = Arc::new(Mutex::new(hub));
        let settings = Arc::new(settings.clone());
        Ok(Self { shared: Shared { hub, events: events.clone(), settings }, identity, by_driver })
    }

    /// Starts the drivers that write outputs to devices.
    fn start_outputs(&self, stages: &Stages) -> JoinSet<()> {
        let Self { shared, by_driver, .. } = self;
        let mut drivers = JoinSet::new();
        for (driver, points) in by_driver {
            match driver {
                Driver::ModbusTcp | Driver::ModbusRtu => {
                    for device in client::devices(shared, points) {
                        drivers.spawn(device.run(shared.clone(), stages.clone()));
                    }
                }
                #[cfg(feature = "gpio")]
                Driver::Gpio => {
                    for chip in crate::gpio::chips(shared, points) {
                        drivers.spawn(chip.run(shared.clone(), stages.clone()));
                    }
                }
                #[cfg(feature = "ethercat")]
                Driver::Ethercat => {
                    if let Some(segment) = crate::ethercat::Segment::new(shared, points) {
                        drivers.spawn(segment.run(shared.clone(), stages.clone()));
                    }
                }
                _ => {}
            }
        }
        drivers
    }

    /// Starts the drivers for others who look on, which end with the control.
    fn start_others(&self, outlasting: &Outlasting, ended: &Receiver<bool>) -> JoinSet<()> {
        let Self { shared, by_driver, .. } = self;
        let mut tasks = JoinSet::new();
        // Its server shows all variables, also where no entry names it.
        #[cfg(feature = "opcua")]
        if shared.settings.opcua.address.is_some() {
            let of = |wanted| by_driver.iter().find(|(driver, _)| *driver == wanted);
            let points = of(Driver::OpcUa).map(|(_, points)| points.clone()).unwrap_or_default();
            let server = outlasting.opcua.clone();
            tasks.spawn(server.run(shared.clone(), points, ended.clone()));
        }
        for (driver, points) in by_driver {
            let points = points.clone();
            match driver {
                Driver::ModbusServer => {
                    tasks.spawn(server::run(shared.clone(), points, ended.clone()));
                }
                #[cfg(feature = "mqtt")]
                Driver::Mqtt => {
                    tasks.spawn(crate::mqtt::run(shared.clone(), points, ended.clone()));
                }
                #[cfg(feature = "zenoh")]
                Driver::Zenoh => {
                    tasks.spawn(crate::plant::run(shared.clone(), points, ended.clone()));
                }
                Driver::Hal => {
                    if let Some(hal) = outlasting.hal.clone() {
                        tasks.spawn(hal.run(shared.clone(), points, ended.clone()));
                    }
                }
                // Those that write outputs, the server for OPC UA, which was begun above, and what this `plcio` was
                // built without: `Settings` refuses that.
                _ => {}
            }
        }
        tasks
    }

    /// Runs the drivers until the image file is over or `stopped` becomes true. Returns those that still write outputs
    /// where the control has left.
    pub(crate) async fn run(
        self,
        mut stopped: Receiver<bool>,
        outlasting: &Outlasting,
    ) -> Option<Remains> {
        let (end, ended) = watch::channel(false);
        let mut others = self.start_others(outlasting, &ended);
        let (stages, received) = watch::channel(Stage::Works);
        let drivers = self.start_outputs(&received);
        let Self { shared, identity, .. } = self;
        let mut rounds = 0_u32;
        loop {
            tokio::select! {
                () = tokio::time::sleep(Duration::from_millis(20)) => {}
                _ = stopped.changed() => break,
            }
            shared.refresh();
            // A control that was killed can't say that it has ended, but the next one makes another file.
            rounds = rounds.wrapping_add(1);
            let path = &shared.settings.image;
            let is_other =
                rounds.is_multiple_of(ROUNDS_UNTIL_FILE_CHECK) && self::identity(path) != identity;
            if is_other || !shared.hub().is_current() {
                break;
            }
        }
        // The outputs become safe, or stay as an online change has left them.
        let is_end = *stopped.borrow();
        if is_end {
            shared.hub().end();
        } else {
            shared.hub().leave();
        }
        let _ = end.send(true);
        let _ = stages.send(if is_end { Stage::Ends } else { Stage::Left });
        let remains = Remains { shared: shared.clone(), stages, drivers };
        let remains = match is_end {
            true => {
                tokio::join!(remains.end(), wait_for(&mut others));
                None
            }
            false => {
                wait_for(&mut others).await;
                Some(remains)
            }
        };
        shared.events.write("control_left", &[]);
        remains
    }
}

/// Opens the image file of the control.
///
/// # Errors
/// Why that is not possible, for people.
fn open_image(path: &Path) -> Result<ImageReader, String> {
    ImageReader::open(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => {
            format!("{}: there is no such image file yet; the control makes it", path.display())
        }
        _ => format!("{}: {error}", path.display()),
    })
}
