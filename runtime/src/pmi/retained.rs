//! The variables that survive power-off: `@NVFLG`, `@NVINT` and `@NVLNG` (PMI 3.4), each with its
//! name, its type and its values.

use std::ops::Range;

use plcc_abi::pmi::{Symbol, Type};
use serde::Deserialize;
use serde::ser::{Serialize, SerializeSeq, Serializer};

use crate::Restored;

use super::PmiExecutive;
use super::events::value;
use super::tick::write;

/// A retained variable's values, as they are read.
#[derive(Deserialize)]
struct Kept {
    name: String,
    ty: Type,
    values: Vec<i32>,
}

/// The retained variables of a control, to be written as a row of [`Kept`].
struct RetainedVariables<'a>(&'a PmiExecutive);

impl Serialize for RetainedVariables<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let retained = || self.0.names.symbols.iter().filter(|symbol| symbol.retained);
        let mut row = serializer.serialize_seq(Some(retained().count()))?;
        for symbol in retained() {
            row.serialize_element(&(&symbol.name, symbol.ty, Values(self.0, symbol)))?;
        }
        row.end()
    }
}

/// The values of a variable, one or those of an array's elements.
struct Values<'a>(&'a PmiExecutive, &'a Symbol);

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(control, symbol) = self;
        let count = symbol.elements.unwrap_or(1);
        let mut row = serializer.serialize_seq(Some(count as usize))?;
        for at in (0..count).map(|index| symbol.offset + index * symbol.ty.size()) {
            row.serialize_element(&value(&control.image, symbol.ty, at))?;
        }
        row.end()
    }
}

impl PmiExecutive {
    /// Appends the values of all retained variables, and says whether that was possible.
    pub(super) fn append_retained(&self, out: &mut Vec<u8>) -> bool {
        crate::retained::append_postcard(out, &RetainedVariables(self))
    }

    /// Takes back the values of the retained variables that this program has too.
    ///
    /// # Errors
    /// When the bytes are not such values; nothing is changed then.
    pub(super) fn take_retained(&mut self, retained: &[u8]) -> Result<Restored, String> {
        let (kept, rest): (Vec<Kept>, _) = postcard::take_from_bytes(retained)
            .map_err(|_| "it does not hold non-volatile variables".to_owned())?;
        if !rest.is_empty() {
            return Err("it does not hold non-volatile variables".to_owned());
        }
        let mut restored = Restored::default();
        let mut found = Vec::new();
        for kept in &kept {
            let same = |symbol: &&Symbol| {
                symbol.retained && symbol.name == kept.name && symbol.ty == kept.ty
            };
            let Some(symbol) = self.names.symbols.iter().find(same) else {
                restored.gone.push(kept.name.clone());
                continue;
            };
            found.push(symbol.name.clone());
            let mut offset = symbol.offset;
            let count = symbol.elements.unwrap_or(1) as usize;
            for &value in kept.values.iter().take(count) {
                write(&mut self.image, kept.ty, offset, value.into());
                offset += kept.ty.size();
            }
            let held = kept.values.len();
            restored.kept += held.min(count);
            let elements = |range: Range<usize>| {
                let last = range.end.saturating_sub(1);
                (!range.is_empty()).then(|| format!("{}[{}] to [{last}]", kept.name, range.start))
            };
            restored.gone.extend(elements(count..held));
            restored.new.extend(elements(held..count));
        }
        let retained = self.names.symbols.iter().filter(|symbol| symbol.retained);
        let new = retained.filter(|symbol| !found.contains(&symbol.name));
        restored.new.extend(new.map(|symbol| symbol.name.clone()));
        restored.other_program = !restored.is_complete();
        Ok(restored)
    }
}
