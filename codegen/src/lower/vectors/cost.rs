//! Estimates how many instructions rows take.

use plcc_ir::Type;

use super::row::{Chain, Format, Node, StoredRow};

impl Node {
    /// An estimate of the number of instructions that compute it.
    pub(super) fn cost(&self) -> usize {
        match self {
            Self::Constants(..) => 0,
            Self::Load(_, ty, format) => 1 + usize::from(!format.is_plain(*ty)),
            Self::Gather(addresses, ty, format) => {
                addresses.len() + 1 + usize::from(!format.is_plain(*ty))
            }
            Self::Select(..) | Self::Splat(..) | Self::SplatLoad(..) => 3,
            Self::Compare(..) => 2,
            Self::Unary(..) | Self::Binary(..) | Self::Extend(..) => 1,
        }
    }
}

impl Format {
    /// Whether the bytes of values of a type are the same in a vector of this format as in the image.
    fn is_plain(self, ty: Type) -> bool {
        match self {
            Self::Truths(_) => true,
            Self::Integers(own) => own == ty,
        }
    }
}

impl StoredRow {
    /// An estimate of the number of instructions that store it.
    pub(super) fn cost(&self) -> usize {
        if self.format.is_plain(self.ty) { 1 } else { 3 }
    }
}

impl Chain {
    /// An estimate of the number of instructions that compute it.
    pub(super) fn cost(&self) -> usize {
        8 + 5 * self.rows.len()
    }
}
