//! Ethernet frames between the crate `ethercrab` and the network interface.
//!
//! The crate's own task ends at the first frame that is not the answer to a question, and with it the connection. An answer
//! that comes too late or twice is such a frame, and whatever else is sent on the interface may be. Here they are passed over.

use std::future::poll_fn;
use std::io::ErrorKind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Poll;
use std::time::Duration;

use ethercrab::error::Error;
use ethercrab::{PduRx, PduTx};
use pnet_datalink::{Channel, Config, DataLinkReceiver, DataLinkSender};

/// How long the receiver waits for a frame until it looks whether it is to end.
const READ_TIMEOUT: Duration = Duration::from_millis(20);
/// How long the kernel may take no frame.
const WRITE_TIMEOUT: Duration = Duration::from_millis(20);

/// The two halves of a socket.
pub(super) type Halves = (Box<dyn DataLinkSender>, Box<dyn DataLinkReceiver>);

/// Opens a raw socket at a network interface.
///
/// # Errors
/// Why that is not possible, for people.
pub(super) fn open(name: &str) -> Result<Halves, String> {
    let interfaces = pnet_datalink::interfaces();
    let interface = interfaces
        .into_iter()
        .find(|interface| interface.name == name)
        .ok_or_else(|| format!("there is no network interface {name}"))?;
    if !interface.is_up() {
        return Err(format!("the interface is down; `ip link set {name} up` switches it on"));
    }
    let config = Config {
        read_timeout: Some(READ_TIMEOUT),
        write_timeout: Some(WRITE_TIMEOUT),
        // All frames of EtherCAT are broadcasts.
        promiscuous: false,
        ..Config::default()
    };
    match pnet_datalink::channel(&interface, config) {
        Ok(Channel::Ethernet(sender, receiver)) => Ok((sender, receiver)),
        Ok(_) => Err("it is not an Ethernet interface".into()),
        Err(error) if error.kind() == ErrorKind::PermissionDenied => Err(
            "plcio may open no raw socket: it needs the capability CAP_NET_RAW (docs/wiring.md)"
                .into(),
        ),
        Err(error) => Err(error.to_string()),
    }
}

/// Hands all frames that arrive to `answers`, until `stop` becomes true.
pub(super) fn receive(
    mut receiver: Box<dyn DataLinkReceiver>,
    mut answers: PduRx<'_>,
    stop: &AtomicBool,
) {
    while !stop.load(Ordering::Relaxed) {
        match receiver.next() {
            // What is not an answer that is waited for is passed over.
            Ok(frame) => drop(answers.receive_frame(frame)),
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            // An interface that is down says so once for each call. The sender finds out as well, and ends everything.
            Err(_) => std::thread::sleep(READ_TIMEOUT),
        }
    }
}

/// Sends all frames that are to be sent, until one can't be.
pub(super) async fn send(mut sender: Box<dyn DataLinkSender>, mut frames: PduTx<'_>) -> String {
    poll_fn(|context| {
        frames.replace_waker(context.waker());
        while let Some(frame) = frames.next_sendable_frame() {
            let mut why = String::new();
            let sent = frame.send_blocking(|bytes| match sender.send_to(bytes, None) {
                Some(Ok(())) => Ok(bytes.len()),
                Some(Err(error)) => {
                    why = error.to_string();
                    Err(Error::SendFrame)
                }
                None => Err(Error::SendFrame),
            });
            if let Err(error) = sent {
                return Poll::Ready(if why.is_empty() { error.to_string() } else { why });
            }
        }
        Poll::Pending
    })
    .await
}
