//! Forces: words and fields of memory that are held at a value (`plcctl force`).
//!
//! A PMAC latches nothing: its inputs and outputs are memory that the hardware writes or reads, and
//! programs reach it through the definitions of M-variables. A force writes its field before each
//! servo cycle, for inputs, and after it, for outputs.

use plcc_abi::pmac::{Definition, Memory, PmacName};
use serde::{Deserialize, Serialize};

use crate::force_list::{ForceList, ONE_BIT};

/// A force on one field of memory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Force {
    /// Where the variable was when it was forced.
    field: Definition,
    value: f64,
}

/// The forces in effect.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Forces {
    /// By the names of their variables.
    list: ForceList<PmacName, Force>,
}

/// Whether two variables have bits of a word of memory in common.
pub(super) fn share_bits(a: Definition, b: Definition) -> bool {
    let bits = |definition| match definition {
        Definition::X { address, field } => Some((true, address, field)),
        Definition::Y { address, field } => Some((false, address, field)),
        _ => None,
    };
    let (Some((a_is_x, a_address, a)), Some((b_is_x, b_address, b))) = (bits(a), bits(b)) else {
        return false;
    };
    (a_is_x, a_address) == (b_is_x, b_address)
        && a.offset < b.offset.saturating_add(b.width)
        && b.offset < a.offset.saturating_add(a.width)
}

impl Forces {
    /// Forces the variable of a name, which now is at `field`.
    ///
    /// # Errors
    /// When it is not in a word of memory, or shares bits with another one that is forced, or there are too
    /// many forces.
    pub(super) fn set(
        &mut self,
        name: PmacName,
        field: Option<Definition>,
        value: f64,
    ) -> Result<(), &'static str> {
        let Some(field @ (Definition::X { field: bits, .. } | Definition::Y { field: bits, .. })) =
            field
        else {
            return Err("is not a field of an X or Y word of memory, and can't be forced");
        };
        if bits.width == 1 && value != 0.0 && value != 1.0 {
            return Err(ONE_BIT);
        }
        let shares =
            |(other, force): (&PmacName, &Force)| *other != name && share_bits(force.field, field);
        if self.list.entries().any(shares) {
            return Err("shares bits with a variable that is forced; end that force first");
        }
        self.list.set(name, Force { field, value })
    }

    /// The forced variables with their values.
    pub(super) fn values(&self) -> impl Iterator<Item = (PmacName, f64)> + '_ {
        self.list.entries().map(|(&name, force)| (name, force.value))
    }

    /// Makes room for all forces there can be, as at power-up, so that forcing allocates nothing.
    /// `None` where there are more than that.
    pub(super) fn with_room(self) -> Option<Self> {
        Some(Self { list: self.list.with_room()? })
    }

    /// Ends the force on the variable of a name.
    pub(super) fn remove(&mut self, name: PmacName) {
        self.list.remove(&name);
    }

    /// Whether all bits of a variable that now is at `field` are forced.
    pub(super) fn hold(&self, field: Definition) -> bool {
        let bits = |definition| match definition {
            Definition::X { field, .. } | Definition::Y { field, .. } => {
                let ones = (1_u64 << field.width.min(48)) - 1;
                ones << field.offset.min(15)
            }
            _ => 0,
        };
        let sharing = self.list.iter().filter(|force| share_bits(force.field, field));
        let forced = sharing.fold(0, |all, force| all | bits(force.field));
        forced != 0 && bits(field) & !forced == 0
    }

    /// Writes all forced fields.
    pub(super) fn apply(&self, memory: &mut Memory<'_>) {
        for force in self.list.iter() {
            memory.write(force.field, force.value);
        }
    }
}
