//! Doubles that a function keeps in registers because it uses them often.
//!
//! A double as an operand is loaded from the constants after the code, and processors load fewer vectors in a cycle
//! than they add and multiply. A statement on three variables has three or four constants, counting the 0 that is
//! added lest a variable hold -0. So the constants that code uses most are loaded where the function is entered.
//! Cold blocks load what they need themselves; after a call of the host in one of them, the registers are loaded
//! again, so that no constant need survive that call in the stack frame. This is the technique `double-constants`.

use cranelift_codegen::ir::{Value as ClifValue, types};
use cranelift_frontend::{FunctionBuilder, Variable};
use plcc_ir::passes::thresholds::double_constants::{MAX_CONSTANTS, MIN_USES};
use plcc_ir::{FuncData, InstData, Value};

use super::Lowering;
use crate::CodegenOptions;

/// The uses of no more constants than this are counted, so that the search takes linear time.
const MAX_COUNTED: usize = 64;

/// The constants of a function that are kept in registers: their bits, each with the variable.
pub(super) type DoubleConstants = Vec<(u64, Variable)>;

/// Chooses a function's constants. There are none where code calls the host outside of cold blocks, since a call
/// leaves no register for doubles as it was.
pub(super) fn choose(
    func: &FuncData,
    builder: &mut FunctionBuilder<'_>,
    options: CodegenOptions,
) -> DoubleConstants {
    let mut counts: Vec<(u64, u32)> = vec![];
    let mut insts = func.blocks().flat_map(|(_, block)| &block.insts);
    if !options.double_constants
        || func.is_optimized_for_size()
        || !insts.any(|&inst| matches!(func.inst(inst), InstData::Fconst { .. }))
    {
        return vec![];
    }
    for (_, block) in func.blocks().filter(|(_, block)| !block.cold) {
        for &inst in &block.insts {
            let data = func.inst(inst);
            if matches!(data, InstData::HostCall { .. }) {
                return vec![];
            }
            data.for_each_arg(|value| {
                let Some(&InstData::Fconst { bits }) = func.def_inst(value) else { return };
                if let Some((_, count)) = counts.iter_mut().find(|(known, _)| *known == bits) {
                    *count += 1;
                } else if counts.len() < MAX_COUNTED {
                    counts.push((bits, 1));
                }
            });
        }
    }
    counts.retain(|&(_, count)| count >= MIN_USES);
    counts.sort_unstable_by_key(|&(bits, count)| (std::cmp::Reverse(count), bits));
    counts.truncate(MAX_CONSTANTS);
    counts.into_iter().map(|(bits, _)| (bits, builder.declare_var(types::F64))).collect()
}

impl Lowering<'_> {
    /// Loads the constants into their registers.
    pub(super) fn materialise_constants(&mut self) {
        for (bits, variable) in self.double_constants.clone() {
            let value = self.pooled_constant(bits);
            self.builder.def_var(variable, value);
        }
    }

    /// The register that holds a constant double, if there is one and the current block may use it.
    pub(super) fn double_in_register(&mut self, value: Value) -> Option<ClifValue> {
        if self.cold || self.double_constants.is_empty() {
            return None;
        }
        let Some(&InstData::Fconst { bits }) = self.func.def_inst(value) else { return None };
        let (_, variable) = *self.double_constants.iter().find(|(known, _)| *known == bits)?;
        Some(self.builder.use_var(variable))
    }
}
