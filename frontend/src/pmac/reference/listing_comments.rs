//! The comments of listings: what the guide's appendices say of the variables that a program names.

use std::collections::HashMap;
use std::fmt::Write;
use std::sync::OnceLock;

use plcc_abi::pmac::{Definition, Field, Format, Kind, Layout, PmacTables, Run, View};

use super::describe::{accepted_values, meaning_of_member};
use super::tables::{MVariable, i_variable, m_variables};
use crate::common::Controller;

/// A line for each I-variable of appendix B that the program names, and for each M-variable whose
/// definition after load is that of an M-variable of appendices E and F, whatever its number. The
/// memory of Turbo PMAC has other addresses, so its M-variables have no comments.
pub fn listing_comments(tables: &PmacTables) -> Vec<String> {
    let controller = tables.controller;
    let layout = Layout::new(controller);
    let mut image = vec![0; layout.size as usize];
    Run::unpack(&tables.initial, &mut image);
    let view = View { image: &image, layout: &layout, sparse: &tables.sparse };
    let of = |kind: Kind, number: u32| match kind {
        Kind::I => {
            let (row, member) = i_variable(controller, number)?;
            let member = Some(member);
            let mut comment = format!(
                "I{number}: {} ({}",
                meaning_of_member(row, member),
                accepted_values(row, member)
            );
            if row.unit != "none" {
                let _ = write!(comment, "; unit: {}", row.unit);
            }
            Some(comment + ")")
        }
        Kind::M if controller == Controller::Pmac => {
            let definition = text(view.definition(number))?;
            let row = suggested(&definition)?;
            let mut comment = format!("M{number}->{definition}: {}", row.meaning);
            if row.number != number {
                let _ = write!(comment, " (the guide's M{})", row.number);
            }
            Some(comment)
        }
        _ => None,
    };
    tables.named.iter().filter_map(|name| of(name.kind, name.number)).collect()
}

/// The M-variable that the guide suggests with a definition.
fn suggested(definition: &str) -> Option<&'static MVariable> {
    static ROWS: OnceLock<HashMap<&'static str, &'static MVariable>> = OnceLock::new();
    let rows = ROWS.get_or_init(|| m_variables().iter().map(|row| (row.definition, row)).collect());
    rows.get(definition).copied()
}

/// A definition as the appendices write it; `None` for kinds that they do not have.
fn text(definition: Definition) -> Option<String> {
    let word = |space: char, address: u32, field: Field| {
        let mut text = format!("{space}:${address:X},{},{}", field.offset, field.width);
        if field.width > 1 {
            text.push_str(match field.format {
                Format::U => ",U",
                Format::S => ",S",
                Format::D => ",D",
                Format::C => ",C",
            });
        }
        text
    };
    match definition {
        Definition::X { address, field } => Some(word('X', address, field)),
        Definition::Y { address, field } => Some(word('Y', address, field)),
        Definition::D { address } => Some(format!("D:${address:X}")),
        Definition::L { address } => Some(format!("L:${address:X}")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{MemoryLoader, Options};
    use crate::pmac::check;

    fn of(source: &str, controller: Controller) -> Vec<String> {
        let mut map = plcc_diag::SourceMap::new();
        let file = map.add("m.pmc", source.as_bytes());
        let options = Options { controller, ..Options::default() };
        let (program, _) = check(&mut map, &[file], &MemoryLoader::new(), &options);
        let plcc_abi::Tables::Pmac(tables) = program.unwrap().lower().unwrap().program.tables
        else {
            panic!("not PMAC");
        };
        listing_comments(&tables)
    }

    #[test]
    fn variables_that_a_program_names_have_comments() {
        let text = "M7->Y:$0814,10,1 M20->Y:$FFC0,8 M11->Y:$FFC2,5 M101->X:$C001,24,S\n\
                    M145->Y:$0814,10,1 M102->*\nI5=2\nOPEN PLC 1 CLEAR\n\
                    IF (M20=1 AND M11=1) M7=M101+M102+M9 I122=P1 I46=1 ENDIF CLOSE\n";
        assert_eq!(
            of(text, Controller::Pmac),
            [
                "I5: which PLCs run: 1 PLC0 and PLCC0, 2 those from 1 to 31, 3 all, 0 none \
                 (integers 0 to 3, rolls over, default 0)",
                "I122: motor 1: jog speed (positive floating point, default 32; unit: counts/ms)",
                "M7->Y:$814,10,1: motor 1: homing is complete (the guide's M145)",
                "M11->Y:$FFC2,5,1: machine input 6 (the guide's M16)",
                "M20->Y:$FFC0,8,1: control panel: jog minus",
                "M101->X:$C001,0,24,S: channel 1: the encoder counter's 24 bits, in counts",
            ]
        );
        let text = "M145->Y:$0814,10,1\nI5=2\nOPEN PLC 1 CLEAR\nM145=1 I5111=5 CLOSE\n";
        let comments = of(text, Controller::Turbo);
        assert_eq!(comments.len(), 2, "{comments:?}");
        assert!(comments[1].starts_with("I5111: coordinate system 1: PLC timer 1"), "{comments:?}");
    }

    #[test]
    fn every_suggested_definition_is_found() {
        let mut text = String::from("OPEN PLC 1 CLEAR\n");
        let mut definitions = String::new();
        for row in m_variables() {
            let _ = writeln!(definitions, "M{}->{}", row.number, row.definition);
            let _ = writeln!(text, "P1=M{}", row.number);
        }
        let comments = of(&format!("{definitions}{text}CLOSE\n"), Controller::Pmac);
        assert_eq!(comments.len(), m_variables().len());
        for (comment, row) in comments.iter().zip(m_variables()) {
            assert_eq!(*comment, format!("M{}->{}: {}", row.number, row.definition, row.meaning));
        }
    }
}
