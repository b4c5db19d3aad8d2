//! The options of `plcc run` and `plcrt`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use plcc_abi::nct::NctControl;

/// How the control is set; part of [`RunArgs`], and of commands that run programs otherwise.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Control")]
pub struct ControlArgs {
    /// PMI: time between two scans in milliseconds [default: 20]
    #[arg(long, value_name = "MS", value_parser = period)]
    pub period: Option<Duration>,

    /// NCT: sets an NC parameter, as in --param 61=24; 61 is MAGAZINE, 62 PLC_TAB (repeatable)
    #[arg(long, value_name = "N=VALUE", value_parser = parameter)]
    pub param: Vec<(u16, i64)>,

    /// NCT: sets a PLC constant, 1 for RP001 to 40 (repeatable)
    #[arg(long = "const", value_name = "N=VALUE", value_parser = constant)]
    pub constants: Vec<(u16, u16)>,

    /// NCT: sets a macro variable, as in --macro 180=12.5 (repeatable)
    #[arg(long = "macro", value_name = "N=VALUE", value_parser = macro_variable)]
    pub macros: Vec<(u16, f64)>,

    /// NCT: the type of control, which says how often :002 runs [default: nct104]
    #[arg(long = "control", value_name = "TYPE", value_parser = control)]
    pub control: Option<NctControl>,

    /// NCT: backward jumps and calls after which :000 waits for the next slice [default: 10000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub level0_safepoints: Option<u32>,

    /// PMAC: background steps in each servo cycle [default: 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..=100_000))]
    pub background_steps: Option<u32>,
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
                P1,&2Q5,X:$0700"
    )]
    pub watch: Vec<String>,

    /// Writes `tick,name,value` for each watched variable when it changes (- is standard output)
    #[arg(long, value_name = "OUT.csv")]
    pub trace: Option<PathBuf>,

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

/// A decimal number with or without a fraction.
fn decimal(text: &str) -> Option<f64> {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    (plain && text.bytes().any(|byte| byte.is_ascii_digit())).then(|| text.parse().ok())?
}

fn seconds(number: f64, unit: f64) -> Option<Duration> {
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

fn period(text: &str) -> Result<Duration, String> {
    let number = decimal(text).ok_or("a number of milliseconds is expected, as in 20 or 2.5")?;
    let period = seconds(number, 0.001).filter(|period| period.as_secs() < 3600);
    period
        .filter(|period| !period.is_zero())
        .ok_or_else(|| "it is more than 0, at most an hour".into())
}

/// The parts of `N=VALUE`.
fn assignment(text: &str, low: u16, high: u16) -> Result<(u16, &str), String> {
    let (number, value) = text.split_once('=').ok_or("N=VALUE is expected, as in 61=24")?;
    let number = number.trim();
    let digits = number.bytes().all(|byte| byte.is_ascii_digit());
    let parsed = number.parse().ok().filter(|n| digits && (low..=high).contains(n));
    let parsed = parsed.ok_or_else(|| format!("`{number}` is no number from {low} to {high}"))?;
    Ok((parsed, value.trim()))
}

fn integer(text: &str) -> Result<i64, String> {
    text.parse().map_err(|_| format!("`{text}` is no integer"))
}

fn parameter(text: &str) -> Result<(u16, i64), String> {
    let (number, value) = assignment(text, 0, 9999)?;
    Ok((number, integer(value)?))
}

fn constant(text: &str) -> Result<(u16, u16), String> {
    let (number, value) = assignment(text, 1, 40)?;
    let value = integer(value)?;
    if !(-0x8000..=0xFFFF).contains(&value) {
        return Err(format!("{value} does not fit 16 bits"));
    }
    Ok((number, value as u16))
}

fn macro_variable(text: &str) -> Result<(u16, f64), String> {
    let (number, value) = assignment(text, 1, 9999)?;
    let parsed = value.parse().ok().filter(|value: &f64| value.is_finite());
    Ok((number, parsed.ok_or_else(|| format!("`{value}` is no number"))?))
}

fn control(text: &str) -> Result<NctControl, String> {
    NctControl::from_name(text).ok_or_else(|| {
        let known: Vec<&str> = NctControl::ALL.iter().map(|control| control.name()).collect();
        format!("the types are {}", known.join(", "))
    })
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

    #[test]
    fn periods_are_milliseconds() {
        assert_eq!(period("2.5"), Ok(Duration::from_micros(2500)));
        for text in ["0", "-1", "", ".", "20ms", "3600000", "inf"] {
            assert!(period(text).is_err(), "{text}");
        }
    }

    #[test]
    fn settings_have_their_ranges() {
        assert_eq!(parameter("61=24"), Ok((61, 24)));
        assert_eq!(constant("1=-1"), Ok((1, 0xFFFF)));
        assert_eq!(macro_variable("180=12.5"), Ok((180, 12.5)));
        for text in ["0=1", "41=1", "1=65536", "1", "=1", "+1=1", "1=x"] {
            assert!(constant(text).is_err(), "{text}");
        }
        assert!(macro_variable("1=inf").is_err());
        assert_eq!(control("NCT98"), Ok(NctControl::Nct98));
        assert!(control("nct1").is_err());
    }
}
