//! Drivers for the inputs and outputs of controls: connects the image file of a control (`plcrt --image`)
//! with remote I/O, panels and supervisory systems, as the entries `[[io]]` of its configuration say.
//! `docs/wiring.md` is the guide for users.
//!
//! | file | holds |
//! | --- | --- |
//! | `settings.rs` | what the configuration says |
//! | `driver.rs` | what a driver is to a session |
//! | `drivers.rs` | the list of all drivers |
//! | `reconnection.rs` | connections that are made again, and what is reported of it |
//! | `session.rs` | the work for one image file, from its beginning to its end |
//! | `hub.rs` | the values of all points, between the drivers and the image file |
//! | `events.rs` | the log |
//! | `ethercat/` | terminals of an EtherCAT segment (feature `ethercat`) |
//! | `gpio/` | lines of Linux's GPIO character device (feature `gpio`) |
//! | `hal/` | the component of LinuxCNC's hardware abstraction layer |
//! | `input_file.rs` | texts that are read |
//! | `modbus/` | Modbus: clients, which ask devices, and the server, which others ask |
//! | `mqtt/` | the publisher for MQTT with Sparkplug B (feature `mqtt`) |
//! | `opcua/` | the server for OPC UA (feature `opcua`) |
//! | `plant/` | values, events and records for other computers of a plant, by zenoh (feature `zenoh`) |

mod driver;
mod drivers;
#[cfg(feature = "ethercat")]
mod ethercat;
mod events;
#[cfg(feature = "gpio")]
mod gpio;
mod hal;
mod hub;
#[cfg(any(feature = "mqtt", feature = "opcua"))]
mod input_file;
mod modbus;
#[cfg(feature = "mqtt")]
mod mqtt;
#[cfg(feature = "opcua")]
mod opcua;
#[cfg(feature = "zenoh")]
mod plant;
mod reconnection;
mod session;
mod settings;

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::{CommandFactory, Parser};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::Notify;

use drivers::Drivers;
use events::Events;
use session::{Remains, Session};
use settings::Settings;

/// Connects the inputs and outputs of a control with Modbus devices, supervisory systems, LinuxCNC, EtherCAT terminals and GPIO lines.
///
/// The entries `[[io]]` of the control's configuration say which variable belongs to which point. The
/// control must run with an image file. plcio waits for it, and may be started and ended at any time.
#[derive(Parser)]
#[command(
    name = "plcio",
    version,
    after_help = "Exit status: 0 ended by a signal; 2 the configuration can't be used.\n\n\
                  Example:\n  plcio /etc/plcrt/lathe.toml"
)]
struct Cli {
    /// The configuration of the control
    #[arg(value_name = "FILE.toml", required_unless_present_any = ["check_config", "drivers", "completions", "man"])]
    config: Option<PathBuf>,

    /// Finds the mistakes of a configuration, and connects nothing; those that only the program shows are found by
    /// plcrt --check-config
    #[arg(long, value_name = "FILE.toml", exclusive = true)]
    check_config: Option<PathBuf>,

    /// Prints the names of the drivers that this plcio was built with, and connects nothing
    #[arg(long, exclusive = true)]
    drivers: bool,

    /// Prints completions for a shell, and connects nothing
    #[arg(long, value_name = "SHELL", exclusive = true)]
    completions: Option<clap_complete::Shell>,

    /// Prints the manual page, and connects nothing
    #[arg(long, exclusive = true)]
    man: bool,
}

/// What the manual page says besides the options.
const MANUAL: &str = "\
The configuration is the one that plcrt reads with --config. plcio uses its key image, its entries [[io]], and \
the table [plcio], whose keys are these.\n\n\
poll_ms: from one poll of a device to the next (20).\n\n\
answer_ms: how long a device has for its answer (500).\n\n\
silence_ms: a control that ends no tick for so long counts as dead (1000).\n\n\
modbus-server: where the Modbus server listens, as in 0.0.0.0:502.\n\n\
idle_ms: a client of the Modbus server that asks nothing for so long is disconnected (60000).\n\n\
opcua-server, opcua-users, opcua-certificates, opcua-anonymous: the server for OPC UA.\n\n\
mqtt-broker, mqtt-ca, mqtt-group, mqtt-node, mqtt-user, mqtt-password: the publisher for MQTT.\n\n\
zenoh-connect, zenoh-listen, zenoh-prefix, zenoh-name, zenoh-history: zenoh.\n\n\
hal-component, hal-python: the component of LinuxCNC's HAL.\n\n\
ethercat-terminals: the names of all EtherCAT terminals in their order, a list; others are refused.\n\n\
device: tables [[plcio.device]] with address, unit, poll_ms, answer_ms and write, for Modbus devices that are asked in another manner.\n\n\
log: the file to which events are appended, a line of JSON each.\n\n\
OPC UA, MQTT, zenoh, EtherCAT and GPIO are there only if plcio was built with them (features opcua, mqtt, zenoh, ethercat and gpio); plcio --drivers names \
all that are there. \
plcrt --check-config FILE.toml finds all mistakes, plcio --check-config FILE.toml those for which the program is not needed. docs/wiring.md has the guide for each driver.\n\n\
When plcio is ended by SIGTERM or Ctrl-C, it makes the outputs on all devices safe first.";

/// Prints the names of the drivers, completions or the manual page.
fn page(cli: &Cli) -> Result<(), String> {
    let mut page = Vec::new();
    match cli.completions {
        None if cli.drivers => page = drivers::names().into_bytes(),
        Some(shell) => clap_complete::generate(shell, &mut Cli::command(), "plcio", &mut page),
        None => {
            // The synopsis is that of --help: clap_mangen's own names options without their values.
            let mut command = Cli::command();
            let usage = command.render_usage().to_string();
            let usage = usage.trim_start_matches("Usage: ").to_owned();
            let more = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let command = command.override_usage(usage).after_help(format!("{MANUAL}\n\n{more}"));
            let rendered = clap_mangen::Man::new(command).render(&mut page);
            rendered.map_err(|error| error.to_string())?;
        }
    }
    std::io::stdout().write_all(&page).map_err(|error| error.to_string())
}

/// Tells people of an error on standard error. If that fails, nothing is said, since there is nowhere else to say it.
fn say_error(error: impl Display) {
    let _ = writeln!(std::io::stderr(), "error: {}", plcc_abi::printable(&error.to_string()));
}

/// Checks a configuration, and says what is wrong.
fn check(path: &Path) -> ExitCode {
    match settings::check(path) {
        Ok(warnings) => {
            for warning in warnings {
                let text = warning.of(path);
                let _ = writeln!(std::io::stderr(), "warning: {}", plcc_abi::printable(&text));
            }
            ExitCode::SUCCESS
        }
        Err(message) => {
            say_error(message);
            ExitCode::from(2)
        }
    }
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Some(path) = &cli.check_config {
        return check(path);
    }
    let Some(config) = &cli.config else {
        return match page(&cli) {
            Ok(()) => ExitCode::SUCCESS,
            Err(message) => {
                say_error(message);
                ExitCode::from(2)
            }
        };
    };
    let settings = match Settings::open(config) {
        Ok(settings) => settings,
        Err(message) => {
            say_error(message);
            return ExitCode::from(2);
        }
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    match runtime {
        Ok(runtime) => {
            let status = runtime.block_on(run(Arc::new(settings)));
            // A device whose driver in the kernel hangs may keep a thread for ever.
            runtime.shutdown_background();
            status
        }
        Err(error) => {
            say_error(error);
            ExitCode::from(2)
        }
    }
}

/// Serves the image file of the control, and the next one when the control has made another, until a
/// signal comes.
async fn run(settings: Arc<Settings>) -> ExitCode {
    let events = match Events::open(settings.log.as_deref()) {
        Ok(events) => events,
        Err(message) => {
            say_error(message);
            return ExitCode::from(2);
        }
    };
    let signals = (signal(SignalKind::terminate()), signal(SignalKind::interrupt()));
    let (Ok(mut terminate), Ok(mut interrupt)) = signals else { return ExitCode::from(2) };
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let unloaded = Arc::new(Notify::new());
    let mut drivers = Drivers::new(&settings, &events, &unloaded);
    let work = tokio::spawn(async move {
        // Whether the event `waiting` has been written since the last session.
        let mut is_reported = false;
        // What still writes the safe outputs of the last control.
        let mut remains: Option<Remains> = None;
        while !*stopped.borrow() {
            match Session::open(&settings, &events) {
                Ok(session) => {
                    is_reported = false;
                    if let Some(remains) = remains.take() {
                        remains.end().await;
                    }
                    remains = session.run(stopped.clone(), &mut drivers).await;
                }
                Err(why) if !is_reported => {
                    events.write("waiting", &[("why", why.into())]);
                    is_reported = true;
                }
                Err(_) => {}
            }
            match &remains {
                Some(remains) => remains.refresh(),
                None => remains = Session::left(&settings, &events, &mut drivers),
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        if let Some(remains) = remains {
            remains.end().await;
        }
        drivers.end().await;
    });
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
        // As other components do, it ends when HAL unloads it.
        () = unloaded.notified() => {}
    }
    let _ = stop.send(true);
    // Outputs are made safe before the end, as far as the devices answer in time.
    let _ = tokio::time::timeout(Duration::from_secs(3), work).await;
    ExitCode::SUCCESS
}
