//! What every front end makes of a program: the tables and the code.

/// A program as the code generator and the executive take it.
#[derive(Clone, Debug)]
pub struct Lowered {
    /// For the executive: layout, tasks, tables.
    pub program: plcc_abi::Program,
    /// The code.
    pub module: plcc_ir::Module,
    /// Where subroutines find out where to return to, if the program has any. Who looks for the longest way through the
    /// code needs it.
    pub return_stack: Option<ReturnStack>,
}

/// Where return labels are kept in the process image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReturnStack {
    /// The region.
    pub region: plcc_ir::RegionId,
    /// The offset in it of the array of labels, 32 bits each.
    pub offset: u32,
    /// How many calls can be open.
    pub depth: u32,
    /// Where an indirect call stores the label to return to, if it is not the call itself that pushes
    /// the label but code that several calls share: the region and the offset. Such a label is pending
    /// until that code pushes it.
    pub pending: Option<(plcc_ir::RegionId, u32)>,
}
