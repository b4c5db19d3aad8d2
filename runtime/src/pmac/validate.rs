//! Whether the tables of a PMAC program fit its image.

use std::sync::Arc;

use plcc_abi::pmac::{Definition, Field, Kind, Layout, Output, PmacTables, Run, Statement, Text};
use plcc_abi::{Program, Tables};

use crate::control::Control;
use crate::names::Names;
use crate::online_change::Comparison;
use crate::table_check::{Check, Image, ensure};

use super::names::PmacNames;

impl Control for PmacTables {
    fn validate(&self, program: &Program) -> Result<(), String> {
        tables(self, Image::new(program.image_size))
    }

    fn names(&self, _program: &Program) -> Arc<dyn Names> {
        Arc::new(PmacNames::new(self))
    }

    fn compare(&self, _old: &Program, new: &Program) -> Option<Result<Comparison, String>> {
        let Tables::Pmac(is) = &new.tables else { return None };
        Some(super::transfer::compare(self, is))
    }
}

/// Checks numbers, definitions and the order of the tables, and that the image is long enough.
fn tables(tables: &PmacTables, image: Image) -> Check {
    let PmacTables {
        controller,
        programs,
        texts,
        defines,
        statements,
        ranges,
        l,
        named,
        initial,
        sparse: _,
        save: _,
        outputs,
        motion,
    } = tables;
    let layout = Layout::new(*controller);
    ensure(u64::from(layout.size) <= image.size, || "its image is too short".into())?;
    for program in programs {
        ensure(program.number < 32, || "it has a PLC beyond 31".into())?;
    }
    for text in texts {
        if let Text::Value { position: _, width, decimals } = *text {
            ensure(width <= 255 && decimals <= 255, || "a DISPLAY is too wide".into())?;
        }
    }
    for define in defines {
        let fits = define.first <= define.last && define.last < layout.count;
        ensure(fits && sound(define.definition), || {
            "a definition names bits or variables that do not exist".into()
        })?;
    }
    let assigned = |statement: &Statement| statement.target.map(|(_, number)| number);
    let fits = |statement: &Statement| {
        assigned(statement).is_none_or(|number| u32::from(number) < layout.count)
    };
    ensure(statements.iter().all(fits), || "a statement assigns to no variable".into())?;
    let rising = ranges.is_sorted_by_key(|&(number, _)| number)
        && l.is_sorted_by_key(|&(number, _)| number)
        && l.iter().all(|&(_, definition)| sound(definition));
    ensure(rising, || "its tables of variables are out of order".into())?;
    for variable in named {
        let fits = match variable.kind {
            Kind::Q => (1..=layout.systems()).contains(&variable.system),
            _ => variable.system == 1,
        };
        ensure(fits && variable.number < layout.count, || {
            "it names a variable that does not exist".into()
        })?;
    }
    let numbered = |output: &Output| output.variable.is_none_or(|v| v.number < layout.count);
    ensure(outputs.iter().all(|output| numbered(output) && sound(output.definition)), || {
        "it has a physical output that does not exist".into()
    })?;
    for Run { offset, bytes } in initial {
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        image.check(*offset, length, "its initial state")?;
    }
    for Run { offset, bytes } in &motion.image {
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        image.check(*offset, length, "its initial state")?;
    }
    let motors = plcc_abi::pmac::motion::registers::motors(*controller);
    let definitions = motion.definitions.iter().all(|(motor, own)| {
        (1..=motors).contains(&u32::from(*motor))
            && (1..=layout.systems()).contains(&u32::from(own.system))
    });
    ensure(definitions, || "it defines axes of motors that do not exist".into())?;
    let rising = motion.programs.is_sorted_by_key(|program| program.number)
        && motion.programs.iter().all(|p| p.labels.is_sorted_by_key(|(label, _)| *label));
    ensure(rising, || "its motion programs are out of order".into())
}

/// Whether a definition's bits are those of a word.
fn sound(definition: Definition) -> bool {
    match definition {
        Definition::X { field, .. } | Definition::Y { field, .. } => {
            let Field { offset, width, format: _ } = field;
            offset < 24 && (1..=24 - offset).contains(&width)
        }
        _ => true,
    }
}
