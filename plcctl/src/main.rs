//! Looks at a running control and acts on it, by the socket that `plcrt run --socket` opens. It knows the
//! protocol (`docs/socket.md`, `plcc-protocol`) and nothing else of plcc.

mod args;
mod operator;
mod show;

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser};
use plcc_pages::Shell;
use plcc_protocol::{Client, ClientError, Comparison, Request, Variables};
use serde::Deserialize;
use serde_json::Value as Json;

use args::{Action, Cli, Command};
use operator::OperatorDisplay;

/// Exit status: the control refused the request.
const REFUSED: u8 = 1;
/// Exit status: wrong usage, or no control answers.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    ExitCode::from(match Cli::try_parse() {
        Ok(cli) => run(&cli),
        Err(error) => match unknown_command(&error) {
            Some(message) => fail(USAGE, &message),
            None => error.exit(),
        },
    })
}

/// What to say of a word that stands where a command is expected and is none; `None` for other mistakes.
fn unknown_command(error: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidArg) else { return None };
    let line = Cli::command();
    let names: Vec<&str> = line.get_subcommands().map(clap::Command::get_name).collect();
    let has_command = std::env::args().any(|arg| names.contains(&arg.as_str()));
    let is_command = error.kind() == ErrorKind::UnknownArgument && !word.starts_with('-');
    (is_command && !has_command)
        .then(|| format!("there is no command `{word}`; the commands are {}", names.join(", ")))
}

fn run(cli: &Cli) -> u8 {
    if cli.man {
        return manual(None);
    }
    if let Some(shell) = cli.completions {
        return completions(shell);
    }
    let (socket, command) = match (&cli.socket, &cli.action) {
        (Some(socket), Some(Action::Operator { kiosk })) => {
            return operator_screen(socket, *kiosk, cli);
        }
        (None, Some(Action::Man { dir })) => return manual(dir.as_deref()),
        (None, Some(Action::Completions { shell })) => return completions(*shell),
        (Some(socket), Some(Action::Ask(command))) => (socket, command),
        (Some(_), Some(_)) => {
            return fail(USAGE, "`man` and `completions` need no socket: plcctl man");
        }
        _ => return fail(USAGE, "a socket and a command are expected: plcctl SOCKET status"),
    };
    let timeout = cli.timeout.saturating_add(command.wait());
    let asked = Client::connect(socket, timeout).and_then(|mut client| ask(&mut client, command));
    match asked {
        Ok(result) if cli.json => print(format!("{result}\n").as_bytes()),
        Ok(result) => match show::result(command, &result) {
            Ok(text) => print(text.as_bytes()),
            Err(error) => fail(USAGE, &format!("the reply is of another version: {error}")),
        },
        Err(error) => failed(error, cli.json),
    }
}

/// Says why there is no result.
fn failed(error: ClientError, json: bool) -> u8 {
    match error {
        ClientError::Refused(failure) => {
            if json {
                print(format!("{}\n", show::json(&failure)).as_bytes());
            } else {
                // What a refused online change would have done.
                if let Ok(comparison) = Comparison::deserialize(Json::Object(failure.details)) {
                    print(show::changes(&comparison).as_bytes());
                }
                fail(REFUSED, &failure.message);
            }
            REFUSED
        }
        ClientError::Unreachable(why) => fail(USAGE, &why),
    }
}

/// Shows the operator's screen, or prints once what is on it.
fn operator_screen(socket: &Path, kiosk: bool, cli: &Cli) -> u8 {
    if cli.json {
        let asked = Client::connect(socket, cli.timeout)
            .and_then(|mut client| client.ask::<Json>(&Request::Operator {}));
        return match asked {
            Ok(result) => print(format!("{result}\n").as_bytes()),
            Err(error) => failed(error, true),
        };
    }
    if let Err(error) = plcc_screen::check() {
        return fail(USAGE, &error.to_string());
    }
    let mut display = match OperatorDisplay::open(socket, kiosk) {
        Ok(display) => display,
        Err(error) => return failed(error, false),
    };
    match plcc_screen::run(&mut display) {
        Ok(()) => 0,
        Err(error) => fail(USAGE, &error.to_string()),
    }
}

/// Prints the manual page, or writes the pages of all commands into a folder.
fn manual(folder: Option<&Path>) -> u8 {
    let pages = match plcc_pages::manuals(Cli::command()) {
        Ok(pages) => pages,
        Err(error) => return fail(USAGE, &error.to_string()),
    };
    let Some(folder) = folder else {
        return print(pages.first().map_or(&[][..], |(_, page)| page));
    };
    match plcc_pages::write(folder, &pages) {
        Ok(()) => 0,
        Err(error) => {
            fail(USAGE, &format!("{}: the pages can't be written: {error}", folder.display()))
        }
    }
}

/// Prints the completions for a shell.
fn completions(shell: Shell) -> u8 {
    print(&plcc_pages::completions(Cli::command(), shell))
}

/// Sends the request of a command; a list that comes in parts is put together.
fn ask(client: &mut Client, command: &Command) -> Result<Json, ClientError> {
    let request = command.request().map_err(ClientError::Unreachable)?;
    let Request::List { pattern, .. } = request else { return client.ask(&request) };
    let mut all = Variables { variables: vec![], more: true };
    while all.more {
        let after = all.variables.last().map(|last| last.name.clone());
        let request = Request::List { pattern: pattern.clone(), after };
        let next: Variables = client.ask(&request)?;
        all.more = next.more && !next.variables.is_empty();
        all.variables.extend(next.variables);
    }
    Ok(show::json(&all))
}

/// Writes to standard output. That its reader has closed it is not an error.
fn print(bytes: &[u8]) -> u8 {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            fail(USAGE, &format!("standard output can't be written: {error}"))
        }
        _ => 0,
    }
}

/// Says what went wrong.
fn fail(status: u8, message: &str) -> u8 {
    // Where standard error can't be written, the exit status still says it.
    let _ = writeln!(io::stderr(), "error: {}", show::harmless(message));
    status
}
