//! Lints about variables: `value-out-of-range`, `undefined-m-variable`, `assigned-undefined`, `input-assigned`, `shared-timer`,
//! `same-bit-twice`.

use std::collections::{BTreeMap, BTreeSet};

use plcc_abi::pmac::{Controller, Definition, Field, Format, Kind, View};
use plcc_diag::Diagnostic;

use super::Checked;
use crate::pmac::analyse::{cross_reference::variable as variable_name, load::Loaded};
use crate::pmac::ast::{Action, Op, StmtKind, Target, program_name};
use crate::pmac::origin::TextRange;

/// Constants that the bits of the M-variable to which they are assigned can't hold.
pub(super) fn value_out_of_range(checked: &mut Checked<'_>) {
    for (target, expr, at) in checked.download.assignments() {
        let Target::Var(Kind::M, number) = target else { continue };
        let Some(value) = checked.download.constant(expr) else { continue };
        let (Definition::X { field, .. } | Definition::Y { field, .. }) =
            definition(checked, number.into())
        else {
            continue;
        };
        let (low, high) = range(field);
        let rounded = value.round();
        if (low..=high).contains(&rounded) {
            continue;
        }
        let bits = if field.width == 1 { "bit" } else { "bits" };
        let message = format!(
            "M{number} has {} {bits}, which hold {low} to {high}: {value} does not fit",
            field.width
        );
        checked.add(at, |span| {
            Diagnostic::warning("PMAC-W9", span, message)
                .note("the low bits of the value are stored")
                .help(format!("fix the value, or the width in the definition of M{number}"))
        });
    }
}

/// An M-variable's definition after load.
fn definition(checked: &Checked<'_>, number: u32) -> Definition {
    let Loaded { image, layout, sparse, .. } = checked.loaded;
    View { image, layout, sparse }.definition(number)
}

/// The values that are plainly meant for a field. Of an unsigned one that includes negative numbers
/// of as many bits, since -1 is the usual way to write all ones.
fn range(field: Field) -> (f64, f64) {
    let count = 2f64.powi(field.width.into());
    match field.format {
        Format::U => (-count / 2.0, count - 1.0),
        Format::S if field.width == 1 => (-1.0, 1.0),
        Format::S => (-count / 2.0, count / 2.0 - 1.0),
        Format::D | Format::C => (0.0, 10f64.powi((field.width / 4).into()) - 1.0),
    }
}

/// M-variables that programs name and that nothing in the download defines.
pub(super) fn undefined_m_variables(checked: &mut Checked<'_>) {
    let download = checked.download;
    let mut defined: Vec<(u32, u32)> = download
        .online
        .iter()
        .filter_map(|online| match online.action {
            Action::Define(first, count, _) => {
                Some((first.into(), u32::from(first) + u32::from(count.saturating_sub(1))))
            }
            _ => None,
        })
        .collect();
    defined.extend(download.defines.iter().map(|define| (define.first, define.last)));
    let is_defined =
        |number: u32| defined.iter().any(|(first, last)| (*first..=*last).contains(&number));
    let mut named: BTreeMap<u16, TextRange> = BTreeMap::new();
    let mut assigned: BTreeMap<u16, TextRange> = BTreeMap::new();
    for stmt in download.statements() {
        let ops = stmt.kind.expressions().flat_map(|expr| download.ops(expr));
        let read = ops.filter_map(|op| match *op {
            Op::Var(Kind::M, number) => Some(number),
            _ => None,
        });
        let written = match stmt.kind {
            StmtKind::Assign(Target::Var(Kind::M, number), _) => Some(number),
            _ => None,
        };
        if let Some(number) = written {
            assigned.entry(number).or_insert(stmt.at);
        }
        for number in read.chain(written) {
            named.entry(number).or_insert(stmt.at);
        }
    }
    // Where the download defines none, the definitions are in another file.
    let defines_some = !defined.is_empty();
    assigned.retain(|number, _| defines_some && !is_defined((*number).into()));
    named.retain(|number, _| !is_defined((*number).into()) && !assigned.contains_key(number));
    for (number, at) in assigned {
        let message = format!("M{number} is assigned, and nothing in this download defines it");
        checked.add(at, |span| {
            Diagnostic::warning("PMAC-W22", span, message)
                .note("without a definition it is a number of 21 bits that nothing else sees")
                .help(format!("add its definition, as in M{number}->Y:$FFC2,8,1, or its file"))
        });
    }
    for (number, at) in named {
        checked.add(at, |span| {
            Diagnostic::warning(
                "PMAC-W12",
                span,
                format!("M{number} is defined nowhere in this download"),
            )
            .note(
                "an M-variable without a definition is a number of 21 bits that nothing else sees",
            )
            .help(format!("add its definition, as in M{number}->Y:$FFC2,8,1, or its file"))
        });
    }
}

/// M-variables that are defined as inputs of the machine and that programs assign.
pub(super) fn inputs_assigned(checked: &mut Checked<'_>) {
    let mut assigned: BTreeMap<u16, TextRange> = BTreeMap::new();
    for stmt in checked.download.statements() {
        let StmtKind::Assign(Target::Var(Kind::M, number), _) = stmt.kind else { continue };
        if checked.loaded.layout.is_input(definition(checked, number.into())) {
            assigned.entry(number).or_insert(stmt.at);
        }
    }
    for (number, at) in assigned {
        let message = format!("M{number} is a machine input, so this has no effect outside");
        checked.add(at, |span| {
            Diagnostic::warning("PMAC-W23", span, message).help(format!(
                "assign an output, or correct the definition of M{number}: the machine outputs are Y:$FFC2,8 to 15"
            ))
        });
    }
}

/// A timer that counts down by itself.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Timer {
    /// One of the words X:$700 to Y:$701.
    Word {
        /// Its address.
        address: u32,
        /// Whether it is in X memory, not in Y.
        is_x: bool,
    },
    /// Turbo PMAC: the I-variable of this number, Isx11 or Isx12 of a coordinate system.
    Variable(u16),
}

/// Timers that two PLCs write, so that each disturbs the other's waiting.
pub(super) fn shared_timers(checked: &mut Checked<'_>) {
    let mut writers: BTreeMap<Timer, Vec<(bool, u32, String, TextRange)>> = BTreeMap::new();
    for (compiled, number, buffer) in checked.download.programs() {
        for stmt in &buffer.code {
            let StmtKind::Assign(Target::Var(kind, variable), _) = stmt.kind else { continue };
            if let Some(timer) = timer(checked, kind, variable) {
                let name = variable_name(kind, variable);
                writers.entry(timer).or_default().push((compiled, number, name, stmt.at));
            }
        }
    }
    for places in writers.into_values() {
        let mut programs = BTreeSet::new();
        let Some((first_compiled, first_number, ..)) = places.first().cloned() else { continue };
        programs.insert((first_compiled, first_number));
        for (compiled, number, name, at) in places {
            if !programs.insert((compiled, number)) {
                continue;
            }
            let other = program_name(first_compiled, first_number);
            let message = format!("the timer {name} is written by {other} too");
            checked.add(at, |span| {
                Diagnostic::warning("PMAC-W14", span, message)
                    .note("the one that writes it later changes how long the other one waits")
                    .help("give each PLC a timer of its own")
            });
        }
    }
}

/// The timer that a variable stands for; `None` if it is none.
fn timer(checked: &Checked<'_>, kind: Kind, number: u16) -> Option<Timer> {
    let turbo = checked.download.controller == Controller::Turbo;
    match kind {
        Kind::I => (turbo && (5111..=6612).contains(&number) && matches!(number % 100, 11 | 12))
            .then_some(Timer::Variable(number)),
        Kind::M if !turbo => {
            let (is_x, address) = match definition(checked, number.into()) {
                Definition::X { address, field } if field.width == 24 => (true, address),
                Definition::Y { address, field } if field.width == 24 => (false, address),
                _ => return None,
            };
            (0x700..=0x701).contains(&address).then_some(Timer::Word { address, is_x })
        }
        Kind::L if !turbo => match checked.download.l_defs.get(&number)? {
            Definition::X { address: address @ 0x700..=0x701, .. } => {
                Some(Timer::Word { address: *address, is_x: true })
            }
            Definition::Y { address: address @ 0x700..=0x701, .. } => {
                Some(Timer::Word { address: *address, is_x: false })
            }
            _ => None,
        },
        _ => None,
    }
}

/// Bits of memory or of outputs that programs write by two M-variables, so that the one that is written later decides.
pub(super) fn same_bit_twice(checked: &mut Checked<'_>) {
    let mut writers: BTreeMap<(bool, u32, u8), Vec<(u16, TextRange)>> = BTreeMap::new();
    for stmt in checked.download.statements() {
        let StmtKind::Assign(Target::Var(Kind::M, number), _) = stmt.kind else { continue };
        let place = match definition(checked, number.into()) {
            Definition::X { address, field } if field.width == 1 => (true, address, field.offset),
            Definition::Y { address, field } if field.width == 1 => (false, address, field.offset),
            _ => continue,
        };
        let writers = writers.entry(place).or_default();
        if writers.iter().all(|(other, _)| *other != number) {
            writers.push((number, stmt.at));
        }
    }
    for ((is_x, address, bit), writers) in writers {
        let Some((&(first, _), others)) = writers.split_first() else { continue };
        for &(number, at) in others {
            let place = format!("{}:${address:04X},{bit}", if is_x { "X" } else { "Y" });
            let message =
                format!("M{number} and M{first} are the same bit, {place}, and both are written");
            checked.add(at, |span| {
                Diagnostic::warning("PMAC-W20", span, message).help(format!(
                    "write M{first} in the place of M{number}, or correct one of the definitions"
                ))
            });
        }
    }
}
