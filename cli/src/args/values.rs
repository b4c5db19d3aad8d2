//! The values that options take: words for languages, limits, engines and lints, and how texts such as
//! `NAME=VALUE` are read.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use plcc_abi::Dialect;
use plcc_codegen::{OptLevel, Optimization};
use plcc_diag::lints::{LINTS, Lint, find_lint};
use plcc_frontend::LANGUAGES;
use plcc_frontend::common::{Controller, Limits, closest};

/// The languages by their names, each with its vendor.
pub(super) fn dialect() -> impl TypedValueParser<Value = Dialect> {
    let known = LANGUAGES
        .iter()
        .map(|language| PossibleValue::new(language.dialect().name()).help(language.vendor()));
    PossibleValuesParser::new(known).try_map(|name| {
        let of_name = |dialect: &&Dialect| dialect.name().eq_ignore_ascii_case(&name);
        Dialect::ALL.iter().find(of_name).copied().ok_or("there is no such language")
    })
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum LimitsArg {
    /// The original compiler's limits are errors
    #[default]
    Original,
    /// They do not hold; plcc's own limits remain, such as 256 levels of nesting
    None,
}

impl From<LimitsArg> for Limits {
    fn from(arg: LimitsArg) -> Self {
        match arg {
            LimitsArg::Original => Self::Original,
            LimitsArg::None => Self::None,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum ControllerArg {
    /// PMAC, the first generation
    #[default]
    Pmac,
    /// Turbo PMAC
    Turbo,
}

impl From<ControllerArg> for Controller {
    fn from(arg: ControllerArg) -> Self {
        match arg {
            ControllerArg::Pmac => Self::Pmac,
            ControllerArg::Turbo => Self::Turbo,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum OptArg {
    /// Compiles quickly, runs slower
    None,
    /// Compiles slower, runs quickly
    #[default]
    Speed,
}

/// Which passes of the optimiser run.
#[derive(Args, Clone, Debug, Default)]
pub(crate) struct PassArgs {
    /// Passes to leave out (-NAME) or put in (+NAME), as in --passes=-gates,-narrow; to find out what
    /// one brings, or whether it makes a mistake
    #[arg(long, value_name = "CHANGES", allow_hyphen_values = true, value_parser = pass_changes)]
    pub(crate) passes: Option<String>,
}

impl PassArgs {
    /// What is done at a level.
    pub(crate) fn at(&self, level: OptArg) -> Optimization {
        let all = Optimization::from(OptLevel::from(level));
        // The text was checked when the command line was read.
        all.with_changes(self.passes.as_deref().unwrap_or_default()).unwrap_or(all)
    }
}

/// Checks the text of `--passes`.
pub(super) fn pass_changes(text: &str) -> Result<String, String> {
    Optimization::NONE.with_changes(text).map(|_| text.to_owned())
}

impl From<OptArg> for OptLevel {
    fn from(arg: OptArg) -> Self {
        match arg {
            OptArg::None => Self::None,
            OptArg::Speed => Self::Speed,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum EngineArg {
    /// Interprets the source's statements, without compiling; much slower
    Interp,
    /// Native code, compiled just in time for this machine
    #[default]
    Jit,
    /// Native code, compiled ahead of time as `plcc build` does
    Aot,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum FormatArg {
    /// Drawn excerpts of the source, on standard error
    #[default]
    Human,
    /// A JSON object a line, on standard output
    Json,
}

/// What `--deny` makes an error.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Denied {
    /// Every warning.
    Warnings,
    /// The findings of a lint.
    Lint(&'static Lint),
}

/// The lint with a name.
pub(super) fn lint(name: &str) -> Result<&'static Lint, String> {
    find_lint(name).ok_or_else(|| {
        let near = closest(name, LINTS.iter().map(|lint| lint.name));
        let near = near.map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
        format!("there is no lint of that name{near}")
    })
}

pub(super) fn denied(name: &str) -> Result<Denied, String> {
    if name == "warnings" { Ok(Denied::Warnings) } else { lint(name).map(Denied::Lint) }
}

pub(super) fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => Ok((name.trim().into(), value.into())),
        _ => Err("NAME=VALUE is expected, as in AXIS=3".into()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn clap_accepts_the_definition_of_the_options() {
        crate::args::Cli::command().debug_assert();
    }
}
