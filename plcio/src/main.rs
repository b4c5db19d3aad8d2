//! Drivers for the inputs and outputs of controls: connects the image file of a control (`plcrt run --image`)
//! with remote I/O, panels and supervisory systems, as the entries `[[io]]` of its configuration say.
//! `docs/wiring.md` is the guide for users.
//!
//! | file | holds |
//! | --- | --- |
//! | `settings.rs` | what the configuration says |
//! | `checkout.rs` | the wires, gone through with two people |
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

mod checkout;
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

use std::ffi::OsString;
use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::{Args, CommandFactory, Parser, Subcommand};
use plcc_pages::Shell;
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
    long_version = drivers::long_version(),
    after_help = "Exit status: 0 ended by a signal, or the configuration has no mistakes; 2 the configuration can't be used.\n\n\
                  Examples:\n  plcio run /etc/plcrt/lathe.toml\n  plcio check-config /etc/plcrt/lathe.toml\n  plcio checkout /etc/plcrt/lathe.toml\n\n\
                  `plcio FILE.toml` is short for `plcio run FILE.toml`."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Connects the points, until a signal ends it
    Run(RunCommand),

    /// Finds the mistakes of a configuration, and connects nothing; those that only the program shows are found by
    /// plcrt check-config
    CheckConfig {
        /// The configuration of the control
        #[arg(value_name = "FILE.toml")]
        config: PathBuf,
    },

    /// Goes through the wires with two people: each input is switched, each output driven after a question, and a protocol says
    /// what was seen. The control runs, with plcio run beside it and --allow force
    Checkout {
        /// The configuration of the control
        #[arg(value_name = "FILE.toml")]
        config: PathBuf,

        /// The protocol [default: FILE.checkout-TIME.csv]
        #[arg(long, value_name = "OUT.csv")]
        protocol: Option<PathBuf>,
    },

    /// Prints the names of the drivers that this plcio was built with
    Drivers,

    /// Prints the manual page, or writes the pages of all commands
    Man {
        /// The folder that gets a page for each command, plcio.1, plcio-run.1…
        #[arg(long, value_name = "DIR")]
        dir: Option<PathBuf>,
    },

    /// Prints completions for a shell
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// What `run` takes: the configuration, and the earlier spellings of the other commands.
#[derive(Args)]
struct RunCommand {
    /// The configuration of the control
    #[arg(value_name = "FILE.toml", required_unless_present_any = ["check_config", "checkout", "drivers", "completions", "man"])]
    config: Option<PathBuf>,

    #[arg(long, value_name = "FILE.toml", exclusive = true, hide = true)]
    check_config: Option<PathBuf>,

    /// Goes through the wires with two people, as the command checkout
    #[arg(long, value_name = "FILE.toml", exclusive = true)]
    checkout: Option<PathBuf>,

    #[arg(long, exclusive = true, hide = true)]
    drivers: bool,

    #[arg(long, value_name = "SHELL", exclusive = true, hide = true)]
    completions: Option<Shell>,

    #[arg(long, exclusive = true, hide = true)]
    man: bool,
}

impl Command {
    /// The command that an earlier spelling means.
    fn of_today(self) -> Self {
        match self {
            Self::Run(RunCommand { check_config: Some(config), .. }) => {
                Self::CheckConfig { config }
            }
            Self::Run(RunCommand { checkout: Some(config), .. }) => {
                Self::Checkout { config, protocol: None }
            }
            Self::Run(RunCommand { drivers: true, .. }) => Self::Drivers,
            Self::Run(RunCommand { completions: Some(shell), .. }) => Self::Completions { shell },
            Self::Run(RunCommand { man: true, .. }) => Self::Man { dir: None },
            command => command,
        }
    }
}

/// The words of the command line; `run` is put before those that begin with no command.
fn words() -> Vec<OsString> {
    let mut words: Vec<OsString> = std::env::args_os().collect();
    let of_plcio = |word: &OsString| {
        let cli = Cli::command();
        let is_command = cli.get_subcommands().any(|command| word == command.get_name());
        is_command || ["help", "--help", "-h", "--version", "-V"].iter().any(|known| word == known)
    };
    if words.get(1).is_some_and(|word| !of_plcio(word)) {
        words.insert(1, "run".into());
    }
    words
}

/// What the manual page says in addition to the options.
const MANUAL: &str = "\
The configuration is that of plcrt. plcio uses its key image, its entries [[io]], and \
the table [plcio], whose keys are these.\n\n\
poll: from one poll of a device to the next (20ms). Times have their units: ms, s, min, h.\n\n\
answer: how long a device has for its answer (500ms).\n\n\
silence: a control that ends no tick for this time counts as dead (1s).\n\n\
modbus-server: where the Modbus server listens, as in 0.0.0.0:502.\n\n\
idle: a client of the Modbus server that asks nothing for this time is disconnected (60s).\n\n\
opcua-server, opcua-users, opcua-certificates, opcua-anonymous: the server for OPC UA.\n\n\
mqtt-broker, mqtt-ca, mqtt-group, mqtt-node, mqtt-user, mqtt-password: the publisher for MQTT.\n\n\
zenoh-connect, zenoh-listen, zenoh-prefix, zenoh-name: zenoh.\n\n\
hal-component, hal-python: the component of LinuxCNC's HAL.\n\n\
ethercat-terminals: the names of all EtherCAT terminals in their order, a list; others are refused.\n\n\
device: tables [[plcio.device]] with address, unit, poll, answer and write, for Modbus devices that need other settings.\n\n\
log: the file to which events are appended, a line of JSON each.\n\n\
OPC UA, MQTT, zenoh, EtherCAT and GPIO are there only if plcio was built with them (features opcua, mqtt, zenoh, ethercat and gpio); plcio drivers names \
all that are there. \
plcrt check-config FILE.toml finds all mistakes, plcio check-config FILE.toml those for which the program is not needed. docs/wiring.md has the guide for each driver.\n\n\
When plcio is ended by SIGTERM or Ctrl-C, it makes the outputs on all devices safe first.";

/// Prints the manual page, or writes the pages of all commands into a folder.
fn manual(folder: Option<&Path>) -> Result<(), String> {
    let cli = Cli::command();
    let more = cli.get_after_help().map(ToString::to_string).unwrap_or_default();
    let pages = plcc_pages::manuals(cli.after_help(format!("{MANUAL}\n\n{more}")));
    let pages = pages.map_err(|error| error.to_string())?;
    match folder {
        None => print(pages.first().map_or(&[][..], |(_, page)| page)),
        Some(folder) => plcc_pages::write(folder, &pages)
            .map_err(|error| format!("{}: the pages can't be written: {error}", folder.display())),
    }
}

/// Writes to standard output. That its reader has closed it (`plcio man | head`) is not an error.
fn print(page: &[u8]) -> Result<(), String> {
    let mut out = std::io::stdout().lock();
    match out.write_all(page).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(format!("standard output can't be written: {error}"))
        }
        _ => Ok(()),
    }
}

/// Tells people of an error on standard error. If that fails, nothing is said, since there is nowhere else to say it.
fn say_error(error: impl Display) {
    let _ = writeln!(std::io::stderr(), "error: {}", plcc_abi::printable(&error.to_string()));
}

/// Checks a configuration, and says what is wrong.
fn check(path: &Path) -> Result<(), String> {
    for warning in settings::check(path)? {
        let text = warning.of(path);
        let _ = writeln!(std::io::stderr(), "warning: {}", plcc_abi::printable(&text));
    }
    Ok(())
}

fn main() -> ExitCode {
    let done = match Cli::parse_from(words()).command.of_today() {
        Command::Run(args) => match Settings::open(&args.config.unwrap_or_default()) {
            Ok(settings) => return serve(settings),
            Err(message) => Err(message),
        },
        Command::CheckConfig { config } => check(&config),
        Command::Checkout { config, protocol } => checkout::checkout(&config, protocol),
        Command::Drivers => print(drivers::names().as_bytes()),
        Command::Man { dir } => manual(dir.as_deref()),
        Command::Completions { shell } => print(&plcc_pages::completions(Cli::command(), shell)),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            say_error(message);
            ExitCode::from(2)
        }
    }
}

/// Connects the points that the settings name, until a signal comes.
fn serve(settings: Settings) -> ExitCode {
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
