//! The options of `plcc check`, `plcc build` and `plcc key`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};
use plcc_abi::time::duration;

use super::{OptArg, SourceArgs};
use crate::object_args::ObjectArgs;

#[derive(Args)]
pub(crate) struct CheckArgs {
    /// Sources, or folders of sources; - is standard input
    #[arg(required = true, value_name = "FILE|DIR")]
    pub(crate) paths: Vec<PathBuf>,

    /// PMAC: prints for each statement whether it is computed in integers or in floating point, and
    /// why in floating point
    #[arg(long)]
    pub(crate) explain_arithmetic: bool,

    /// Prints for each task (scan, module, PLC) how many operations of the intermediate representation
    /// one scan can execute at most, after optimisation, and the lines on the way, an object of JSON a
    /// line; `null` and the line of the loop where a loop has no bound
    #[arg(long, conflicts_with = "explain_arithmetic")]
    pub(crate) bound: bool,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Emit {
    /// What plcrt and `plcc run` take
    #[default]
    Artifact,
    /// An object file for a linker (ELF), with line information
    Obj,
    /// plcc's own intermediate representation (IR) after optimisation, as text
    Ir,
    /// The intermediate representation of the code generator Cranelift (CLIF), as text
    Clif,
    /// Machine code, disassembled, as text
    Asm,
}

#[derive(Subcommand)]
pub(crate) enum KeyCommand {
    /// Writes a new private key, which only its owner may read, and its public key beside it; prints
    /// the public key, as `plcrt info` does of the artifacts that it signs
    New {
        /// The file of the private key; the public key gets the same name with .pub after it.
        /// Neither may exist
        #[arg(value_name = "PATH")]
        path: PathBuf,
    },
}

#[derive(Args)]
pub(crate) struct BuildArgs {
    /// The source, - is standard input; several files are one PMAC download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    /// The output file [default: STEM.plcx or STEM.o in the current folder, where STEM is the first
    /// source's name without its ending; with --target STEM-ARCH.plcx or STEM-ARCH.o; text goes to
    /// standard output]
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,

    /// The form of the output
    #[arg(long, value_name = "FORM", default_value = "artifact")]
    pub(crate) emit: Emit,

    /// The machine that runs the code, as in aarch64-unknown-linux-gnu [default: this architecture]
    #[arg(long, value_name = "TRIPLE")]
    pub(crate) target: Option<String>,

    /// Signs the artifact with this private key, which `plcc key new` makes
    #[arg(long, value_name = "KEY")]
    pub(crate) sign: Option<PathBuf>,

    /// How much the compiler optimises
    #[arg(long, value_name = "LEVEL", default_value = "speed")]
    pub(crate) opt: OptArg,

    /// Proves of each function of the program that its optimised code does what the code before did, for all values of the
    /// process image
    #[arg(long)]
    pub(crate) validate: bool,

    /// How long --validate may search for the proof of each function, as in 500ms, 10s or 2min
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration, requires = "validate")]
    pub(crate) timeout: Duration,

    #[command(flatten)]
    pub(crate) object: ObjectArgs,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
