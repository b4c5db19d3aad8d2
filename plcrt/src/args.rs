//! The command line: commands, their options, and the earlier spellings of commands as options.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand};
use plcc_configuration::Entry;
use plcc_host::args::RunArgs;

use crate::pages;

/// Runs compiled PLC programs on the controller.
///
/// `plcrt ARTIFACT …` and `plcrt --config FILE.toml …` are short for `plcrt run …`.
#[derive(Parser)]
#[command(
    name = "plcrt",
    version,
    propagate_version = true,
    after_help = "`plcrt help COMMAND` has each command's options and more examples.\n\n\
                  Exit status: 0 done; 2 wrong usage, or a file that can't be read or written or is \
                  not valid; 3 the program was stopped by a run-time fault; 130 Ctrl-C or SIGTERM.\n\n\
                  Examples:\n  \
                  plcrt check-config lathe.toml\n  \
                  plcrt run --config lathe.toml\n  \
                  plcrt run lathe.plcx --ticks 1000 --stimulus lathe.csv --watch MCHON,@FRO --trace out.csv\n  \
                  plcrt info lathe.plcx"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Runs a program: the artifact that `plcc build` has written
    #[command(
        args_override_self = true,
        after_help = "Exit status: 0 done; 2 wrong usage, or a file that can't be read or written or is \
                      not valid; 3 the program was stopped by a run-time fault; 130 Ctrl-C or SIGTERM.\n\n\
                      Examples:\n  \
                      plcrt run lathe.plcx --realtime --retain lathe.retained\n  \
                      plcrt run lathe.plcx --ticks 1000 --stimulus lathe.csv --watch MCHON,@FRO --trace out.csv\n  \
                      plcrt run mill.plcx --for 5s --dump - | jq .variables\n  \
                      plcrt run --config lathe.toml"
    )]
    Run(Box<RunCommand>),

    /// Finds every mistake in the configuration of a controller, and runs nothing
    #[command(after_help = "Example:\n  plcrt check-config /etc/plcrt/lathe.toml")]
    CheckConfig {
        /// The configuration
        #[arg(value_name = "FILE.toml")]
        config: PathBuf,
    },

    /// Prints what an artifact holds and whether this machine can run it
    #[command(
        after_help = "Examples:\n  plcrt info mill.plcx\n  plcrt info mill.plcx --key shop.pub"
    )]
    Info {
        /// The artifact, STEM.plcx
        artifact: PathBuf,

        /// Checks that the artifact is signed with the private key of this public key
        #[arg(long, value_name = "PUBKEY")]
        key: Option<PathBuf>,
    },

    /// Prints the variables and outputs in an image file (`run --image`) as a dump: those of a control that
    /// was killed
    #[command(after_help = "\
With the artifact of its program the dump is that of a run.

Examples:
  plcrt dump-image /run/lathe.image
  plcrt dump-image /run/lathe.image lathe.plcx | jq .variables")]
    DumpImage {
        /// The image file
        image: PathBuf,

        /// The artifact of its program
        artifact: Option<PathBuf>,

        /// More variables for the dump, as in `run --watch`
        #[arg(long, value_name = "NAME,NAME…")]
        watch: Vec<String>,

        /// Takes the artifact only if it is signed with the private key of this public key
        #[arg(long, value_name = "PUBKEY")]
        key: Option<PathBuf>,
    },

    /// Prints the manual page, or writes the pages of all commands
    #[command(
        after_help = "Examples:\n  plcrt man | man -l -\n  plcrt man --dir ~/.local/share/man/man1"
    )]
    Man {
        /// The folder that gets a page for each command, plcrt.1, plcrt-run.1…
        #[arg(long, value_name = "DIR")]
        dir: Option<PathBuf>,
    },

    /// Prints completions for a shell
    #[command(
        after_help = "Example:\n  plcrt completions bash > ~/.local/share/bash-completion/completions/plcrt"
    )]
    Completions {
        /// The shell
        #[arg(value_parser = pages::SHELLS)]
        shell: String,
    },
}

/// What `plcrt run` takes, with the earlier spellings of other commands.
#[derive(Args)]
pub(crate) struct RunCommand {
    /// The artifact, STEM.plcx
    #[arg(required_unless_present_any = ["completions", "man", "config", "check_config", "dump_image"])]
    pub(crate) artifact: Option<PathBuf>,

    /// NCT: a machine file, used in place of the one that the program was compiled with
    #[arg(long, value_name = "FILE.toml")]
    pub(crate) machine: Option<PathBuf>,

    /// The command `info`, of the artifact that the configuration names where there is one.
    #[arg(long, hide = true)]
    pub(crate) info: bool,

    /// The command `dump-image`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["realtime", "config"], hide = true)]
    dump_image: Option<PathBuf>,

    /// The command `completions`.
    #[arg(long, value_name = "SHELL", exclusive = true, value_parser = pages::SHELLS, hide = true)]
    completions: Option<String>,

    /// The command `man`.
    #[arg(long, exclusive = true, hide = true)]
    man: bool,

    /// The command `check-config`.
    #[arg(long, value_name = "FILE.toml", exclusive = true, hide = true)]
    check_config: Option<PathBuf>,

    /// Takes the artifact and the options of a controller from a file, and runs in real time; an option
    /// on the command line takes precedence
    #[arg(long, value_name = "FILE.toml", groups = ["paced", "served", "retained"])]
    pub(crate) config: Option<PathBuf>,

    /// With --realtime, runs the control in this process, without another one that watches it, as --gdb
    /// does; for strace
    #[arg(long)]
    pub(crate) no_supervisor: bool,

    /// How often a control that has died is started again by its supervisor [default: 0]
    #[arg(long, value_name = "N")]
    pub(crate) restart: Option<u32>,

    /// A hardware watchdog that the supervisor keeps from restarting the computer for as long as the
    /// control is well, usually /dev/watchdog
    #[arg(long, value_name = "DEVICE")]
    pub(crate) watchdog_device: Option<PathBuf>,

    /// When the supervisor began, in nanoseconds of CLOCK_MONOTONIC
    #[arg(long, hide = true)]
    pub(crate) started_at: Option<u64>,

    /// Says that this process is the control, and standard input the connection to its supervisor
    #[arg(long, hide = true)]
    pub(crate) supervised: bool,

    /// The entries `[[io]]` of the configuration.
    #[arg(skip)]
    pub(crate) wiring: Vec<Entry>,

    #[command(flatten)]
    pub(crate) run: RunArgs,
}

impl Command {
    /// The command that an earlier spelling as an option of `run` means, but for `--info`.
    pub(crate) fn of_today(self) -> Self {
        let Self::Run(mut args) = self else { return self };
        if let Some(config) = args.check_config {
            return Self::CheckConfig { config };
        }
        if args.man {
            return Self::Man { dir: None };
        }
        if let Some(shell) = args.completions {
            return Self::Completions { shell };
        }
        if let Some(image) = args.dump_image.take() {
            let RunArgs { watch, key, .. } = args.run;
            return Self::DumpImage { image, artifact: args.artifact, watch, key };
        }
        Self::Run(args)
    }
}

/// The words of the command line after the program's name; `run` is put before those that begin with no
/// command.
pub(crate) fn words() -> Vec<OsString> {
    let mut words: Vec<OsString> = std::env::args_os().skip(1).collect();
    let cli = Cli::command();
    let is_ours = |word: &OsString| {
        cli.get_subcommands().any(|command| word == command.get_name())
            || ["help", "--help", "-h", "--version", "-V"].iter().any(|known| word == known)
    };
    if words.first().is_some_and(|word| !is_ours(word)) {
        words.insert(0, "run".into());
    }
    words
}
