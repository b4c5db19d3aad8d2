//! Terminals of an EtherCAT segment, by the crate `ethercrab`: inputs and outputs are exchanged in every poll.
//!
//! A thread of its own drives the segment while it is connected. What is wrong ends the connection: terminals that
//! do not answer, that are others than the configuration says, or that leave the state OP. All terminals are then set
//! to INIT, in which outputs are off, and the segment is brought up again after pauses that grow from 0.1 s to 5 s.
//! Inputs become late meanwhile. A panic in the crate ends the thread, and counts as a lost connection, too.
//!
//! | file | holds |
//! | --- | --- |
//! | `bring_up.rs` | from the first frame to the state OP, and back to INIT |
//! | `exchange.rs` | the exchange of values, poll for poll |
//! | `expected.rs` | the terminals that the configuration expects |
//! | `process_data.rs` | values in the process data of a terminal |
//! | `socket.rs` | Ethernet frames |

mod bring_up;
mod exchange;
mod expected;
mod process_data;
mod socket;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use ethercrab::{MainDevice, MainDeviceConfig, PduStorage, RetryBehaviour, Timeouts};
use plcc_configuration::drivers::ethercat::EthercatPoint;
use tokio::sync::oneshot;

use crate::driver::{Driver, Making, Stage, Stages, Start, is_over};
use crate::reconnection::Reconnection;
use crate::session::Shared;

/// How many frames are on their way at once at most.
const FRAMES: usize = 16;
/// The longest payload of an Ethernet frame with one datagram.
const FRAME_BYTES: usize = PduStorage::element_size(1486);
/// How long is waited for the answer to a frame, until it is sent again.
const ANSWER: Duration = Duration::from_millis(30);
/// How often a frame without an answer is sent again.
const RETRIES: usize = 3;
/// How long a terminal may take for a change of its state.
const STATE_CHANGE: Duration = Duration::from_secs(3);
/// How long a terminal may take for a read of its memory, or for its mailbox.
const MEMORY: Duration = Duration::from_millis(500);
/// The stack of the thread. The crate's futures are large where they are not optimised.
const STACK: usize = 16 << 20;

/// The driver: the segment is a task.
struct Ethercat;

/// Makes the driver.
pub(crate) fn driver(_: &Making<'_>) -> Box<dyn Driver> {
    Box::new(Ethercat)
}

impl Driver for Ethercat {
    fn start(&mut self, session: &mut Start<'_>) {
        if let Some(segment) = Segment::new(session.shared, session.points) {
            session.write(segment.run(session.shared.clone(), session.stages.clone()));
        }
    }
}

/// The points of a segment, each with its index in the hub.
struct Segment {
    /// The network interface.
    interface: String,
    inputs: Vec<(usize, EthercatPoint)>,
    outputs: Vec<(usize, EthercatPoint)>,
}

/// How a connection ended.
struct Ended {
    /// Whether values were exchanged before.
    was_connected: bool,
    /// Why it was lost; nothing where the session ended.
    why: Result<(), String>,
}

/// Becomes true when it is dropped, also by a panic.
struct StopOnDrop<'a>(&'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Segment {
    /// The segment of some points; nothing where there are none.
    fn new(shared: &Shared, points: &[usize]) -> Option<Self> {
        let hub = shared.hub();
        let (mut inputs, mut outputs) = (vec![], vec![]);
        for &index in points {
            let Some(at) = hub.point(index)?.address::<EthercatPoint>() else { continue };
            if at.is_output { &mut outputs } else { &mut inputs }.push((index, at.clone()));
        }
        // The check of the entries has seen that there is one interface only.
        let interface = inputs.iter().chain(&outputs).next()?.1.interface.clone();
        Some(Self { interface, inputs, outputs })
    }

    /// Exchanges values with the terminals until the session ends; then switches their outputs off. When the control has
    /// left, they still get their safe values.
    async fn run(self, shared: Shared, mut stages: Stages) {
        let segment = Arc::new(self);
        let about = vec![("device", segment.interface.as_str().into())];
        let mut connection = Reconnection::new(shared.events.clone(), about);
        // When the control has left, its inputs are of no use.
        while *stages.borrow() == Stage::Works || !segment.outputs.is_empty() {
            let Ended { was_connected, why } = segment.on_a_thread(&shared, &stages).await;
            let Err(why) = why else { return };
            if was_connected {
                // The exchange has reported it, with the names of the terminals.
                connection.note_connected();
            }
            connection.lost(&why);
            if !connection.wait(is_over(&mut stages)).await {
                return;
            }
        }
    }

    /// One connection on a thread of its own.
    async fn on_a_thread(self: &Arc<Self>, shared: &Shared, stages: &Stages) -> Ended {
        let (sender, receiver) = oneshot::channel();
        let (segment, shared, stages) = (Arc::clone(self), shared.clone(), stages.clone());
        let work = move || {
            let mut was_connected = false;
            let why = segment.connect(&shared, stages, &mut was_connected);
            let _ = sender.send(Ended { was_connected, why });
        };
        let builder = thread::Builder::new().name("ethercat".into()).stack_size(STACK);
        let why = match builder.spawn(work) {
            Ok(_) => match receiver.await {
                Ok(ended) => return ended,
                Err(_) => "the library for EtherCAT has failed (see standard error)".into(),
            },
            Err(error) => error.to_string(),
        };
        Ended { was_connected: false, why: Err(why) }
    }

    /// One connection, until the session ends.
    ///
    /// # Errors
    /// Why it was lost.
    fn connect(
        &self,
        shared: &Shared,
        stages: Stages,
        was_connected: &mut bool,
    ) -> Result<(), String> {
        let (sender, receiver) = socket::open(&self.interface)?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build();
        let runtime = runtime.map_err(|error| error.to_string())?;
        let storage = Box::new(PduStorage::<FRAMES, FRAME_BYTES>::new());
        let split = storage.try_split();
        let (frames, answers, pdu_loop) = split.map_err(|()| "the frames are in use")?;
        let timeouts = Timeouts {
            pdu: ANSWER,
            state_transition: STATE_CHANGE,
            eeprom: MEMORY,
            mailbox_echo: MEMORY,
            mailbox_response: MEMORY,
            wait_loop_delay: Duration::from_millis(1),
        };
        let config = MainDeviceConfig {
            // Distributed clocks are not used.
            dc_static_sync_iterations: 0,
            retry_behaviour: RetryBehaviour::Count(RETRIES),
        };
        let main_device = MainDevice::new(pdu_loop, timeouts, config);
        let stop = AtomicBool::new(false);
        thread::scope(|scope| {
            let _stop = StopOnDrop(&stop);
            let receive = || socket::receive(receiver, answers, &stop);
            let builder = thread::Builder::new().name("ethercat-answers".into());
            builder.spawn_scoped(scope, receive).map_err(|error| error.to_string())?;
            let work = Box::pin(self.work(&main_device, shared, stages, was_connected));
            runtime.block_on(async {
                tokio::select! {
                    why = socket::send(sender, frames) => Err(why),
                    done = work => done,
                }
            })
        })
    }
}
