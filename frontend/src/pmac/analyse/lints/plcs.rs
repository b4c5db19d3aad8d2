//! Lints about whole PLCs and what they send: `plc-never-runs`, `plc-never-enabled`, `repeats-every-scan`,
//! `empty-command`, `position-beyond-display`.

use plcc_abi::image::read_f64;
use plcc_abi::pmac::{Kind, PlcOp, Text};
use plcc_diag::Diagnostic;

use super::Checked;
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Action, Buffer, StmtKind, Target, program_name};

/// The variable that says which PLCs run.
const I5: u32 = 5;
/// The number of characters that the display shows, in two rows of 40 (guide, DISPLAY).
const DISPLAY_LENGTH: u32 = 80;

/// Whether an assignment's target is I5, or may be.
fn may_be_i5(target: Target) -> bool {
    match target {
        Target::Var(kind, number) => kind == Kind::I && u32::from(number) == I5,
        Target::Indirect(kind, _) => kind == Kind::I,
        Target::Range { kind, first, .. } => kind == Kind::I && u32::from(first) <= I5,
    }
}

/// PLCs that I5, as the download leaves it, never runs (guide, I5: 1 runs PLC 0, 2 the others, 3 all).
/// Where nothing sets I5 at all, `PMAC-W2` says so.
pub(super) fn never_runs(checked: &mut Checked<'_>) {
    let set_by_load = checked.download.online.iter().any(|online| match online.action {
        Action::Assign(target, _) => may_be_i5(target),
        _ => false,
    });
    let set_by_program = checked
        .download
        .statements()
        .any(|stmt| matches!(stmt.kind, StmtKind::Assign(target, _) if may_be_i5(target)));
    if !set_by_load || set_by_program {
        return;
    }
    let i5 = read_f64(&checked.loaded.image, checked.loaded.layout.i_offset(I5));
    let (first, others) = (i5 == 1.0 || i5 == 3.0, i5 == 2.0 || i5 == 3.0);
    let programs: Vec<_> = checked
        .download
        .programs()
        .filter(|(_, number, buffer)| {
            !buffer.code.is_empty() && !(if *number == 0 { first } else { others })
        })
        .filter_map(|(compiled, number, buffer)| Some((compiled, number, buffer.opened?)))
        .collect();
    for (compiled, number, at) in programs {
        let name = program_name(compiled, number);
        let message = format!("{name} never runs: I5 is {i5} after this download");
        checked.add(at, |span| {
            Diagnostic::warning("PMAC-W15", span, message)
                .help("I5=1 runs PLC 0, I5=2 the PLCs 1 to 31, I5=3 all of them")
        });
    }
}

/// PLCs that are disabled after the download, where it has enabled others after it had disabled them, and that no program
/// enables. One that the text itself disables by its own number is meant so.
pub(super) fn never_enabled(checked: &mut Checked<'_>) {
    let enables = |op: PlcOp| matches!(op, PlcOp::Enable | PlcOp::Resume);
    let enabled_later = |compiled: bool, number: u32| {
        checked.download.statements().any(|stmt| match stmt.kind {
            StmtKind::Plc(op, set) => {
                enables(op) && set.compiled == compiled && set.bits >> number & 1 != 0
            }
            _ => false,
        })
    };
    // The set of the last on-line command that has disabled the program, and its place.
    let disabled_by = |compiled: bool, number: u32| {
        let commands = checked.download.online.iter().rev();
        let found = commands.filter_map(|online| match online.action {
            Action::Plc(PlcOp::Disable, set)
                if set.compiled == compiled && set.bits >> number & 1 != 0 =>
            {
                Some(set.bits)
            }
            _ => None,
        });
        found.into_iter().next()
    };
    let Loaded { plcs, plccs, .. } = checked.loaded;
    let mut places = vec![];
    for (compiled, number, buffer) in checked.download.programs() {
        let states = if compiled { plccs } else { plcs };
        let is_off = (states.enabled | states.paused) >> number & 1 == 0;
        if buffer.code.is_empty() || !is_off || enabled_later(compiled, number) {
            continue;
        }
        let by_all = disabled_by(compiled, number).is_some_and(|bits| bits.count_ones() > 1);
        if let (true, Some(at)) = (by_all, buffer.opened) {
            places.push((program_name(compiled, number), at));
        }
    }
    for (name, at) in places {
        let message =
            format!("{name} never runs: this download disables it, and nothing enables it");
        checked.add(at, |span| {
            Diagnostic::warning("PMAC-W24", span, message)
                .help(format!("write ENABLE {name} at the end of the download"))
        });
    }
}

/// For each statement of a program whether something before it decides if it is executed in a scan:
/// it is in an IF or after a WHILE.
fn conditional(buffer: &Buffer) -> Vec<bool> {
    let mut conditional = Vec::with_capacity(buffer.code.len());
    let mut until = 0;
    let mut waits = false;
    for (index, stmt) in (0u32..).zip(&buffer.code) {
        conditional.push(waits || index < until);
        match stmt.kind {
            StmtKind::If(_, target) => until = until.max(target),
            StmtKind::Jump(target) => until = until.max(target),
            StmtKind::While(..) => waits = true,
            StmtKind::Assign(..)
            | StmtKind::EndWhile(_)
            | StmtKind::Plc(..)
            | StmtKind::Address(..)
            | StmtKind::AddressBy(..)
            | StmtKind::Text(..)
            | StmtKind::Define(_)
            | StmtKind::Word(..)
            | StmtKind::Save
            | StmtKind::Motion(..)
            | StmtKind::Loop(..) => {}
        }
    }
    conditional
}

/// SEND, DISPLAY of a text, and COMMAND that are executed in every scan: in no IF, after no WHILE,
/// in a PLC that nothing disables.
pub(super) fn repeats_every_scan(checked: &mut Checked<'_>) {
    let disabled = |compiled: bool, number: u32| {
        checked.download.statements().any(|stmt| match stmt.kind {
            StmtKind::Plc(PlcOp::Disable | PlcOp::Pause, set) => {
                set.compiled == compiled && set.bits >> number & 1 != 0
            }
            _ => false,
        })
    };
    let mut places = Vec::new();
    for (compiled, number, buffer) in checked.download.programs() {
        if disabled(compiled, number) {
            continue;
        }
        for (stmt, conditional) in buffer.code.iter().zip(conditional(buffer)) {
            let StmtKind::Text(index, _) = stmt.kind else { continue };
            let what = match checked.download.texts.get(index as usize) {
                Some(Text::Send { .. }) => "SEND",
                Some(Text::Show { .. }) => "DISPLAY",
                Some(Text::Command { .. }) => "COMMAND",
                _ => continue,
            };
            if !conditional {
                places.push((what, program_name(compiled, number), stmt.at));
            }
        }
    }
    for (what, program, at) in places {
        let message = format!("this {what} is executed in every scan of {program}");
        checked.add(at, |span| {
            Diagnostic::warning("PMAC-W13", span, message)
                .help(format!("put it into an IF, or end the PLC with DISABLE {program}"))
        });
    }
}

/// COMMANDs without a command, and texts that reach beyond the display.
pub(super) fn texts(checked: &mut Checked<'_>) {
    let places: Vec<_> = checked
        .download
        .statements()
        .filter_map(|stmt| match stmt.kind {
            StmtKind::Text(index, _) => {
                Some((checked.download.texts.get(index as usize)?, stmt.at))
            }
            _ => None,
        })
        .collect();
    for (text, at) in places {
        let end = match text {
            Text::Command { text, .. } => {
                if text.trim().is_empty() {
                    checked.add(at, |span| {
                        Diagnostic::warning("PMAC-W16", span, "this COMMAND has no command")
                            .help("write the command between the quotes, or take the line out")
                    });
                }
                continue;
            }
            Text::Show { text, position } => position.saturating_add(text.chars().count() as u32),
            Text::Value { position, width, .. } => position.saturating_add(*width),
            _ => continue,
        };
        if end > DISPLAY_LENGTH {
            let message = format!("this reaches position {}: the display ends at 79", end - 1);
            checked.add(at, |span| {
                Diagnostic::warning("PMAC-W17", span, message)
                    .note("the display has two rows of 40 characters, positions 0 to 79")
                    .help("begin further left, or shorten it")
            });
        }
    }
}
