//! What the control does around the statements (rulings, Scan): inputs in groups, timers, outputs in groups, and a stop.

use plcc_abi::pmi::{Format, Lines, TimerKind};
use plcc_iec::{Flow, comment};

use super::Own;
use super::variables::Variables;
use crate::pmi::ast::{Checked, Meaning, SymbolId};

/// The whole body of the program. `rest` are the comments after the last statement.
pub(super) fn body(
    checked: &Checked,
    variables: &mut Variables<'_>,
    own: &Own,
    flow: &Flow<'_>,
    rest: &[String],
) -> Vec<String> {
    let mut lines = vec![];
    if own.stops {
        lines.push(format!("IF {} <> 0 THEN", own.stop));
        lines.push("  RETURN;".into());
        lines.push("END_IF;".into());
    }
    before(checked, variables, own, &mut lines);
    let while_true = match own.stops {
        true => format!("({} <> 0) AND ({} = 0)", own.next, own.stop),
        false => format!("{} <> 0", own.next),
    };
    let statements = flow.text(&while_true, &[]);
    if flow.has_blocks() {
        lines.push(format!("{} := 1;", own.next));
        lines.extend(statements);
    } else if statements.iter().any(|line| line.trim_start() == "EXIT;") {
        // A scan that ends early leaves the loop, which has one round.
        lines.push("REPEAT".into());
        lines.extend(statements.iter().map(|line| format!("  {line}")));
        lines.push("UNTIL TRUE".into());
        lines.push("END_REPEAT;".into());
    } else {
        lines.extend(statements);
    }
    lines.extend(rest.iter().map(|text| comment(text)));
    after(checked, variables, own, &mut lines);
    lines
}

/// Constant arrays, inputs whose lines are others' too, groups, and the time of the timers.
fn before(checked: &Checked, variables: &Variables<'_>, own: &Own, lines: &mut Vec<String>) {
    let tables = variables.tables();
    if !tables.is_empty() {
        lines.push(comment("Constant arrays"));
        lines.push(format!("IF {} THEN", own.first));
        lines.extend(tables.iter().map(|line| format!("  {line}")));
        lines.push("END_IF;".into());
    }
    let mut latch = vec![];
    for (id, symbol) in (0..).map(SymbolId).zip(&checked.symbols) {
        let (Meaning::Input(of), name) = (&symbol.meaning, variables.name(id)) else { continue };
        if name.is_empty() {
            continue;
        }
        if of.format != Format::Bit {
            latch.push(format!("{name} := {};", decoded(variables, *of)));
        } else if let Some(line) = variables.input_lines.get(&(of.port, of.low))
            && line != name
        {
            latch.push(format!("{name} := {line};"));
        }
    }
    if !latch.is_empty() {
        lines.push(comment("Inputs"));
        lines.extend(latch);
    }
    if let Some(name) = variables.of_the_control("@IPL") {
        lines.push(format!("{name} := {};", own.first));
    }
    if !checked.timers.is_empty() {
        lines.push(comment("Timers that run go down by 20 ms"));
    }
    for (timer, count) in checked.timers.iter().zip(&own.counters) {
        let delayed = variables.name(timer.delayed);
        let then = if timer.kind == TimerKind::E { "TRUE" } else { "FALSE" };
        lines.push(format!("IF {count} > 0 THEN"));
        lines.push(format!("  {count} := {count} - 1;"));
        lines.push(format!("  IF {count} = 0 THEN"));
        lines.push(format!("    {delayed} := {then};"));
        lines.push("  END_IF;".into());
        lines.push("END_IF;".into());
    }
}

/// The weight of each line of a group, the lowest first. BCD digits above 9 count with their weights too.
fn weights(lines: Lines) -> Vec<i32> {
    (0..lines.count)
        .map(|bit| match lines.format {
            Format::Bit | Format::Binary => 1 << bit,
            Format::Bcd if bit < 4 => 1 << bit,
            Format::Bcd => 10 << (bit - 4),
            Format::TwosComplement if bit + 1 == lines.count => -(1 << bit),
            Format::TwosComplement => 1 << bit,
        })
        .collect()
}

/// The value of a group of inputs, as a sum of its lines with their weights.
fn decoded(variables: &Variables<'_>, lines: Lines) -> String {
    let mut text = String::new();
    for (bit, weight) in (lines.low..).zip(weights(lines)) {
        let line = variables.input_lines.get(&(lines.port, bit)).map_or("FALSE", String::as_str);
        let sign = match (text.is_empty(), weight < 0) {
            (true, false) => "",
            (true, true) => "0 - ",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        let times = match weight.unsigned_abs() {
            1 => String::new(),
            weight => format!("{weight} * "),
        };
        text.push_str(&format!("{sign}{times}BOOL_TO_INT({line})"));
    }
    text
}

/// Groups of outputs, the end of a pulse of @CRSET, and what a stop does: all lines of outputs are off, and @ESTOP is on.
fn after(checked: &Checked, variables: &mut Variables<'_>, own: &Own, lines: &mut Vec<String>) {
    let mut drive = vec![];
    for (id, symbol) in (0..).map(SymbolId).zip(&checked.symbols) {
        let (Meaning::Output(of), name) = (&symbol.meaning, variables.name(id)) else { continue };
        if of.format == Format::Bit || name.is_empty() {
            continue;
        }
        let value = match of.format {
            Format::Bcd => format!("INTEGER_BCD({name})"),
            _ => name.to_owned(),
        };
        for bit in 0..of.count {
            let line = variables.output_lines.get(&(of.port, of.low + bit));
            let line = line.map_or("", String::as_str);
            drive.push(format!("{line} := INTEGER_BIT({value}, {});", 1_u32 << bit));
        }
    }
    if own.stops {
        lines.push(format!("IF {} <> 0 THEN", own.stop));
        lines.push(format!("  {}", comment("The control is in emergency stop")));
        if let Some(name) = variables.of_the_control("@ESTOP") {
            lines.push(format!("  {name} := TRUE;"));
        }
        lines.extend(variables.output_lines.values().map(|line| format!("  {line} := FALSE;")));
        lines.push("  RETURN;".into());
        lines.push("END_IF;".into());
    }
    if !drive.is_empty() {
        lines.push(comment("Outputs"));
        lines.extend(drive);
    }
    if let Some(name) = variables.of_the_control("@CRSET") {
        lines.push(format!("{name} := FALSE;"));
    }
    if variables.needs_first_scan() {
        lines.push(format!("{} := FALSE;", own.first));
    }
}
