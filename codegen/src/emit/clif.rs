//! CLIF (Cranelift's IR) as text, with the source's statements as comments.

use std::fmt::{self, Write as _};

use cranelift_codegen::entity::SecondaryMap;
use cranelift_codegen::ir::{Block, Function, Inst, SourceLoc, Value};
use cranelift_codegen::write::{FuncWriter, PlainWriter, decorate_function};
use cranelift_frontend::FunctionBuilderContext;
use plcc_ir::Module;

use super::source;
use crate::{CodegenError, CodegenOptions, Target, lower};

/// A verified module's CLIF as it is handed to Cranelift.
///
/// # Errors
/// When the module breaks a rule of the verifier.
pub fn clif(
    module: &Module,
    target: &Target,
    options: CodegenOptions,
) -> Result<String, CodegenError> {
    let mut out = format!("; CLIF for {}, before Cranelift's passes\n", target.triple());
    let mut builder_context = FunctionBuilderContext::new();
    for (_, func) in module.funcs() {
        let mut function = Function::new();
        lower::function(module, func, &*target.isa, options, &mut function, &mut builder_context)?;
        // `FunctionBuilder` makes aliases of values for its variables; the listing has none.
        function.dfg.resolve_all_aliases();
        let mut locs = SecondaryMap::with_default(SourceLoc::default());
        for block in function.layout.blocks() {
            for inst in function.layout.block_insts(block) {
                locs[inst] = function.srcloc(inst);
            }
        }
        // Otherwise each line would begin with a statement's number; comments say it instead.
        function.srclocs.clear();
        let mut writer = Commented { module, locs, last: SourceLoc::default() };
        let _ = writeln!(out, "\n{}", source::entries(module, func).trim_start());
        // Writing to a string can't fail.
        let _ = decorate_function(&mut writer, &mut out, &function);
    }
    Ok(out)
}

/// Writes CLIF with a comment at each instruction that begins another statement.
struct Commented<'a> {
    module: &'a Module,
    locs: SecondaryMap<Inst, SourceLoc>,
    last: SourceLoc,
}

impl FuncWriter for Commented<'_> {
    fn write_block_header(
        &mut self,
        w: &mut dyn fmt::Write,
        func: &Function,
        block: Block,
        indent: usize,
    ) -> fmt::Result {
        self.last = SourceLoc::default();
        PlainWriter.write_block_header(w, func, block, indent)
    }

    fn write_instruction(
        &mut self,
        w: &mut dyn fmt::Write,
        func: &Function,
        aliases: &SecondaryMap<Value, Vec<Value>>,
        inst: Inst,
        indent: usize,
    ) -> fmt::Result {
        let loc = self.locs[inst];
        if loc != self.last && !loc.is_default() {
            self.last = loc;
            if let Some(comment) = source::comment(self.module, loc.bits()) {
                writeln!(w, "{:indent$}{comment}", "")?;
            }
        }
        PlainWriter.write_instruction(w, func, aliases, inst, indent)
    }
}
