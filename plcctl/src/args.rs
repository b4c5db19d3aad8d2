//! The command line.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use plcc_pages::Shell;
use plcc_protocol::{Assignment, MAX_WAIT, Request};

/// Looks at a running control and acts on it.
///
/// The control is a `plcrt run --realtime --socket SOCKET`. Looking is always allowed; for the rest the
/// control must be started with --allow.
#[derive(Parser)]
#[command(
    name = "plcctl",
    version,
    after_help = "Exit status: 0 done; 1 the control refused it; 2 wrong usage, or no control \
                  answers at the socket.\n\n\
                  Examples:\n  \
                  plcctl /run/lathe.sock status\n  \
                  plcctl /run/lathe.sock get MCHON @FRO 'SP*'\n  \
                  plcctl /run/lathe.sock set @FRO=80\n  \
                  plcctl /run/lathe.sock force MCRDY=1\n  \
                  plcctl /run/lathe.sock swap lathe-2.plcx --dry-run\n  \
                  plcctl /run/mill.sock swap mill-2.plcx --wait 600\n  \
                  plcctl /run/lathe.sock rollback\n  \
                  plcctl /run/lathe.sock operator\n  \
                  plcctl completions bash > ~/.local/share/bash-completion/completions/plcctl"
)]
pub(crate) struct Cli {
    /// The socket of the control
    pub(crate) socket: Option<PathBuf>,

    /// What to do
    #[command(subcommand)]
    pub(crate) action: Option<Action>,

    /// Prints the reply as JSON
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// How many seconds to wait for the reply, beyond the time that an online change waits
    #[arg(long, global = true, value_name = "SECONDS", default_value = "30", value_parser = seconds)]
    pub(crate) timeout: Duration,

    /// The command `completions`.
    #[arg(long, value_name = "SHELL", exclusive = true, hide = true)]
    pub(crate) completions: Option<Shell>,

    /// The command `man`.
    #[arg(long, exclusive = true, hide = true)]
    pub(crate) man: bool,
}

/// What to do.
#[derive(Subcommand)]
pub(crate) enum Action {
    /// Asks the control.
    #[command(flatten)]
    Ask(Command),
    /// A screen for the operator: faults and messages, overrides, the keys and lamps that the program uses
    ///
    /// Arrow keys choose a key, Enter presses or releases it, if the control was started with --allow operate (or write).
    /// With --json it prints once what is on the screen.
    Operator {
        /// Stays until the process is ended: no key leaves the screen, and a control that is not there is waited for
        #[arg(long)]
        kiosk: bool,
    },
    /// Prints the manual page, or writes the pages of all commands; needs no socket
    Man {
        /// The folder that gets a page for each command, plcctl.1, plcctl-set.1…
        #[arg(long, value_name = "DIR")]
        dir: Option<PathBuf>,
    },
    /// Prints completions for a shell; needs no socket
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// What the control is asked.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Shows what the control is doing: its program, its state, the forces in effect
    Status,
    /// Shows how long ticks take and how late they begin
    Stat,
    /// Lists the program's variables
    List {
        /// Only names that match, such as 'SP*'
        pattern: Option<String>,
    },
    /// Shows values
    Get {
        /// Variables as in --watch of plcrt; a name with * or ? is a pattern
        #[arg(required = true)]
        names: Vec<String>,
    },
    /// Sets variables, as a stimulus does
    Set {
        /// Variables and their values
        #[arg(required = true, value_name = "NAME=VALUE", value_parser = assignment)]
        values: Vec<Assignment>,
    },
    /// Holds inputs at values that the program sees, and the lines of outputs at values
    Force {
        /// Inputs and outputs and their values
        #[arg(required = true, value_name = "NAME=VALUE", value_parser = assignment)]
        values: Vec<Assignment>,
    },
    /// Ends forces
    Unforce {
        /// Forced inputs and outputs
        #[arg(required_unless_present = "all")]
        names: Vec<String>,
        /// Ends all of them
        #[arg(long, conflicts_with = "names")]
        all: bool,
    },
    /// Online change: replaces the program by another version, between two ticks, and keeps its state
    Swap {
        /// The artifact of the new version
        artifact: PathBuf,
        /// Accepts changes that are refused otherwise, by their names; `all` accepts every one
        #[arg(long, value_name = "NAME,NAME…", value_delimiter = ',')]
        accept: Vec<String>,
        /// Only shows what would change
        #[arg(long)]
        dry_run: bool,
        #[command(flatten)]
        wait: Wait,
    },
    /// Takes the last online change back: the program before it runs again, with the present values
    Rollback {
        #[command(flatten)]
        wait: Wait,
    },
    /// Gives up an online change that waits
    Cancel,
    /// Goes on with the ticks of a program that was stopped
    Start,
    /// Stops the program, and gives outputs their safe values
    Stop,
}

/// How long an online change may wait.
#[derive(Args)]
pub(crate) struct Wait {
    /// How many seconds to wait at most for a motion program that runs and is another one in the new version; 0: not at all
    #[arg(long = "wait", value_name = "SECONDS", default_value = "20", value_parser = wait)]
    pub(crate) seconds: f64,
}

fn wait(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.0..=MAX_WAIT).contains(seconds));
    seconds.ok_or_else(|| format!("a number of seconds from 0 to {MAX_WAIT} is expected, as in 20"))
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "a number of seconds is expected, as in 30")?;
    let duration = Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero());
    duration.ok_or_else(|| "a number of seconds above 0 is expected, as in 30".into())
}

/// `NAME=VALUE`. Names hold no `=`.
fn assignment(text: &str) -> Result<Assignment, String> {
    let parts = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    let parts = parts.filter(|(name, value)| !name.is_empty() && !value.is_empty());
    let (name, value) = parts.ok_or("NAME=VALUE is expected, as in @FRO=80")?;
    Ok(Assignment::new(name, value))
}

impl Command {
    /// How long the control may take for it beyond the time that replies take.
    pub(crate) fn wait(&self) -> Duration {
        match self {
            Self::Swap { wait, dry_run: false, .. } | Self::Rollback { wait } => {
                Duration::from_secs_f64(wait.seconds)
            }
            _ => Duration::ZERO,
        }
    }

    /// The request that asks for it.
    ///
    /// # Errors
    /// When the artifact's path can't be told to the control.
    pub(crate) fn request(&self) -> Result<Request, String> {
        Ok(match self {
            Self::Status => Request::Status {},
            Self::Stat => Request::Stat {},
            Self::List { pattern } => Request::List { pattern: pattern.clone(), after: None },
            Self::Get { names } => Request::Get { names: names.clone() },
            Self::Set { values } => Request::Set { values: values.clone() },
            Self::Force { values } => Request::Force { values: values.clone() },
            Self::Unforce { names, all } => Request::Unforce { names: names.clone(), all: *all },
            Self::Swap { artifact, accept, dry_run, wait } => {
                // The control may run in another folder.
                let path = std::path::absolute(artifact).map_err(|error| error.to_string())?;
                path.to_str().ok_or("the artifact's name is not UTF-8")?;
                let wait = Some(wait.seconds);
                Request::Swap { path, accept: accept.clone(), dry_run: *dry_run, wait }
            }
            Self::Rollback { wait } => Request::Rollback { wait: Some(wait.seconds) },
            Self::Cancel => Request::Cancel {},
            Self::Start => Request::Start {},
            Self::Stop => Request::Stop {},
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn assignments_have_a_name_and_a_value() {
        assert_eq!(assignment("A[3] = $FF"), Ok(Assignment::new("A[3]", "$FF")));
        for text in ["", "A", "=1", "A=", " = "] {
            assert!(assignment(text).is_err(), "{text}");
        }
    }

    #[test]
    fn several_changes_are_accepted_at_once() {
        let words = ["plcctl", "s", "swap", "x.plcx", "--accept", "LAMP,N", "--accept", "HORN"];
        let action = Cli::try_parse_from(words).unwrap().action.unwrap();
        let Action::Ask(swap) = action else { panic!("a request") };
        let Request::Swap { accept, .. } = swap.request().unwrap() else { panic!("a swap") };
        assert_eq!(accept, ["LAMP", "N", "HORN"]);
    }

    #[test]
    fn pages_need_no_socket() {
        let action =
            |words: &[&str]| Cli::try_parse_from(words).map(|cli| (cli.socket, cli.action));
        assert!(matches!(action(&["plcctl", "man"]), Ok((None, Some(Action::Man { dir: None })))));
        let bash = action(&["plcctl", "completions", "bash"]);
        assert!(matches!(bash, Ok((None, Some(Action::Completions { shell: Shell::Bash })))));
        assert!(action(&["plcctl", "completions", "none"]).is_err());
    }

    #[test]
    fn the_control_is_told_the_whole_path_of_an_artifact() {
        let swap = Command::Swap {
            artifact: "x.plcx".into(),
            accept: vec![],
            dry_run: false,
            wait: Wait { seconds: 1.5 },
        };
        assert_eq!(swap.wait(), Duration::from_millis(1500));
        let Request::Swap { path, .. } = swap.request().unwrap() else { panic!("a swap") };
        assert!(path.is_absolute() && path.ends_with("x.plcx"));
    }
}
