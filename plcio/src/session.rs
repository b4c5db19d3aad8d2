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
}

/// After how many rounds of 20 ms the session checks again whether the file of that name is still the one that it
/// has opened.
const ROUNDS_UNTIL_FILE_CHECK: u32 = 10;

/// What identifies the file at a path: the number of its device and its inode.
fn identity(path: &Path) -> Option<(u64, u64)> {
    std::fs::metadata(path).ok().map(|about| (about.dev(), about.ino()))
}

/// The work for one image file.
pub(crate) struct Session {
    shared: Shared,
    /// The identity of the image file.
    identity: Option<(u64, u64)>,
    /// For each driver the indices of its points.
    by_driver: Vec<(Driver, Vec<usize>)>,
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
        let reader = ImageReader::open(path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => named(&"there is no such image file yet; the control makes it"),
            _ => named(&error),
        })?;
        match reader.state() {
            Some(State::Prepared | State::Running | State::Stopped) => {}
            _ => return Err(named(&"the control does not run")),
        }
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
        let writer = InputWriter::open(path, "plcio").map_err(|error| named(&error))?;
        let hub = Hub::new(reader, writer, points, symbols, settings.silence)?;
        let image = path.display().to_string();
        events.write("control_found", &[("image", image.into())]);
        let hub = Arc::new(Mutex::new(hub));
        let settings = Arc::new(settings.clone());
        Ok(Self { shared: Shared { hub, events: events.clone(), settings }, identity, by_driver })
    }

    /// Runs the drivers until the image file is over or `stopped` becomes true.
    pub(crate) async fn run(self, mut stopped: Receiver<bool>, hal: Option<Hal>) {
        let Self { shared, identity, by_driver } = self;
        let mut rounds = 0_u32;
        let (end, ended) = watch::channel(false);
        let mut tasks = JoinSet::new();
        // Its server shows all variables, also where no entry names it.
        #[cfg(feature = "opcua")]
        if shared.settings.opcua.address.is_some() {
            let of = |wanted| by_driver.iter().find(|(driver, _)| *driver == wanted);
            let points = of(Driver::OpcUa).map(|(_, points)| points.clone()).unwrap_or_default();
            tasks.spawn(crate::opcua::run(shared.clone(), points, ended.clone()));
        }
        for (driver, points) in by_driver {
            match driver {
                Driver::ModbusTcp | Driver::ModbusRtu => {
                    for device in client::devices(&shared, &points) {
                        tasks.spawn(device.run(shared.clone(), ended.clone()));
                    }
                }
                Driver::ModbusServer => {
                    tasks.spawn(server::run(shared.clone(), points, ended.clone()));
                }
                #[cfg(feature = "mqtt")]
                Driver::Mqtt => {
                    tasks.spawn(crate::mqtt::run(shared.clone(), points, ended.clone()));
                }
                // `Settings` refuses what this `plcio` was built without.
                #[cfg(not(feature = "mqtt"))]
                Driver::Mqtt => {}
                #[cfg(feature = "zenoh")]
                Driver::Zenoh => {
                    tasks.spawn(crate::plant::run(shared.clone(), points, ended.clone()));
                }
                #[cfg(not(feature = "zenoh"))]
                Driver::Zenoh => {}
                #[cfg(feature = "gpio")]
                Driver::Gpio => {
                    for chip in crate::gpio::chips(&shared, &points) {
                        tasks.spawn(chip.run(shared.clone(), ended.clone()));
                    }
                }
                #[cfg(not(feature = "gpio"))]
                Driver::Gpio => {}
                #[cfg(feature = "ethercat")]
                Driver::Ethercat => {
                    if let Some(segment) = crate::ethercat::Segment::new(&shared, &points) {
                        tasks.spawn(segment.run(shared.clone(), ended.clone()));
                    }
                }
                #[cfg(not(feature = "ethercat"))]
                Driver::Ethercat => {}
                Driver::Hal => {
                    if let Some(hal) = hal.clone() {
                        tasks.spawn(hal.run(shared.clone(), points, ended.clone()));
                    }
                }
                // The server for OPC UA was begun above.
                Driver::OpcUa | Driver::Other => {}
            }
        }
        loop {
            tokio::select! {
                () = tokio::time::sleep(Duration::from_millis(20)) => {}
                _ = stopped.changed() => break,
            }
            let changed = shared.hub().refresh();
            if let Some(safe) = changed {
                let kind = if safe { "control_silent" } else { "control_heard" };
                shared.events.write(kind, &[]);
            }
            // A control that was killed can't say that it has ended, but the next one makes another file.
            rounds = rounds.wrapping_add(1);
            let path = &shared.settings.image;
            let is_other =
                rounds.is_multiple_of(ROUNDS_UNTIL_FILE_CHECK) && self::identity(path) != identity;
            if is_other || !shared.hub().is_current() {
                break;
            }
        }
        // The drivers write the outputs for the last time: as the control has left them, or safe.
        if *stopped.borrow() {
            shared.hub().end();
        } else {
            shared.hub().refresh();
        }
        let _ = end.send(true);
        let wait = async { while tasks.join_next().await.is_some() {} };
        let _ = tokio::time::timeout(Duration::from_secs(2), wait).await;
        shared.events.write("control_left", &[]);
    }
}
