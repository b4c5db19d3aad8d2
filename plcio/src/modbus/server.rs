//! The Modbus server. Clients, such as supervisory systems, read all points of the driver `modbus-server`, and write
//! those that are given from outside.

use std::collections::HashMap;
use std::future::{Ready, ready};
use std::net::SocketAddr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use plcc_configuration::drivers::modbus::{Format, ModbusAddress, Table};
use tokio::net::{TcpListener, TcpStream};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::Server;
use tokio_modbus::{ExceptionCode, Request, Response};

use super::client_events::ClientEvents;
use super::connection::{Client, Connection};
use super::registers::{decode, encode, nearest};
use super::unfit::Unfit;
use crate::driver::{Driver, Making, Stages, Start, has_left};
use crate::session::Shared;

/// The most connections at once.
const CONNECTIONS: usize = 16;

/// The points at each number of each table: a point's index in the hub, its format, and which of the point's
/// registers (from 0) this number is.
type Places = HashMap<(Table, u16), Vec<(usize, Format, usize)>>;

/// The driver.
struct ModbusServer;

/// Makes the driver.
pub(crate) fn driver(_: &Making<'_>) -> Box<dyn Driver> {
    Box::new(ModbusServer)
}

impl Driver for ModbusServer {
    fn start(&mut self, session: &mut Start<'_>) {
        let points = session.points.to_vec();
        session.show(run(session.shared.clone(), points, session.stages.clone()));
    }
}

/// Answers the requests of one connection.
struct Answers {
    shared: Shared,
    places: Arc<Places>,
    connections: Arc<AtomicUsize>,
    client_events: Arc<ClientEvents>,
    /// The points whose values their registers can't hold, so that clients read the nearest ones.
    unfit: Arc<Mutex<Unfit>>,
    address: SocketAddr,
    client: Arc<Client>,
}

impl Drop for Answers {
    fn drop(&mut self) {
        self.connections.fetch_sub(1, Ordering::Relaxed);
        self.client_events.write("client_left", self.address, self.client.why());
    }
}

/// Serves until the session ends.
async fn run(shared: Shared, points: Vec<usize>, mut stages: Stages) {
    let Some(address) = shared.settings.drivers.modbus.server.clone() else {
        let why = "[plcio] has no key `modbus-server`, which says where it listens";
        shared.events.write("server_off", &[("why", why.into())]);
        return;
    };
    let mut places = Places::new();
    {
        let hub = shared.hub();
        for index in points {
            let point = hub.point(index);
            let Some(at) = point.and_then(|point| point.address::<ModbusAddress>()) else {
                continue;
            };
            for register in 0..at.format.registers() {
                let place =
                    places.entry((at.table, at.number.saturating_add(register))).or_default();
                place.push((index, at.format, register.into()));
            }
        }
    }
    let places = Arc::new(places);
    let connections = Arc::new(AtomicUsize::new(0));
    let client_events = Arc::new(ClientEvents::new(shared.events.clone()));
    let unfit = Arc::new(Mutex::new(Unfit::default()));
    let mut reported = String::new();
    loop {
        let why = match TcpListener::bind(&address).await {
            Ok(listener) => {
                shared.events.write("server_on", &[("address", address.as_str().into())]);
                let server = Server::new(listener);
                let on_connected = |stream: TcpStream, address: SocketAddr| {
                    let (shared, places) = (shared.clone(), Arc::clone(&places));
                    let connections = Arc::clone(&connections);
                    let (client_events, unfit) = (Arc::clone(&client_events), Arc::clone(&unfit));
                    async move {
                        if connections.load(Ordering::Relaxed) >= CONNECTIONS {
                            let why = "there are as many clients as can be served";
                            client_events.write("client_refused", address, Some(why));
                            return Ok(None);
                        }
                        connections.fetch_add(1, Ordering::Relaxed);
                        client_events.write("client_connected", address, None);
                        let _ = stream.set_nodelay(true);
                        let client = Arc::new(Client::new());
                        let idle = shared.settings.drivers.modbus.idle;
                        let stream = Connection::new(stream, idle, Arc::clone(&client));
                        let answers = Answers {
                            shared,
                            places,
                            connections,
                            client_events,
                            unfit,
                            address,
                            client,
                        };
                        Ok(Some((answers, stream)))
                    }
                };
                tokio::select! {
                    // That a client has left is said when its `Answers` are dropped.
                    result = server.serve(&on_connected, |_| {}) => {
                        result.map_or_else(|error| error.to_string(), |()| String::new())
                    }
                    () = has_left(&mut stages) => {
                        let why = "no control is served any more";
                        shared.events.write("server_off", &[("why", why.into())]);
                        return;
                    }
                }
            }
            Err(error) => error.to_string(),
        };
        if reported != why {
            shared.events.write("server_off", &[("why", why.as_str().into())]);
            reported = why;
        }
        tokio::select! {
            () = tokio::time::sleep(Duration::from_secs(1)) => {}
            () = has_left(&mut stages) => return,
        }
    }
}

/// The `count` numbers of a table from `start` on.
///
/// # Errors
/// When the last one would be above 65535.
fn numbers(start: u16, count: usize) -> Result<impl Iterator<Item = u16>, ExceptionCode> {
    let numbers = start..=u16::MAX;
    match count <= numbers.len() {
        true => Ok(numbers.take(count)),
        false => Err(ExceptionCode::IllegalDataAddress),
    }
}

impl Answers {
    /// The registers, or bits, of a table from a number on.
    fn read(&self, table: Table, start: u16, count: u16) -> Result<Vec<u16>, ExceptionCode> {
        let (hub, events) = (self.shared.hub(), &self.shared.events);
        let register = |number: u16| {
            let members =
                self.places.get(&(table, number)).ok_or(ExceptionCode::IllegalDataAddress)?;
            let mut word = 0;
            for &(index, format, part) in members {
                let value = hub.value_outside(index).ok_or(ExceptionCode::ServerDeviceBusy)?;
                let mut registers = [0; 4];
                let fits = encode(format, value, &mut registers);
                let instead = nearest(format, value);
                if !fits {
                    encode(format, instead, &mut registers);
                }
                if self.unfit.lock().unwrap_or_else(PoisonError::into_inner).note(index, fits) {
                    let name = hub.point(index).map_or("", |point| point.symbol.name.as_str());
                    let why = format!("{value} does not fit its registers; clients read {instead}");
                    let about = [
                        ("device", "modbus-server".into()),
                        ("name", name.into()),
                        ("why", why.into()),
                    ];
                    match fits {
                        true => events.write("accepted", about.get(..2).unwrap_or_default()),
                        false => events.write("refused", &about),
                    }
                }
                word |= registers.get(part).copied().unwrap_or(0);
            }
            Ok(word)
        };
        numbers(start, count.into())?.map(register).collect()
    }

    /// Takes values for a table from a number on: all of them or none.
    fn write(&self, table: Table, start: u16, values: &[u16]) -> Result<(), ExceptionCode> {
        let mut hub = self.shared.hub();
        let mut given = vec![];
        for (number, at) in numbers(start, values.len())?.zip(0..) {
            let members =
                self.places.get(&(table, number)).ok_or(ExceptionCode::IllegalDataAddress)?;
            for &(index, format, part) in members {
                let point = hub.point(index).ok_or(ExceptionCode::IllegalDataAddress)?;
                if !point.is_input {
                    return Err(ExceptionCode::IllegalDataAddress);
                }
                // The further registers of a value are written with the first one.
                if part > 0 && at > 0 {
                    continue;
                }
                let registers = values.get(at..).filter(|_| part == 0);
                let value = registers.and_then(|registers| decode(format, registers));
                let value = value.ok_or(ExceptionCode::IllegalDataAddress)?;
                if point.inside(value).is_none() {
                    return Err(ExceptionCode::IllegalDataValue);
                }
                given.push((index, value));
            }
        }
        for (index, value) in given {
            hub.set_input(index, value);
        }
        hub.publish();
        Ok(())
    }

    fn answer(&self, request: &Request<'_>) -> Result<Response, ExceptionCode> {
        let bits = |table, start, count| {
            let words = self.read(table, start, count)?;
            Ok(words.into_iter().map(|word| word != 0).collect::<Vec<bool>>())
        };
        Ok(match *request {
            Request::ReadCoils(start, count) => {
                Response::ReadCoils(bits(Table::Coil, start, count)?)
            }
            Request::ReadDiscreteInputs(start, count) => {
                Response::ReadDiscreteInputs(bits(Table::Discrete, start, count)?)
            }
            Request::ReadInputRegisters(start, count) => {
                Response::ReadInputRegisters(self.read(Table::Input, start, count)?)
            }
            Request::ReadHoldingRegisters(start, count) => {
                Response::ReadHoldingRegisters(self.read(Table::Holding, start, count)?)
            }
            Request::WriteSingleCoil(number, bit) => {
                self.write(Table::Coil, number, &[bit.into()])?;
                Response::WriteSingleCoil(number, bit)
            }
            Request::WriteSingleRegister(number, word) => {
                self.write(Table::Holding, number, &[word])?;
                Response::WriteSingleRegister(number, word)
            }
            Request::WriteMultipleCoils(start, ref bits) => {
                let words: Vec<u16> = bits.iter().map(|&bit| bit.into()).collect();
                self.write(Table::Coil, start, &words)?;
                Response::WriteMultipleCoils(start, bits.len() as u16)
            }
            Request::WriteMultipleRegisters(start, ref words) => {
                self.write(Table::Holding, start, words)?;
                Response::WriteMultipleRegisters(start, words.len() as u16)
            }
            _ => return Err(ExceptionCode::IllegalFunction),
        })
    }
}

impl Service for Answers {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Response, ExceptionCode>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        self.client.asks();
        self.shared.refresh();
        ready(self.answer(&request))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn numbers_go_up_to_the_last_one_of_a_table() {
        let found = |start, count| numbers(start, count).map(Iterator::collect::<Vec<u16>>);
        assert_eq!(found(7, 2).unwrap(), [7, 8]);
        assert_eq!(found(u16::MAX, 1).unwrap(), [u16::MAX]);
        assert_eq!(found(u16::MAX, 2), Err(ExceptionCode::IllegalDataAddress));
        assert_eq!(found(0, 65_536).unwrap().len(), 65_536);
        assert_eq!(found(1, 65_536), Err(ExceptionCode::IllegalDataAddress));
    }
}
