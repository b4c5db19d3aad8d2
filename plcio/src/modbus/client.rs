//! Asks devices: reads what they give, and writes what they get, in every poll.
//!
//! An input whose device gives no value in time becomes late, so that the control gives it its safe value. A lost connection is made again, after pauses that grow from 0.1 s to 5 s.

use std::collections::HashMap;
use std::time::Duration;

use plcc_image::configuration::{Address, Medium, Table};
use rustix::io::Errno;
use serde_json::Value;
use tokio::net::TcpStream;
use tokio::sync::watch::Receiver;
use tokio::time::{Instant, sleep_until, timeout};
use tokio_modbus::client::{Client, Context, rtu, tcp};
use tokio_modbus::slave::{Slave, SlaveContext};
use tokio_modbus::{Request, Response};
use tokio_serial::{ClearBuffer, SerialPort, SerialPortBuilderExt};

use super::blocks::{Block, Member, blocks};
use crate::session::Shared;

/// The shortest and the longest pause before a connection is made again.
const PAUSES: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(5));

/// A device, or all units of a serial line.
pub(crate) struct Device {
    name: String,
    medium: Medium,
    reads: Vec<Block>,
    writes: Vec<Block>,
}

/// The devices of some points.
pub(crate) fn devices(shared: &Shared, points: &[usize]) -> Vec<Device> {
    let mut found: Vec<(Medium, Vec<Member>, Vec<Member>)> = vec![];
    let hub = shared.hub();
    for &index in points {
        let Some(point) = hub.point(index) else { continue };
        let Some(Address::Modbus(address)) = point.address.clone() else { continue };
        let medium = address.medium.clone();
        if !found.iter().any(|(known, ..)| *known == medium) {
            found.push((medium.clone(), vec![], vec![]));
        }
        if let Some((_, reads, writes)) = found.iter_mut().find(|(known, ..)| *known == medium) {
            let members = if point.is_input { reads } else { writes };
            members.push(Member { index, address });
        }
    }
    let device = |(medium, reads, writes): (Medium, Vec<Member>, Vec<Member>)| {
        let name = match &medium {
            Medium::Tcp(host, port) => format!("{host}:{port}"),
            Medium::Serial(device, ..) => device.clone(),
            Medium::Server => String::new(),
        };
        Device { name, medium, reads: blocks(reads), writes: blocks(writes) }
    };
    found.into_iter().map(device).collect()
}

/// Why a request failed.
enum Failure {
    /// The device has answered that it can't do it. The connection is sound.
    Refused(String),
    /// There is no answer, or one that can't be right. The connection is closed.
    Lost(String),
}

impl Device {
    /// Polls the device until the session ends; then writes the outputs once more.
    pub(crate) async fn run(self, shared: Shared, mut ended: Receiver<bool>) {
        let mut pause = PAUSES.0;
        let mut reported: Option<String> = None;
        let device = || ("device", Value::from(self.name.as_str()));
        loop {
            let connected = tokio::select! {
                connected = timeout(shared.settings.answer.max(Duration::from_millis(500)), self.connect()) => connected,
                _ = ended.changed() => return,
            };
            let why = match connected.unwrap_or_else(|_| Err("it does not answer".into())) {
                Ok(mut context) => {
                    let (reported, pause) = (&mut reported, &mut pause);
                    let why = self.poll(&mut context, &shared, &mut ended, reported, pause).await;
                    let _ = timeout(Duration::from_millis(100), context.disconnect()).await;
                    match why {
                        Some(why) => why,
                        None => return,
                    }
                }
                Err(why) => why,
            };
            // The same reason is reported once, however often connecting fails.
            if reported.as_ref() != Some(&why) {
                shared.events.write("lost", &[device(), ("why", why.as_str().into())]);
                reported = Some(why);
            }
            tokio::select! {
                () = tokio::time::sleep(pause) => {}
                _ = ended.changed() => return,
            }
            pause = (pause * 2).min(PAUSES.1);
        }
    }

    async fn connect(&self) -> Result<Context, String> {
        match &self.medium {
            Medium::Tcp(host, port) => {
                let stream = TcpStream::connect((host.as_str(), *port)).await;
                let stream = stream.map_err(|error| error.to_string())?;
                let _ = stream.set_nodelay(true);
                Ok(tcp::attach(stream))
            }
            Medium::Serial(path, bauds, parity) => {
                let parity = match parity {
                    'E' => tokio_serial::Parity::Even,
                    'O' => tokio_serial::Parity::Odd,
                    _ => tokio_serial::Parity::None,
                };
                let line = tokio_serial::new(path, *bauds).parity(parity).open_native_async();
                let line = line.map_err(|error| error.to_string())?;
                // What came after an earlier request was given up must not count as an answer to the next one.
                line.clear(ClearBuffer::Input).map_err(|error| error.to_string())?;
                Ok(rtu::attach(line))
            }
            Medium::Server => Err("a server is not asked".into()),
        }
    }

    /// Polls until the connection is lost (gives why) or the session ends (`None`).
    async fn poll(
        &self,
        context: &mut Context,
        shared: &Shared,
        ended: &mut Receiver<bool>,
        reported: &mut Option<String>,
        pause: &mut Duration,
    ) -> Option<String> {
        // Whether the event `connected` has been written.
        let mut answers = false;
        // The requests that the device refuses, by their numbers among all requests of a poll, and the reasons.
        let mut refused: HashMap<usize, String> = HashMap::new();
        let mut next = Instant::now();
        loop {
            let last = *ended.borrow();
            let writes = self.writes.iter().map(|block| (block, true));
            let reads = self.reads.iter().map(|block| (block, false)).filter(|_| !last);
            for (number, (block, is_write)) in writes.chain(reads).enumerate() {
                let done = if is_write {
                    write(context, shared, block).await
                } else {
                    read(context, shared, block).await
                };
                let about = |why: Option<&str>| {
                    let mut about = vec![
                        ("device", Value::from(self.name.as_str())),
                        ("unit", block.unit.into()),
                        ("table", format!("{:?}", block.table).to_lowercase().into()),
                        ("number", block.start.into()),
                    ];
                    about.extend(why.map(|why| ("why", why.into())));
                    about
                };
                match done {
                    Ok(()) => {
                        if refused.remove(&number).is_some() {
                            shared.events.write("accepted", &about(None));
                        }
                    }
                    Err(Failure::Refused(why)) => {
                        if refused.get(&number) != Some(&why) {
                            shared.events.write("refused", &about(Some(&why)));
                            refused.insert(number, why);
                        }
                    }
                    Err(Failure::Lost(why)) => return if last { None } else { Some(why) },
                }
            }
            if last {
                return None;
            }
            // All requests were answered: the connection is sound.
            if !std::mem::replace(&mut answers, true) {
                let device = ("device", Value::from(self.name.as_str()));
                shared.events.write("connected", &[device]);
                (*reported, *pause) = (None, PAUSES.0);
            }
            shared.hub().publish();
            next = (next + shared.settings.poll).max(Instant::now());
            tokio::select! {
                () = sleep_until(next) => {}
                _ = ended.changed() => {}
            }
        }
    }
}

/// Sends a request and gives the answer.
async fn ask(
    context: &mut Context,
    shared: &Shared,
    unit: u8,
    request: Request<'_>,
) -> Result<Response, Failure> {
    context.set_slave(Slave(unit));
    match timeout(shared.settings.answer, context.call(request)).await {
        Err(_) => Err(Failure::Lost("it does not answer".into())),
        Ok(Err(error)) => Err(Failure::Lost(why_lost(&error))),
        Ok(Ok(Err(code))) => Err(Failure::Refused(code.to_string())),
        Ok(Ok(Ok(response))) => Ok(response),
    }
}

/// Why a request failed, for people. When the device has closed the connection, the crate gives the error of whatever
/// system call has failed last; one that is no error of a connection means that.
fn why_lost(error: &tokio_modbus::Error) -> String {
    let others = [Errno::INPROGRESS, Errno::AGAIN, Errno::INTR, Errno::NOENT, Errno::INVAL];
    let is_other = |code| code == 0 || others.iter().any(|other| other.raw_os_error() == code);
    match error {
        tokio_modbus::Error::Transport(transport)
            if transport.raw_os_error().is_some_and(is_other) =>
        {
            "it has closed the connection".into()
        }
        _ => error.to_string(),
    }
}

fn malformed() -> Failure {
    Failure::Lost("its answer does not fit the request".into())
}

async fn read(context: &mut Context, shared: &Shared, block: &Block) -> Result<(), Failure> {
    let &Block { unit, table, start, count, .. } = block;
    let request = match table {
        Table::Coil => Request::ReadCoils(start, count),
        Table::Discrete => Request::ReadDiscreteInputs(start, count),
        Table::Input => Request::ReadInputRegisters(start, count),
        Table::Holding => Request::ReadHoldingRegisters(start, count),
    };
    let registers: Vec<u16> = match ask(context, shared, unit, request).await? {
        Response::ReadCoils(bits) | Response::ReadDiscreteInputs(bits) => {
            // The bits that fill the last byte are not ours.
            let length = usize::from(count);
            if bits.len() != length && bits.len() != length.next_multiple_of(8) {
                return Err(malformed());
            }
            bits.into_iter().map(u16::from).collect()
        }
        Response::ReadInputRegisters(words) | Response::ReadHoldingRegisters(words)
            if words.len() == usize::from(count) =>
        {
            words
        }
        _ => return Err(malformed()),
    };
    let mut hub = shared.hub();
    for member in &block.members {
        if let Some(value) = block.value(member, &registers) {
            // A value that the variable can't have is no new value; the input becomes late.
            hub.set_input(member.index, value);
        }
    }
    Ok(())
}

async fn write(context: &mut Context, shared: &Shared, block: &Block) -> Result<(), Failure> {
    let mut registers = vec![0; usize::from(block.count)];
    {
        let hub = shared.hub();
        for member in &block.members {
            // Before the first tick nothing is written.
            let Some(value) = hub.value_outside(member.index) else { return Ok(()) };
            if !block.put(member, value, &mut registers) {
                let name = hub.point(member.index).map_or("", |point| point.symbol.name.as_str());
                let why = format!("{name} is {value}, which its registers can't hold");
                return Err(Failure::Refused(why));
            }
        }
    }
    let request = match block.table {
        Table::Coil => {
            let bits: Vec<bool> = registers.iter().map(|&bit| bit != 0).collect();
            Request::WriteMultipleCoils(block.start, bits.into())
        }
        _ => Request::WriteMultipleRegisters(block.start, registers.into()),
    };
    match ask(context, shared, block.unit, request).await? {
        Response::WriteMultipleCoils(start, count)
        | Response::WriteMultipleRegisters(start, count)
            if (start, count) == (block.start, block.count) =>
        {
            Ok(())
        }
        _ => Err(malformed()),
    }
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    #[test]
    fn a_closed_connection_is_told_as_that() {
        let lost = |code: Errno| {
            why_lost(&tokio_modbus::Error::Transport(io::Error::from_raw_os_error(
                code.raw_os_error(),
            )))
        };
        assert_eq!(lost(Errno::INPROGRESS), "it has closed the connection");
        assert!(lost(Errno::CONNRESET).contains("reset"));
    }
}
