//! The connection with a device, or with all units of a serial line. It is made when something is to be asked.

use std::time::Duration;

use plcc_configuration::drivers::modbus::Medium;
use rustix::io::Errno;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_modbus::client::{Client, Context, rtu, tcp};
use tokio_modbus::slave::{Slave, SlaveContext};
use tokio_modbus::{ExceptionCode, Request, Response};
use tokio_serial::{ClearBuffer, SerialPort, SerialPortBuilderExt};

/// The shortest time that making a connection may take, also where answers have to come sooner.
const CONNECTING: Duration = Duration::from_millis(500);

/// Why a request failed.
pub(super) enum Failure {
    /// The device has answered that it can't do it. The connection is sound.
    Refused(ExceptionCode),
    /// The unit has given no answer, or one that can't be right. The connection is closed.
    Lost(String),
    /// There is no connection.
    Unreachable(String),
}

/// The connection.
pub(super) struct Link {
    medium: Medium,
    context: Option<Context>,
    /// Whether a request has been answered on this connection.
    has_answered: bool,
}

impl Link {
    /// No connection yet.
    pub(super) fn new(medium: Medium) -> Self {
        Self { medium, context: None, has_answered: false }
    }

    /// Sends a request and gives the answer, which has to come in the time `answer`. Where the connection has ended after an
    /// answer, as that of devices does which close it after each, another one is made at once.
    pub(super) async fn ask(
        &mut self,
        unit: u8,
        answer: Duration,
        request: &Request<'static>,
    ) -> Result<Response, Failure> {
        loop {
            let context = match &mut self.context {
                Some(context) => context,
                none => {
                    self.has_answered = false;
                    let connecting = timeout(answer.max(CONNECTING), connect(&self.medium)).await;
                    let connected = connecting.unwrap_or_else(|_| Err("it does not answer".into()));
                    none.insert(connected.map_err(Failure::Unreachable)?)
                }
            };
            context.set_slave(Slave(unit));
            let why = match timeout(answer, context.call(request.clone())).await {
                Ok(Ok(answered)) => {
                    self.has_answered = true;
                    return answered.map_err(Failure::Refused);
                }
                Ok(Err(error)) => {
                    let is_over = matches!(error, tokio_modbus::Error::Transport(_));
                    if is_over && self.has_answered {
                        self.close().await;
                        continue;
                    }
                    why_lost(&error)
                }
                Err(_) => "it does not answer".into(),
            };
            self.close().await;
            return Err(Failure::Lost(why));
        }
    }

    /// Closes the connection, if there is one.
    pub(super) async fn close(&mut self) {
        if let Some(mut context) = self.context.take() {
            let _ = timeout(Duration::from_millis(100), context.disconnect()).await;
        }
    }
}

async fn connect(medium: &Medium) -> Result<Context, String> {
    match medium {
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

/// Why a request failed, for people. When the device has closed the connection, the crate gives the error of whatever
/// system call has failed last; one that is not an error of a connection means that.
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

/// An exception for people, with the number by which a device's handbook has it.
pub(super) fn exception(code: ExceptionCode) -> String {
    match code {
        // The crate has no name for it.
        ExceptionCode::Custom(7) => "Negative acknowledge (exception 7)".into(),
        ExceptionCode::Custom(number) => format!("exception {number}"),
        known => format!("{known} (exception {})", u8::from(known)),
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

    #[test]
    fn an_exception_has_its_number() {
        let shown = |code| exception(ExceptionCode::new(code));
        assert_eq!(shown(2), "Illegal data address (exception 2)");
        assert_eq!(shown(7), "Negative acknowledge (exception 7)");
        assert_eq!(shown(0xE1), "exception 225");
    }
}
