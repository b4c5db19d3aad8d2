//! The work for one image file, from its beginning until the control ends, makes another one, or `plcio`
//! ends.

use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use plcc_abi::Dialect;
use plcc_image::{ImageReader, InputWriter, State};
use tokio::sync::watch::{self, Receiver};
use tokio::task::JoinSet;

use crate::driver::Stage;
use crate::drivers::Drivers;
use crate::events::Events;
use crate::hub::Hub;
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

    /// Reads the newest tick, and reports whether the control has become silent or ends ticks again. The session does so
    /// continually, and drivers that take outputs to devices before they write.
    pub(crate) fn refresh(&self) {
        let changed = self.hub().refresh();
        if let Some(safe) = changed {
            self.events.write(if safe { "control_silent" } else { "control_heard" }, &[]);
        }
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
}

/// The drivers that still write outputs when the control has left.
pub(crate) struct Remains {
    shared: Shared,
    stages: watch::Sender<Stage>,
    writers: JoinSet<()>,
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
        wait_for(&mut self.writers).await;
    }
}

impl Session {
    /// Opens the image file of the control and claims the inputs.
    ///
    /// # Errors
    /// Why that is not possible now. It may be possible later, for example when the control has been started.
    pub(crate) fn open(settings: &Arc<Settings>, events: &Events) -> Result<Self, String> {
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
    pub(crate) fn left(
        settings: &Arc<Settings>,
        events: &Events,
        drivers: &mut Drivers,
    ) -> Option<Remains> {
        let reader = open_image(&settings.image).ok()?;
        matches!(reader.state(), Some(State::Ended | State::Dead)).then_some(())?;
        let session = Self::new(settings, events, reader, None, None).ok()?;
        session.shared.hub().refresh();
        let (stages, received) = watch::channel(Stage::Left);
        let writers = drivers.start(&session.shared, &received, None);
        Some(Remains { shared: session.shared, stages, writers })
    }

    /// The session for an image file; without a `writer` the control has left.
    ///
    /// # Errors
    /// Why the entries do not fit the program, or a variable can't be claimed.
    fn new(
        settings: &Arc<Settings>,
        events: &Events,
        reader: ImageReader,
        writer: Option<InputWriter>,
        identity: Option<(u64, u64)>,
    ) -> Result<Self, String> {
        let dialect = Dialect::ALL.get(usize::try_from(reader.dialect()).unwrap_or(usize::MAX));
        let ends_in_bits = dialect.is_some_and(|dialect| dialect.names_end_in_bits());
        let symbols = reader.symbols();
        let checked = plcc_configuration::points(&settings.entries, &symbols, ends_in_bits, &[]);
        if let Some(mistake) = checked.mistakes.first() {
            return Err(format!("line {}: {}", mistake.line, mistake.message));
        }
        let own = checked.points.into_iter().filter(|point| point.entry.driver.is_of_plcio());
        let points = own.collect();
        let hub = Hub::new(reader, writer, points, symbols, settings.silence)?;
        let hub = Arc::new(Mutex::new(hub));
        let settings = Arc::clone(settings);
        Ok(Self { shared: Shared { hub, events: events.clone(), settings }, identity })
    }

    /// Runs the drivers until the image file is over or `stopped` becomes true. Returns those that still write outputs
    /// where the control has left.
    pub(crate) async fn run(
        self,
        mut stopped: Receiver<bool>,
        drivers: &mut Drivers,
    ) -> Option<Remains> {
        let Self { shared, identity } = self;
        let (stages, received) = watch::channel(Stage::Works);
        let mut others = JoinSet::new();
        let writers = drivers.start(&shared, &received, Some(&mut others));
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
        let _ = stages.send(if is_end { Stage::Ends } else { Stage::Left });
        let remains = Remains { shared: shared.clone(), stages, writers };
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
