//! IronPLC: Structured Text to the code of a virtual machine, which is given no inputs, and tells the variables after the last scan. So the
//! program makes its own random inputs, as [`Feed`](crate::feed::Feed) makes them, and sums up the values after each scan.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use plcc_iec::{Kind, Project, Type};

use crate::case::{Case, Number, Scan, Watched};
use crate::driver::{Place, done, places};
use crate::feed;
use crate::source::parts;

/// Sums of all values after scans.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    whole: i64,
    real: f64,
}

const MODULUS: i64 = 1 << 32;

impl Sums {
    fn add_whole(&mut self, value: i64) {
        self.whole = (self.whole * 31 + (value + (1 << 31))) % MODULUS;
    }

    fn add_real(&mut self, value: f64) {
        self.real = self.real / 3.0 + value / 3.0;
    }

    /// With what the control has after a scan.
    pub(crate) fn and(mut self, case: &Case, values: &[Vec<Number>]) -> Self {
        let places = places(case.project());
        for (common, values) in case.common.iter().zip(values) {
            let of = match &common.watched {
                Watched::Whole(of) => of.as_slice(),
                Watched::Bit(..) | Watched::Bytes(..) => &[],
            };
            for (at, value) in values.iter().enumerate() {
                let real = of.get(at).is_some_and(|&it| places[it].variable.ty == Type::Lreal);
                match *value {
                    Number::Int(value) if !real => self.add_whole(value),
                    value if real => self.add_real(value.real()),
                    // A PMAC's control has all values as doubles.
                    value if value.real().fract() == 0.0 => self.add_whole(value.real() as i64),
                    value => panic!("{} is {value:?}", common.name),
                }
            }
        }
        self
    }
}

/// A whole number as a LINT.
fn as_lint(place: &Place) -> String {
    match place.variable.ty {
        Type::Lint => place.name(),
        ty => format!("{}_TO_LINT({})", ty.name(), place.name()),
    }
}

/// Statements that sum up the values.
fn summing(case: &Case) -> String {
    let places = places(case.project());
    let mut out = String::new();
    let whole = |out: &mut String, value: &str| {
        let _ = writeln!(
            out,
            "    SUM_WHOLE := (SUM_WHOLE * LINT#31 + ({value} + LINT#2147483648)) MOD LINT#{MODULUS};"
        );
    };
    for common in &case.common {
        match &common.watched {
            Watched::Whole(of) => {
                for place in of.iter().map(|&it| &places[it]) {
                    let name = place.name();
                    match place.variable.ty {
                        Type::Lreal => {
                            let _ = writeln!(out, "    SUM_REAL := SUM_REAL / 3.0 + {name} / 3.0;");
                        }
                        Type::Bool => {
                            let _ = writeln!(
                                out,
                                "    SUM_BIT := LINT#0;\n    IF {name} THEN\n      SUM_BIT := LINT#1;\n    END_IF;"
                            );
                            whole(&mut out, "SUM_BIT");
                        }
                        _ => whole(&mut out, &as_lint(place)),
                    }
                }
            }
            Watched::Bit(at, weight) => {
                whole(&mut out, &format!("({} / LINT#{weight}) MOD LINT#2", as_lint(&places[*at])));
            }
            Watched::Bytes(low, None) => whole(&mut out, &as_lint(&places[*low])),
            Watched::Bytes(low, Some(high)) => {
                let (low, high) = (as_lint(&places[*low]), as_lint(&places[*high]));
                whole(&mut out, &format!("({low} + LINT#256 * {high})"));
            }
        }
    }
    out
}

/// The program, with what it does to itself. An address would make the machine write the inputs, which are plain variables here.
fn text(case: &Case) -> String {
    let mut project: Project = case.project().clone();
    for variable in &mut project.variables {
        variable.address = None;
        if variable.kind == Kind::Input {
            variable.kind = Kind::Local;
        }
    }
    let parts = parts(&project);
    let (head, rest) = parts.program.split_once('\n').unwrap();
    // The statements begin after the last list of variables.
    let begin = rest.rfind("  END_VAR\n").map_or(0, |at| at + "  END_VAR\n".len());
    let (variables, statements) = rest.split_at(begin);
    format!(
        "{}{}{head}\n{variables}{}  VAR\n    SUM_FIRST : BOOL := TRUE;\n    SUM_BIT : LINT;\n    SUM_WHOLE : LINT;\n    SUM_REAL : LREAL;\n  END_VAR\n\
         \x20 IF SUM_FIRST THEN\n    SUM_FIRST := FALSE;\n  ELSE\n{}    SUM_BIT := LINT#0;\n  END_IF;\n{}{statements}",
        feed::FUNCTIONS,
        parts.functions.concat(),
        feed::declarations(case.seed()),
        summing(case),
        feed::statements(&case.given()),
    )
}

/// Compiles a text.
fn compiled(ironplc: &Path, folder: &Path, name: &str, text: &str) -> Result<(), String> {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    let mut ironplcc = Command::new(ironplc.join("ironplcc"));
    ironplcc.arg("compile").arg(&path).arg("-o").arg(path.with_extension("iplc"));
    done(&mut ironplcc).map(|_| ()).map_err(|error| reason(&error))
}

/// Compiles a program as it is exported.
pub(crate) fn compile_exported(ironplc: &Path, case: &Case, folder: &Path) -> Result<(), String> {
    compiled(ironplc, folder, "exported.st", &plcc_iec::structured_text(case.project()))
}

/// Compiles a program with its own inputs.
pub(crate) fn compile(ironplc: &Path, case: &Case, folder: &Path) -> Result<(), String> {
    compiled(ironplc, folder, "program.st", &text(case))
}

/// What a message says, without its colours: the error, and what it found. Numbers are all 9, so that equal ones are counted together.
fn reason(message: &str) -> String {
    let mut parts = message.split('\u{1b}');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    parts.for_each(|part| plain.push_str(part.split_once('m').map_or("", |(_, rest)| rest)));
    let line = |what: &str| plain.lines().find(|line| line.contains(what));
    let Some(error) = line("error[") else {
        // The compiler itself may fail. The number of its thread is another one each time.
        let panic = plain.split_once(" panicked at ").map(|(_, what)| what.lines().take(2));
        return panic.map_or(plain.clone(), |what| what.collect::<Vec<_>>().join(" "));
    };
    let found = line("^").unwrap_or_default().trim_start_matches(['│', '^', ' ']);
    let found = found.rsplit_once("Found").map_or(found, |(_, found)| found).trim();
    let found = found.replace(|c: char| c.is_ascii_digit(), "9").replace("99", "9");
    format!("{error}, {found}")
}

/// Runs it for as many scans as the control has run, and compares the values after the last one, and the sums of those before.
pub(crate) fn compare(
    ironplc: &Path,
    case: &Case,
    folder: &Path,
    scan: &Scan,
    sums: Sums,
) -> Result<(), String> {
    let mut ironplcvm = Command::new(ironplc.join("ironplcvm"));
    ironplcvm.arg("run").arg(folder.join("program.iplc")).arg("--dump-vars");
    let text = done(ironplcvm.arg("--scans").arg((scan.number + 1).to_string()))?;
    // The variables of functions, which may have the same names, come after the program's.
    let values: BTreeMap<&str, &str> = text
        .lines()
        .rev()
        .filter_map(|line| line.split_once(": "))
        .map(|(name, value)| match value {
            "FALSE" => (name, "0"),
            "TRUE" => (name, "1"),
            value => (name, value),
        })
        .collect();
    let places = places(case.project());
    // It does not tell the elements of arrays.
    let value = |at: usize| {
        let place = &places[at];
        let value = values.get(place.variable.name.as_str()).copied();
        value.filter(|_| place.element.is_none())
    };
    scan.compare(case, value)?;
    let of = |name: &str| values.get(name).copied().unwrap_or_default();
    let seen = Sums {
        whole: of("SUM_WHOLE").parse().unwrap_or_default(),
        real: of("SUM_REAL").parse().unwrap_or_default(),
    };
    if seen == sums {
        Ok(())
    } else {
        Err(format!("{seen:?} instead of {sums:?} over {} scans", scan.number))
    }
}
