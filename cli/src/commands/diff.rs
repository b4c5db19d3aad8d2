//! `plcc diff`: which statements of two versions of a program differ in meaning, and what depends on them.

mod page;
mod proof;
mod stored;
mod text;

use std::collections::BTreeMap;
use std::path::Path;

use plcc_abi::{Dialect, Program};
use plcc_diag::{SourceMap, Span};
use plcc_diff::{Affected, Difference, Version, compare};
use plcc_frontend::common::words::DeclarationKind;
use plcc_frontend::presentation::{Exchange, Uses};
use plcc_runtime::names_of;
use serde_json::{Value, json};
use stored::Stored;

use crate::args::{DiffArgs, FormatArg};
use crate::compile::Checked;
use crate::failure::{DONE, ERRORS, Failure};
use crate::input::{Input, SourceSettings};
use crate::output;
use crate::recorded::{check_recorded, words_of_recorded};
use crate::report::{Destination, Report};

/// A version that has been read.
struct Side {
    dialect: Dialect,
    version: Version,
    /// What the names of the program are to the machine.
    roles: BTreeMap<String, &'static str>,
}

pub(crate) fn diff(args: &DiffArgs, report: &Report) -> Result<u8, Failure> {
    if args.prove {
        return proof::prove(args, report);
    }
    let (Some(old), Some(new)) =
        (Side::read(&args.old, args, report)?, Side::read(&args.new, args, report)?)
    else {
        report.message("nothing is compared: a program has errors");
        return Ok(ERRORS);
    };
    if old.dialect != new.dialect {
        let (a, b) = (old.dialect.name(), new.dialect.name());
        return Err(Failure::usage(format!(
            "the old version is a program in {a}, the new one in {b}"
        )));
    }
    let found = compare(&old.version, &new.version);
    let rows: Vec<Row> = found.iter().map(|it| Row::of(it, &old, &new)).collect();
    match args.source.message_format {
        FormatArg::Json => {
            for row in &rows {
                output::print(format!("{}\n", row.json()).as_bytes())?;
            }
        }
        FormatArg::Human => output::print(text::text(&rows, report).as_bytes())?,
    }
    if let Some(path) = &args.html {
        let read = [args.old.clone(), args.new.clone()];
        output::write(path, page::page(args, &rows).as_bytes(), &SourceMap::new(), &read)?;
    }
    Ok(if rows.is_empty() { DONE } else { DIFFERENT })
}

/// What is said of a stored version whose program can't be used.
const WITH_ERRORS: &str = "its program has errors for this plcc";

/// The exit status if a statement differs.
const DIFFERENT: u8 = 1;

impl Side {
    /// Reads a version. `None` if it has errors, which have been told.
    fn read(path: &Path, args: &DiffArgs, report: &Report) -> Result<Option<Self>, Failure> {
        if let Some(stored) = Stored::read(path)? {
            return Self::of_stored(path, &stored).map(Some);
        }
        let files = [path.to_owned()];
        let settings = SourceSettings::for_files(&args.source, &files, report)?;
        let input = Input::read(&files, &args.source)?;
        let (sources, words) = input.words(&settings.options);
        let dialect = input.dialect;
        let program = input.check(&settings)?;
        let to = Destination::from(args.source.message_format);
        let Some((checked, _)) = program.without_errors(to, report)? else { return Ok(None) };
        let lowered = checked.lower();
        let program = lowered.map_err(|error| Failure::file(path, error))?.program;
        let version = Version { sources, words };
        let roles = roles(&program, &version, Some(&checked));
        Ok(Some(Self { dialect, version, roles }))
    }

    /// A version that is stored with its sources; its program is made of them where it is not known.
    fn of_stored(path: &Path, stored: &Stored) -> Result<Self, Failure> {
        let failure = |error| Failure::file(path, error);
        let (sources, words, dialect) = words_of_recorded(&stored.sources).map_err(failure)?;
        let (checked, ..) = check_recorded(&stored.sources).map_err(failure)?;
        let lowered = match &checked {
            Some(checked) if stored.program.is_none() => {
                Some(checked.lower().map_err(|error| Failure::file(path, error))?.program)
            }
            _ => None,
        };
        let version = Version { sources, words };
        let roles = match stored.program.as_ref().or(lowered.as_ref()) {
            Some(program) => roles(program, &version, checked.as_ref()),
            None => return Err(failure(WITH_ERRORS.into())),
        };
        Ok(Self { dialect, version, roles })
    }
}

/// What the names of a program are to the machine: outputs, messages, what the control reads.
fn roles(
    program: &Program,
    version: &Version,
    checked: Option<&Checked>,
) -> BTreeMap<String, &'static str> {
    let mut roles = BTreeMap::new();
    for (name, (read, written)) in version.words.uses() {
        let uses = Uses { read: read > 0, written: written > 0, in_word: true, declared: None };
        let exchange = checked.and_then(|it| it.program().exchange(name, uses));
        if uses.written && matches!(exchange, Some(Exchange::Program | Exchange::Both)) {
            roles.insert(name.to_owned(), "control");
        }
    }
    for it in &version.words.declarations {
        match it.kind {
            DeclarationKind::Announcement => roles.insert(it.name.clone(), "message"),
            DeclarationKind::Output => roles.insert(it.name.clone(), "output"),
            _ => None,
        };
    }
    roles.extend(names_of(program).outputs().into_iter().map(|(name, _)| (name, "output")));
    roles
}

/// Where a statement is, and its text.
struct Place {
    file: String,
    line: u32,
    text: String,
}

impl Place {
    fn of(span: Span, side: &Side) -> Self {
        let sources = &side.version.sources;
        let text = sources.slice(span).split_whitespace().collect::<Vec<_>>().join(" ");
        Self {
            file: sources.path(span.file).to_owned(),
            line: sources.line(span.file, span.start),
            text,
        }
    }

    fn json(&self) -> Value {
        json!({"file": self.file, "line": self.line, "text": self.text})
    }
}

/// A statement that differs, as it is shown.
struct Row {
    change: &'static str,
    old: Option<Place>,
    new: Option<Place>,
    /// What depends on it, with what that is.
    affected: Vec<(Affected, &'static str)>,
}

impl Row {
    fn of(difference: &Difference, old: &Side, new: &Side) -> Self {
        let role = |affected: &Affected| {
            let role = || new.roles.get(&affected.name).or_else(|| old.roles.get(&affected.name));
            if affected.is_statement { "command" } else { role().copied().unwrap_or("variable") }
        };
        Self {
            change: difference.change.name(),
            old: difference.old.map(|span| Place::of(span, old)),
            new: difference.new.map(|span| Place::of(span, new)),
            affected: difference.affected.iter().map(|it| (it.clone(), role(it))).collect(),
        }
    }

    /// What the machine or the operator sees of it.
    fn effects(&self) -> impl Iterator<Item = &(Affected, &'static str)> {
        self.affected.iter().filter(|(_, role)| *role != "variable")
    }

    fn json(&self) -> Value {
        let affects = self
            .affected
            .iter()
            .map(|(it, role)| json!({"name": it.name, "kind": role, "via": it.via}));
        json!({
            "change": self.change,
            "old": self.old.as_ref().map(Place::json),
            "new": self.new.as_ref().map(Place::json),
            "affects": affects.collect::<Vec<_>>(),
        })
    }
}
