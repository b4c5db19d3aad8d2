//! What every front end makes of a program: the tables and the code.

/// A program as the code generator and the executive take it.
#[derive(Clone, Debug)]
pub struct Lowered {
    /// For the executive: layout, tasks, tables.
    pub program: plcc_abi::Program,
    /// The code.
    pub module: plcc_ir::Module,
    /// Where subroutines find out where to return to, if the program has any: for [`bounds`](plcc_ir::bound::bounds).
    pub return_stack: Option<plcc_ir::bound::ReturnStack>,
}
