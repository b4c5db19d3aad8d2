//! `plcc monitor`: what a running or recorded program does, in a terminal or in browsers.

use std::fs;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};

use plcc_dap::LaunchArguments;
use plcc_files::why_not_read;
use plcc_monitor::view::TargetKind;
use plcc_monitor::{Rebuilder, Session, Target, state_folder, terminal};
use plcc_record::{RecordError, Recording};
use plcc_replay::ControlSocket;
use serde_json::json;

use crate::args::{MonitorArgs, RunCommand};
use crate::changed_number::RecordRebuilder;
use crate::debug_session::{attach, launch, run_command};
use crate::failure::{DONE, Failure};
use crate::report::Report;

pub(crate) fn monitor(args: &MonitorArgs, report: &Report) -> Result<u8, Failure> {
    #[cfg(feature = "web")]
    if let Some(address) = args.web {
        return serve(args, address, report);
    }
    #[cfg(not(feature = "web"))]
    let _ = report;
    // Before anything is opened, since that may take a while.
    terminal::check().map_err(|error| Failure::usage(error.to_string()))?;
    let mut session = Session::open(target(args)?);
    let shown = terminal::run(&mut session);
    shown.map_err(|error| Failure::usage(error.to_string()))?;
    Ok(DONE)
}

/// Serves browsers until the process is ended.
#[cfg(feature = "web")]
fn serve(
    args: &MonitorArgs,
    address: std::net::SocketAddr,
    report: &Report,
) -> Result<u8, Failure> {
    use std::io::Write;

    let mut session = Session::open(target(args)?);
    let announce = |url: &str| {
        // Without standard error nobody asks for another address.
        let _ = writeln!(std::io::stderr(), "for a further browser: {url}");
    };
    let server = plcc_monitor::web::Server::start(address, announce);
    let server = server.map_err(|error| Failure::usage(error.to_string()))?;
    report.message(&format!("the monitor is at {}", server.first_url()));
    report.message("Ctrl-C ends it");
    if let Some(warning) = server.warning() {
        report.warn(&warning);
    }
    server.run(&mut session, || true);
    Ok(DONE)
}

/// What the arguments name: a control's socket, a recording, or a program.
fn target(args: &MonitorArgs) -> Result<Target<'static>, Failure> {
    let path = &args.target;
    let metadata = fs::metadata(path).map_err(|error| Failure::file(path, why_not_read(&error)))?;
    let mut rebuilder: Option<Box<dyn Rebuilder>> = None;
    let (kind, run, socket) = if metadata.file_type().is_socket() {
        let attach = |record: &Path| attach(&command(args, true)?, record, true);
        let (record, run) = match &args.record {
            Some(record) => (Some(record.clone()), Some(attach(record)?)),
            None => {
                // Of a record that can't be shown, since it holds no sources for example, the present values remain.
                let own = own_record(&ControlSocket::new(path));
                let run = own.as_deref().and_then(|record| attach(record).ok());
                (own.filter(|_| run.is_some()), run)
            }
        };
        if let Some(record) = record {
            rebuilder = Some(Box::new(RecordRebuilder::new(&record)));
        }
        (TargetKind::Control, run, Some(path.clone()))
    } else if is_recording(path)? {
        (TargetKind::Recording, Some(attach(&command(args, true)?, path, false)?), None)
    } else {
        (TargetKind::Program, Some(launch(&command(args, false)?)?), None)
    };
    if socket.is_none() && args.record.is_some() {
        return Err(Failure::usage("--record names the record of a control: name its socket too"));
    }
    Ok(Target {
        kind,
        name: path.display().to_string(),
        run,
        socket,
        state_folder: state_folder(),
        speed: args.speed,
        operator: args.operator,
        rebuilder,
    })
}

/// The file in which a control is being recorded, as it says itself, if that can be read here.
pub(crate) fn own_record(control: &ControlSocket) -> Option<PathBuf> {
    readable(control.status().ok()?.record)
}

/// The record that a control names in its status, if it can be read here.
pub(crate) fn readable(record: Option<String>) -> Option<PathBuf> {
    let record = PathBuf::from(record?);
    fs::File::open(&record).is_ok().then_some(record)
}

/// Whether a file is a record.
pub(crate) fn is_recording(path: &Path) -> Result<bool, Failure> {
    match Recording::open(path) {
        Ok(_) => Ok(true),
        Err(RecordError::NoRecord(_)) => Ok(false),
        Err(error) => Err(Failure::usage(error.to_string())),
    }
}

/// The command line of `plcc run` that means the same.
fn command(args: &MonitorArgs, is_record: bool) -> Result<RunCommand, Failure> {
    let mut program: Vec<String> = vec![];
    if !is_record {
        program.push(args.target.display().to_string());
    }
    program.extend(args.program.iter().map(|path| path.display().to_string()));
    let path =
        |path: &Option<std::path::PathBuf>| path.as_ref().map(|path| path.display().to_string());
    let arguments = json!({
        "program": program,
        "recording": is_record.then_some(""),
        "stimulus": path(&args.stimulus),
        "machine": path(&args.machine),
        "ticks": args.ticks,
        "args": args.run_options,
    });
    let arguments: LaunchArguments =
        serde_json::from_value(arguments).map_err(|error| Failure::usage(error.to_string()))?;
    run_command(&arguments).map_err(Failure::usage)
}
