//! What a driver is to a session: it is started with its points, and ends when it is told so.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

use tokio::sync::Notify;
use tokio::sync::watch::Receiver;
use tokio::task::JoinSet;

use crate::events::Events;
use crate::session::Shared;
use crate::settings::Settings;

/// How far the work for an image file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// The control is there.
    Works,
    /// It has left. Drivers that write outputs give each device its safe values, also one that comes back later, until another
    /// control is found. Other drivers end.
    Left,
    /// The drivers write the outputs for the last time and end.
    Ends,
}

/// Tells drivers how far the work is.
pub(crate) type Stages = Receiver<Stage>;

/// Waits for the end of the work.
#[cfg(any(feature = "gpio", feature = "ethercat"))]
pub(crate) async fn is_over(stages: &mut Stages) {
    while *stages.borrow_and_update() != Stage::Ends && stages.changed().await.is_ok() {}
}

/// Waits until the control has left.
pub(crate) async fn has_left(stages: &mut Stages) {
    while *stages.borrow_and_update() == Stage::Works && stages.changed().await.is_ok() {}
}

/// A driver, for all image files one after the other. Its other half, which reads addresses and settings, is a driver of the crate
/// `plcc-configuration`.
pub(crate) trait Driver: Send {
    /// Begins the work for an image file.
    fn start(&mut self, session: &mut Start<'_>);

    /// Whether it works for an image file also where no entry names it.
    fn works_without_points(&self) -> bool {
        false
    }

    /// Ends what outlives the work for an image file.
    fn end(&mut self) -> Pin<Box<dyn Future<Output = ()> + Send + '_>> {
        Box::pin(async {})
    }
}

/// What a driver is made with.
pub(crate) struct Making<'a> {
    pub(crate) settings: &'a Arc<Settings>,
    pub(crate) events: &'a Events,
    /// Ends `plcio`.
    pub(crate) end: &'a Arc<Notify>,
}

/// The beginning of the work for an image file.
pub(crate) struct Start<'a> {
    pub(crate) shared: &'a Shared,
    /// The indices of the driver's points in the hub.
    pub(crate) points: &'a [usize],
    pub(crate) stages: Stages,
    pub(super) writers: &'a mut JoinSet<()>,
    /// Nothing where the control has left.
    pub(super) others: Option<&'a mut JoinSet<()>>,
}

impl Start<'_> {
    /// Starts a task that writes outputs to a device: it goes on when the control has left, and ends with [`Stage::Ends`].
    pub(crate) fn write(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        self.writers.spawn(task);
    }

    /// Starts a task for others who look on, which ends when the control has left; if that has left already, there is none.
    pub(crate) fn show(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        if let Some(others) = &mut self.others {
            others.spawn(task);
        }
    }
}
