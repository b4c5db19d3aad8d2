//! The commands and options of `plcc`, with their help texts.

mod build;
mod diff;
mod export;
mod machine;
mod names;
mod plot;
mod prove;
mod recorded;
mod source;
mod test;
mod values;
mod why;

use std::path::PathBuf;

use clap::builder::styling::{AnsiColor, Styles};
use clap::{Args, ColorChoice, Parser, Subcommand};
use plcc_control::ControlArgs;
use plcc_host::args::RunArgs;

pub(crate) use build::{BuildArgs, CheckArgs, Emit, KeyCommand};
pub(crate) use diff::DiffArgs;
pub(crate) use export::{ExportArgs, ExportFormat};
pub(crate) use machine::{HalArgs, IoArgs, IoFormat};
pub(crate) use names::{ExplainArgs, XrefArgs};
pub(crate) use plot::PlotArgs;
pub(crate) use prove::{Contrary, ProofForm, ProveArgs};
pub(crate) use recorded::{ConvertArgs, ConvertFormat, MonitorArgs, ReplayArgs};
pub(crate) use source::SourceArgs;
pub(crate) use test::TestArgs;
pub(crate) use values::{ControllerArg, Denied, EngineArg, FormatArg, OptArg, PassArgs};
pub(crate) use why::WhyArgs;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold())
    .literal(AnsiColor::Cyan.on_default().bold())
    .placeholder(AnsiColor::Cyan.on_default());

const HELP: &str = "\
Examples:
  plcc check lathe.pmi
  plcc run lathe.pmi --ticks 500 --stimulus lathe.csv --watch MCHON,@FRO
  plcc build lathe.pmi && plcrt run lathe.plcx --realtime
  plcc explain PMI-31

`plcc help COMMAND` has each command's options and more examples.

Exit status:
  0    done; warnings do not change this
  1    the source has errors
  2    wrong usage, or a file that can't be read or written or is not valid
  3    the program was stopped by a run-time fault
  4    an internal error of plcc; please report it
  5    prove, or diff --prove, could not decide
  130  Ctrl-C or SIGTERM; all outputs are written";

/// Native code for the PLC programs of machine tools: PMI, NCT and PMAC.
#[derive(Parser)]
#[command(name = "plcc", version, styles = STYLES, after_help = HELP, max_term_width = 100)]
#[command(propagate_version = true)]
pub(crate) struct Cli {
    /// When to use colours: auto (on a terminal), always or never
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        default_value = "auto",
        hide_possible_values = true
    )]
    pub(crate) color: ColorChoice,

    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Checks sources and reports every error and warning
    #[command(after_help = "\
Folders are searched, with all folders in them, for .pmi, .nct, .pmc, .pmac and .plc files, in any \
case of letters. A file that others include is checked as a part of those. Several PMAC files that \
are named are checked as one download, in their order.

Examples:
  plcc check lathe.pmi
  plcc check machine/ --controller turbo
  plcc check --message-format json sample.plc | jq .code
  plcc check --bound lathe.pmi | jq '{entry, operations}'
  generate | plcc check - --dialect pmi")]
    Check(CheckArgs),

    /// Compiles ahead of time
    #[command(after_help = "\
Examples:
  plcc build lathe.pmi                         lathe.plcx, which plcrt and `plcc run` take
  plcc build lathe.pmi --emit obj -o lathe.o   an object file for a linker
  plcc build sample.plc --emit asm             machine code, to read
  plcc build mill.pmc --target aarch64-unknown-linux-gnu
  plcc build lathe.pmi --validate              proves that its optimised code does the same")]
    Build(BuildArgs),

    /// Writes a program as a real-time component for LinuxCNC's HAL
    #[command(after_help = "\
The folder NAME-hal gets the component in C, the artifact, a makefile and an example for halcmd. Inputs, \
outputs and the control's own variables become pins, other variables by --pin.

Examples:
  plcc hal lathe.pmi && make -C lathe-hal LIBPLCRT=/usr/lib/plcc/libplcrt.a
  plcc hal mill.pmc --name spindle --pin P30=out --pin 'Y:$FFC0=in'")]
    Hal(Box<HalArgs>),

    /// Makes keys with which artifacts are signed
    #[command(after_help = "\
The private key signs artifacts and stays where they are built. The public key goes to the controllers, \
which then take signed artifacts only.

Examples:
  plcc key new shop              writes shop (the private key, for you alone) and shop.pub
  plcc build lathe.pmi --sign shop
  plcrt run lathe.plcx --key shop.pub --realtime")]
    Key {
        #[command(subcommand)]
        command: KeyCommand,
    },

    /// Runs a program: a source or an artifact
    #[command(after_help = "\
Examples:
  plcc run lathe.pmi --ticks 500 --stimulus lathe.csv --watch MCHON,@FRO
  plcc run sample.plc --for 10s --events - --dump end.json
  plcc run lathe.pmi --for 10s --stimulus lathe.csv --watch 'SP*,@FRO' --plot lathe.svg
  plcc run lathe.pmi --for 5s --simulate --part-program shaft.nc --stimulus keys.csv --watch SIM.LINE
  plcc run mill.pmc io.pmc --realtime --retain mill.retained
  plcc run lathe.plcx --ticks 100 --dump - | jq .variables

Exit status: 0 done; 1 the source has errors; 2 wrong usage, or a file that can't be read or written \
or is not valid; 3 the program was stopped by a run-time fault; 130 Ctrl-C or SIGTERM.")]
    Run(Box<RunCommand>),

    /// Runs a recorded run again, and checks that every tick goes as it was recorded
    #[command(after_help = "\
The program is taken from the record. Sources of it, named after the record, let an artifact that was \
recorded on a controller run in the other engines; they must be those that it was built from.

Examples:
  plcc run lathe.pmi --ticks 5000 --stimulus lathe.csv --record lathe.plcrec
  plcc replay lathe.plcrec
  plcc replay lathe.plcrec --engine interp --from 1200 --until 1300 --watch MCHON,SPDL
  plcc replay lathe.plcrec lathe.pmi --events -

Exit status: 0 every tick went as recorded; 1 one did not, or the source has errors; 2 wrong usage, or a \
file that can't be read or written or is not valid.")]
    Replay(Box<ReplayArgs>),

    /// Writes the values of a recorded run in a format of other programs
    #[command(after_help = "\
VCD and FST are opened by GTKWave and other waveform viewers, CSV by spreadsheets.

Examples:
  plcc convert lathe.plcrec --to fst -o lathe.fst
  plcc convert lathe.plcrec --to csv --watch 'SP*,@FRO' --from 1000 --until 2000")]
    Convert(Box<ConvertArgs>),

    /// Runs test scripts (*.plctest)
    #[command(after_help = "\
A script names its program and has tests, each of which begins at power-up: what the machine and the operator \
do, what is waited for and what is expected, in conditions of the program's own language. The chapter \
`Test scripts` of the book explains the statements.

Examples:
  plcc test lathe.plctest
  plcc test machine/ --filter turret --junit result.xml
  plcc test lathe.plctest --message-format json | jq 'select(.result == \"failed\")'
  plcc test lathe.plctest --coverage lathe.html
  plcc test lathe.plctest --broken
  plcc test lathe.plctest --search 60 --output found.plctest
  plcc test --from morning.plcrec --output morning.plctest

Exit status: 0 all tests passed (with --broken: and the program tells of every fault); 1 one failed; 2 a script or a program is not valid.")]
    Test(Box<TestArgs>),

    /// Draws a trace: numbers over time, a bar for each bit, the path of an axis system
    #[command(after_help = "\
Positions and velocities of motors and axes (#1.CMD, &1.X, &1.VX) have panels of their own, other numbers \
another one. Where X and Y of a system are in the trace, its path is drawn too. `plcc run --plot` draws a \
run at once.

Examples:
  plcc run lathe.pmi --ticks 500 --stimulus lathe.csv --watch 'SP*,@FRO' --time --trace lathe-run.csv
  plcc plot lathe-run.csv -o lathe.svg")]
    Plot(PlotArgs),

    /// Times a scan in each engine, side by side
    #[command(after_help = "\
Examples:
  plcc bench lathe.pmi --stimulus lathe.csv
  plcc bench sample.plc --ticks 20000 --json | jq .engines.jit")]
    Bench(BenchArgs),

    /// Shows what a running or recorded program does: statements with their values, variables, inputs
    /// and outputs, events, times, a scope
    #[command(after_help = "\
Number keys choose a screen, `?` shows the keys, `q` leaves.

Examples:
  plcc monitor lathe.pmi --stimulus lathe.csv         a program that runs here
  plcc monitor lathe.plcrec                           a recording
  plcc monitor lathe.sock --record lathe.plcrec lathe.pmi
                                                      a control that runs
  plcc monitor lathe.plcrec --web                     in a browser
  plcc monitor lathe.sock --record lathe.plcrec --operator
                                                      for the operator: messages, keys and lamps

Exit status: 0 the user has left; 2 wrong usage, no terminal that can be used, or a file that can't be read \
or is not valid.")]
    Monitor(Box<MonitorArgs>),

    /// Debugs a program, forwards and backwards, for an editor: Debug Adapter Protocol on standard input and
    /// output
    #[command(after_help = "\
An editor starts this command and tells it by the protocol's request `launch` which program to run; \
the options are those of `plcc run` (`program`, `stimulus`, `machine`, `ticks`, `args`). docs/debugger.md \
says how editors are set up.")]
    Debug,

    /// Says which statements of two versions of a program differ in meaning, and what depends on them
    #[command(after_help = "\
Comments, layout, the base of numbers and the names of inputs and outputs do not count. A statement that is elsewhere \
counts if it has passed one with which its order matters. For each statement that differs it lists the outputs, \
messages and commands that depend on it, and through which variables.

Examples:
  plcc diff lathe-1996.pmi lathe.pmi
  plcc diff lathe.plcx lathe.pmi            does the artifact hold what is on file?
  plcc diff /run/plcc/socket lathe.pmi      does the control run it?
  plcc diff old.pmc new.pmc --html diff.html
  plcc diff lathe-1996.pmi lathe.pmi --prove

With --prove it lists no statements, but decides for each output and each retained variable whether it can differ, whatever the \
inputs are. Where it can, a stimulus with which both versions have been run shows it (STEM-differs-1.csv and so on).

Exit status: 0 both mean the same; 1 a statement or an output differs, or a source has errors; 2 wrong usage, or a file that can't \
be read; 5 with --prove nothing was found to differ, but something could not be decided.")]
    Diff(DiffArgs),

    /// Serves an editor while a program is written: Language Server Protocol on standard input and output
    #[command(after_help = "\
An editor starts this command. It shows problems while you type, what a name is and where it is used, completes \
and renames names, and more; docs/editors.md lists it, and says how editors are set up.")]
    Lsp,

    /// Explains the code of a diagnostic, a keyword, or a variable of a control
    #[command(after_help = "\
Examples:
  plcc explain PMI-31
  plcc explain ERR003    PMAC's own form of PMAC-3
  plcc explain @FRO
  plcc explain I510      the flag of NCT and the I-variable of PMAC
  plcc explain M145 --dialect pmac
  plcc explain Ix22 I5..8 M11..18
  plcc explain I5111 --controller turbo
  plcc explain WHILE X:$0700 --dialect pmac
  plcc explain --search feed override
  plcc explain --list --dialect pmi")]
    Explain(ExplainArgs),

    /// Lists where a program reads, writes and tests each variable
    #[command(after_help = "\
In an NCT program it also warns of bits that are written and never read, of bits that are read and \
never written, and of outputs that several modules set or reset.

Examples:
  plcc xref sample.plc
  plcc xref lathe.pmi --message-format json | jq 'select(.written == [])'")]
    Xref(XrefArgs),

    /// Says why a variable has its value: since when, which contacts hold it, and which inputs would switch it
    #[command(after_help = "\
The answer goes down to inputs, timers and values of earlier scans. `would` is tried in the statement \
interpreter before it is shown.

Examples:
  plcc why lathe.pmi MCHON --stimulus lathe.csv --tick 300
  plcc why lathe.plcrec SPINON                   the end of a record
  plcc why lathe.plcrec SPINON --tick 1200       why it did not come then
  plcc why lathe.pmi \"DOOR IS OPEN\" --stimulus lathe.csv   what raised a fault or message
  plcc why lathe.sock MCHON --record lathe.plcrec
  plcc why lathe.sock lathe.pmi MCHON            of a control without a record: its values now
  plcc why sample.plc Y001 --message-format json | jq .would

Exit status: 0 the value is explained; 1 the source has errors; 2 wrong usage, or a file that can't be read \
or is not valid.")]
    Why(Box<WhyArgs>),

    /// Proves that conditions hold in every scan for all inputs, or shows a run in which one does not
    #[command(after_help = "\
Inputs, and whatever the control or the operator may write, are anything in each scan. The first scan is \
that of power-up. A condition is written as in the program; it counts at the end of each scan. What refutes one is a stimulus, \
which the interpreter has run before it is shown; it is written to STEM-refuted-1.csv and so on, and `plcc run` \
and `plcc monitor` take it with --stimulus.

Examples:
  plcc prove lathe.pmi --never 'CW & CCW'
  plcc prove lathe.pmi --always 'CLAMP ! /SPIN' --timeout 5min
  plcc prove sample.plc --never '(Y001 A Y002)' --message-format json
  plcc prove lathe.pmi --script lathe.plctest
  plcc prove lathe.pmi --after 'START & DOOR, SPIN ! /START within 2 s'
  plcc prove lathe.pmi --contrary=ask
  plcc prove lathe.pmi --never 'CW & CCW' --emit aiger    lathe.aig, for other model checkers

Exit status: 0 all are proved; 1 one is refuted, or the source has errors; 2 wrong usage, or a file that can't be read or is \
not valid; 5 one could not be decided, and none is refuted.")]
    Prove(Box<ProveArgs>),

    /// Writes a program in Structured Text of IEC 61131-3, or as PLCopen XML
    #[command(after_help = "\
Names, comments and the addresses of inputs and outputs stay. What the control does around the program, timers and flip-flops \
above all, is written out, so that each call of the exported program is a scan, a slice or a servo cycle. What can't be said in IEC \
61131-3 is told with its line, and then nothing is written; what is only left out, such as the texts of messages, is told by notes.

Examples:
  plcc export lathe.pmi --to st                 lathe.st, for compilers of Structured Text
  plcc export sample.plc --to plcopen -o iec    iec/sample.xml, for the import of other systems

Exit status: 0 the file is written; 1 the source has errors, or statements that can't be exported; 2 wrong usage, or a file that \
can't be read or written.")]
    Export(Box<ExportArgs>),

    /// Lists what is wired to a program: a template of the entries [[io]], or the terminals to tick off
    #[command(after_help = "\
The entries connect variables with points outside; they belong in the configuration of the control \
(plcrt run --config). They have the order of ports and bits, each with its old place and what [names] and the source's \
comments say of it. What the program exchanges with the control is listed apart.

Examples:
  plcc io lathe.pmi >> controller.toml
  plcc io lathe.pmi --config controller.toml --to html > terminals.html")]
    Io(IoArgs),

    /// For those who work on plcc itself: commands with the options of the optimiser
    #[command(after_help = "\
Examples:
  plcc dev build mill.pmc --time-passes -o /dev/null
  plcc dev bench mill.pmc --passes=-gates,-narrow")]
    Dev {
        #[command(subcommand)]
        command: DevCommand,
    },

    /// Prints completions for a shell
    #[command(
        after_help = "Example:\n  plcc completions bash > ~/.local/share/bash-completion/completions/plcc"
    )]
    Completions {
        /// The shell
        shell: plcc_pages::Shell,
    },

    /// Prints the manual page, or writes the pages of all commands
    #[command(after_help = "\
Examples:
  plcc man | man -l -
  plcc man --dir ~/.local/share/man/man1")]
    Man {
        /// The folder that gets a page for each command, plcc.1, plcc-run.1…
        #[arg(long, value_name = "DIR")]
        dir: Option<PathBuf>,
    },
}

/// The commands of `plcc dev`.
#[derive(Subcommand)]
pub(crate) enum DevCommand {
    /// `plcc build` with a choice of passes, and their times
    Build {
        /// Prints how long each pass of the optimiser took, on standard error
        #[arg(long)]
        time_passes: bool,

        #[command(flatten)]
        passes: PassArgs,

        #[command(flatten)]
        args: Box<BuildArgs>,
    },

    /// `plcc run` with a choice of passes
    Run {
        #[command(flatten)]
        passes: PassArgs,

        #[command(flatten)]
        args: Box<RunCommand>,
    },

    /// `plcc bench` with a choice of passes
    Bench {
        #[command(flatten)]
        passes: PassArgs,

        #[command(flatten)]
        args: Box<BenchArgs>,
    },
}

#[derive(Args)]
pub(crate) struct RunCommand {
    /// A source, - is standard input (several files are one PMAC download, in their order); or an
    /// artifact
    #[arg(required = true, value_name = "FILE|ARTIFACT")]
    pub(crate) files: Vec<PathBuf>,

    /// The engine that executes the program [default: jit; an artifact is always aot]
    #[arg(long, value_name = "ENGINE")]
    pub(crate) engine: Option<EngineArg>,

    /// How much the compiler optimises [default: speed]
    #[arg(long, value_name = "LEVEL")]
    pub(crate) opt: Option<OptArg>,

    /// PMAC: leaves out PLCs whose IFs or WHILEs do not match, and runs the others
    #[arg(long)]
    pub(crate) keep_going: bool,

    /// Draws the watched variables over the time of the run, in simulated time (- is standard output). There is a trace besides
    /// only with --trace
    #[arg(long, value_name = "OUT.svg", conflicts_with = "realtime")]
    pub(crate) plot: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) run: RunArgs,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}

#[derive(Args)]
pub(crate) struct BenchArgs {
    /// The source, - is standard input; several files are one PMAC download, in their order
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,

    /// A table `tick,name,value` of what the machine and the operator do; it begins again after its
    /// last tick
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) stimulus: Option<PathBuf>,

    /// Motors and motion programs of a PMAC are simulated, as in `plcc run --simulate`
    #[arg(long)]
    pub(crate) simulate: bool,

    /// How many ticks to run in each engine [default: 100000, or as many as fit into ten seconds]
    #[arg(long, visible_alias = "scans", value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) ticks: Option<u64>,

    /// Prints the times as one JSON object, as --message-format json does
    #[arg(long)]
    pub(crate) json: bool,

    /// How much the compiler optimises
    #[arg(long, value_name = "LEVEL", default_value = "speed")]
    pub(crate) opt: OptArg,

    #[command(flatten)]
    pub(crate) control: ControlArgs,

    #[command(flatten)]
    pub(crate) source: SourceArgs,
}
