//! Looks at a running control and acts on it, by the socket that `plcrt --socket` opens. It knows the
//! protocol (`docs/socket.md`) and nothing else of plcc.

mod args;
mod client;
mod show;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser};
use serde_json::{Value as Json, json};

use args::{Cli, Command};
use client::{Client, Error};

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
    if let Some(shell) = cli.completions {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut Cli::command(), "plcctl", &mut script);
        return print(&script);
    }
    if cli.man {
        let mut page = Vec::new();
        // The synopsis is that of --help: clap_mangen's own names options without their values.
        let mut command = Cli::command();
        let usage = command.render_usage().to_string();
        let command = command.override_usage(usage.trim_start_matches("Usage: ").to_owned());
        return match clap_mangen::Man::new(command).render(&mut page) {
            Ok(()) => print(&page),
            Err(error) => fail(USAGE, &error.to_string()),
        };
    }
    let (Some(socket), Some(command)) = (&cli.socket, &cli.command) else {
        return fail(USAGE, "a socket and a command are expected: plcctl SOCKET status");
    };
    let asked =
        Client::connect(socket, cli.timeout).and_then(|mut client| ask(&mut client, command));
    match asked {
        Ok(result) if cli.json => print(format!("{result}\n").as_bytes()),
        Ok(result) => print(show::result(command, &result).as_bytes()),
        Err(Error::Refused(error)) => {
            if cli.json {
                print(format!("{error}\n").as_bytes());
            } else {
                // What a refused online change would have done.
                print(show::changes(&error).as_bytes());
                let message = error.get("message").and_then(Json::as_str);
                fail(REFUSED, message.unwrap_or("the control refused the request"));
            }
            REFUSED
        }
        Err(Error::Unreachable(why)) => fail(USAGE, &why),
    }
}

/// Sends the request of a command; a list that comes in parts is put together.
fn ask(client: &mut Client, command: &Command) -> Result<Json, Error> {
    let mut request = command.request().map_err(Error::Unreachable)?;
    let mut result = client.ask(&request)?;
    while result.get("more") == Some(&Json::Bool(true)) {
        let variables = |result: &Json| result.get("variables").and_then(Json::as_array).cloned();
        let mut all = variables(&result).unwrap_or_default();
        let last = all.last().and_then(|last| last.get("name")).cloned();
        if let Some(map) = request.as_object_mut() {
            map.insert("after".into(), last.unwrap_or_default());
        }
        result = client.ask(&request)?;
        let next = variables(&result).unwrap_or_default();
        let more = result.get("more").cloned().filter(|_| !next.is_empty());
        all.extend(next);
        result = json!({"variables": all, "more": more.unwrap_or(Json::Bool(false))});
    }
    Ok(result)
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
