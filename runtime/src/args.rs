//! The options of `plcc run` and `plcrt`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;

pub use crate::nct::NctArgs;
pub use crate::pmac::PmacArgs;
pub use crate::pmi::PmiArgs;

/// How the control is set; part of [`RunArgs`], and of commands that run programs otherwise. Each
/// language has its own options.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Control")]
pub struct ControlArgs {
    /// PMI's.
    #[command(flatten)]
    pub pmi: PmiArgs,

    /// NCT's.
    #[command(flatten)]
    pub nct: NctArgs,

    /// PMAC's.
    #[command(flatten)]
    pub pmac: PmacArgs,
}

/// What a run does. `--machine` is not among them: a compiler reads more from that file.
#[derive(Args, Clone, Debug, Default)]
pub struct RunArgs {
    /// Runs exactly N base ticks: PMI scans, NCT 20 ms slices, PMAC servo cycles
    #[arg(long, value_name = "N", conflicts_with = "duration")]
    pub ticks: Option<u64>,

    /// Runs for so much of the machine's time: 5s, 200ms, 1.5m, 2h
    #[arg(long = "for", id = "duration", value_name = "TIME", value_parser = duration)]
    pub duration: Option<Duration>,

    /// Paces the ticks by the clock; without --ticks or --for until Ctrl-C (exit 130)
    #[arg(long)]
    pub realtime: bool,

    /// A table `tick,name,value` of what the machine and the operator do
    #[arg(long, value_name = "FILE.csv")]
    pub stimulus: Option<PathBuf>,

    /// Begins the stimulus again after its last tick
    #[arg(long)]
    pub repeat: bool,

    /// Variables for the trace and the dump.
    #[arg(
        long,
        value_name = "NAME,NAME…",
        help = "Variables for the trace and the dump: LS27,A[3],@FRO or I002,F020 or \
                P1,&2Q5,X:$0700; with * and ? patterns over the names of a dump, as in 'SP*'. \
                Without --trace the trace is printed, unless --dump or --events is"
    )]
    pub watch: Vec<String>,

    /// Writes `tick,name,value` for each watched variable when it changes (- is standard output);
    /// a file that ends in .vcd becomes a value change dump for waveform viewers
    #[arg(long, value_name = "OUT.csv|OUT.vcd")]
    pub trace: Option<PathBuf>,

    /// Gives each row of the trace the time of its tick: `tick,ms,name,value`
    #[arg(long)]
    pub time: bool,

    /// Writes faults, messages, SENDs and their kind, a JSON object a line (- is standard output)
    #[arg(long, value_name = "OUT.jsonl")]
    pub events: Option<PathBuf>,

    /// Writes the state after the last tick as JSON (- is standard output)
    #[arg(long, value_name = "OUT.json")]
    pub dump: Option<PathBuf>,

    /// Keeps what survives power-off in a file: read at the start if it is there, written at the end
    #[arg(long, value_name = "FILE")]
    pub retain: Option<PathBuf>,

    /// Files that are read besides the sources and the stimulus: an artifact, a machine file. No
    /// output may overwrite them.
    #[arg(skip)]
    pub reads: Vec<PathBuf>,

    /// How the control is set.
    #[command(flatten)]
    pub control: ControlArgs,
}

impl RunArgs {
    /// Where the trace goes: to the file that is named, else, where variables are watched and
    /// nothing else is printed, to standard output (`-`).
    pub fn trace_path(&self) -> Option<&Path> {
        let printed = [&self.events, &self.dump];
        let stdout_taken = printed.into_iter().flatten().any(|path| path.as_os_str() == "-");
        match &self.trace {
            Some(path) => Some(path),
            None if self.watch.is_empty() || stdout_taken => None,
            None => Some(Path::new("-")),
        }
    }
}

/// A decimal number with or without a fraction.
pub(crate) fn decimal(text: &str) -> Option<f64> {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    (plain && text.bytes().any(|byte| byte.is_ascii_digit())).then(|| text.parse().ok())?
}

/// So many units of `unit` seconds, if that is a time.
pub(crate) fn seconds(number: f64, unit: f64) -> Option<Duration> {
    Duration::try_from_secs_f64(number * unit).ok()
}

fn duration(text: &str) -> Result<Duration, String> {
    let at = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(at);
    let unit = match unit.trim() {
        "ms" => 0.001,
        "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("a number and ms, s, m or h are expected, as in 5s or 200ms".into()),
    };
    let number = decimal(number.trim()).ok_or("it does not begin with a number, as in 5s")?;
    seconds(number, unit).ok_or_else(|| "that is too long".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_a_unit() {
        for (text, ms) in [("5s", 5000), ("200ms", 200), ("1.5m", 90_000), ("2 h", 7_200_000)] {
            assert_eq!(duration(text), Ok(Duration::from_millis(ms)), "{text}");
        }
        for text in ["5", "s", "", "-5s", "1e3s", "5d", "99999999999999999999h", "NaNs"] {
            assert!(duration(text).is_err(), "{text}");
        }
    }
}
