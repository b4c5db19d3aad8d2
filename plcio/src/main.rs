//! Drivers for the inputs and outputs of controls: connects the image file of a control (`plcrt --image`)
//! with remote I/O, panels and supervisory systems, as the entries `[[io]]` of its configuration say.
//! `docs/wiring.md` is the guide for users.
//!
//! | file | holds |
//! | --- | --- |
//! | `settings.rs` | what the configuration says |
//! | `session.rs` | the work for one image file, from its beginning to its end |
//! | `hub.rs` | the values of all points, between the drivers and the image file |
//! | `events.rs` | the log |
//! | `modbus/` | Modbus: clients, which ask devices, and the server, which others ask |

mod events;
mod hub;
mod modbus;
mod session;
mod settings;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;
use tokio::signal::unix::{SignalKind, signal};

use events::Events;
use settings::Settings;

/// Connects the inputs and outputs of a control with Modbus devices and supervisory systems.
///
/// The entries `[[io]]` of the control's configuration say which variable belongs to which point. The
/// control must run with an image file. plcio is_reported for it, and may be started and ended at any time.
#[derive(Parser)]
#[command(
    name = "plcio",
    version,
    after_help = "Exit status: 0 ended by a signal; 2 the configuration can't be used.\n\n\
                  Example:\n  plcio /etc/plcrt/lathe.toml"
)]
struct Cli {
    /// The configuration of the control
    #[arg(value_name = "FILE.toml")]
    config: PathBuf,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let settings = match Settings::open(&cli.config) {
        Ok(settings) => settings,
        Err(message) => {
            eprintln!("error: {}", plcc_abi::printable(&message));
            return ExitCode::from(2);
        }
    };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    match runtime {
        Ok(runtime) => runtime.block_on(run(settings)),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Serves the image file of the control, and the next one when the control has made another, until a
/// signal comes.
async fn run(settings: Settings) -> ExitCode {
    let events = match Events::open(settings.log.as_deref()) {
        Ok(events) => events,
        Err(message) => {
            eprintln!("error: {message}");
            return ExitCode::from(2);
        }
    };
    let signals = (signal(SignalKind::terminate()), signal(SignalKind::interrupt()));
    let (Ok(mut terminate), Ok(mut interrupt)) = signals else { return ExitCode::from(2) };
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let work = tokio::spawn(async move {
        // Whether the event `waiting` has been written since the last session.
        let mut is_reported = false;
        while !*stopped.borrow() {
            match session::Session::open(&settings, &events) {
                Ok(session) => {
                    is_reported = false;
                    session.run(stopped.clone()).await;
                }
                Err(why) if !is_reported => {
                    events.write("waiting", &[("why", why.into())]);
                    is_reported = true;
                }
                Err(_) => {}
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    });
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
    }
    let _ = stop.send(true);
    // Outputs are made safe before the end, as far as the devices answer in time.
    let _ = tokio::time::timeout(Duration::from_secs(3), work).await;
    ExitCode::SUCCESS
}
