//! IR to CLIF (Cranelift's IR), function by function.
//!
//! [`function`] makes one CLIF function of one IR function: a block that enters the block of the
//! label (`control`), and a CLIF block for each block of the IR. Values are mapped one to one. The
//! other files have the operations (`arithmetic`, `fields`, `integrality_check`, `memory`, `indices` and `local_bits`), and
//! techniques that make code shorter (`base_registers`, `truth_values`, `vectors`, `double_constants` and `variable_checks`).
//! `Lowering::inst` is the match over all instructions; begin there.

mod arithmetic;
mod base_registers;
mod control;
mod double_constants;
mod fields;
mod indices;
mod integrality_check;
mod local_bits;
mod memory;
#[cfg(test)]
mod tests;
mod truth_values;
mod variable_checks;
mod vectors;

use cranelift_codegen::ir::{
    AbiParam, Block as ClifBlock, Function, InstBuilder, MemFlagsData, Signature, SourceLoc,
    StackSlot, UserFuncName, Value as ClifValue, types,
};
use cranelift_codegen::isa::{CallConv, TargetIsa};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use plcc_abi::{HostFn, HostType, ScanContext};
use plcc_ir::tables::FastMap;
use plcc_ir::{
    Block, FuncData, Inst, InstData, Module, PrimaryMap, SecondaryMap, Type, UnaryOp, Value,
};
use target_lexicon::Architecture;

use crate::{CodegenOptions, InternalError};
use double_constants::DoubleConstants;
use fields::ComparedFields;
use integrality_check::Truncated;
use memory::Base;
use truth_values::TruthValues;
use variable_checks::VariableChecks;
use vectors::Vectors;

/// Why the IR can't be lowered: a message that says which rule it breaks.
struct InvalidIr(String);

/// The result of a part of the lowering, which may find that the IR breaks a rule.
type LowerResult<T> = Result<T, InvalidIr>;

/// Lowers one function of the module to CLIF, into `out`, which must be empty.
///
/// # Errors
/// When the IR breaks a rule of the [verifier](plcc_ir::verify); `out` and `context` are then
/// not to be used any more.
pub(crate) fn function(
    module: &Module,
    func: &FuncData,
    isa: &dyn TargetIsa,
    options: CodegenOptions,
    out: &mut Function,
    context: &mut FunctionBuilderContext,
) -> Result<(), InternalError> {
    out.name = UserFuncName::testcase(func.name().as_bytes());
    out.signature = Signature::new(CallConv::SystemV);
    // CLIF keeps the numbers of statements relative to a base, by default the first number that it
    // meets. Relative to that, a lower number may become the one that means "no statement".
    out.params.ensure_base_srcloc(SourceLoc::new(0));
    let pointer = isa.pointer_type();
    out.signature.params.extend([AbiParam::new(pointer), AbiParam::new(types::I32)]);
    out.signature.returns.push(AbiParam::new(types::I64));
    let mut builder = FunctionBuilder::new(out, context);
    let start = builder.create_block();
    builder.append_block_params_for_function_params(start);
    builder.switch_to_block(start);
    builder.seal_block(start);
    let context_value = builder.block_params(start)[0];
    let label = builder.block_params(start)[1];
    let is_x86 = matches!(isa.triple().architecture, Architecture::X86_64);
    // These techniques are written for the instructions of this architecture.
    let options = if is_x86 { options } else { CodegenOptions::NONE };
    let local_bits = local_bits::stack_slot(func, &mut builder);
    let places = base_registers::bases(module, func, is_x86);
    let changes = has_cold_calls(func) && !func.is_optimized_for_size();
    let mut base = || match changes {
        true => Base::Changing(builder.declare_var(pointer)),
        false => Base::Fixed(None),
    };
    let image = base();
    let bases = places.into_iter().map(|place| (place, base())).collect();
    let double_constants = double_constants::choose(func, &mut builder, options);
    let uses = func.use_counts();
    let blocks: PrimaryMap<Block, ClifBlock> =
        func.blocks().map(|_| builder.create_block()).collect();
    let mut lowering = Lowering {
        module,
        func,
        builder,
        blocks,
        values: vec![None; func.value_count()].into(),
        context: context_value,
        image,
        bases,
        local_bits,
        ir_block: Block(0),
        indices: indices::Indices::new(func),
        cold: false,
        is_x86,
        variable_checks: VariableChecks::new(module, func, &uses, options),
        uses,
        truncated: Truncated::default(),
        double_constants,
        is_extended: memory::extended_values(func),
        extended_loads: FastMap::default(),
        compared_fields: ComparedFields::new(func),
        trap_exit: None,
        host_signature: None,
        inst: None,
        truth_values: TruthValues::new(func, options),
        vectors: if options.vectors { vectors::plan(module, func) } else { Vectors::default() },
    };
    if let Err(InvalidIr(reason)) = lowering.run(label) {
        return Err(InternalError::new(module, func, lowering.inst, reason));
    }
    lowering.builder.seal_all_blocks();
    lowering.builder.finalize(isa.frontend_config());
    Ok(())
}

/// The blocks in an order in which definitions come before uses: reverse postorder from the
/// entries. Blocks that nothing reaches are left out.
fn order(func: &FuncData) -> Vec<Block> {
    let mut visited = PrimaryMap::from(vec![false; func.block_count()]);
    let mut postorder = Vec::with_capacity(func.block_count());
    let mut stack: Vec<(Block, Vec<Block>)> = Vec::new();
    for &(_, entry) in func.entries().iter().rev() {
        if std::mem::replace(&mut visited[entry], true) {
            continue;
        }
        stack.push((entry, successors(func, entry)));
        while let Some((block, rest)) = stack.last_mut() {
            match rest.pop() {
                Some(next) => {
                    if !std::mem::replace(&mut visited[next], true) {
                        stack.push((next, successors(func, next)));
                    }
                }
                None => {
                    postorder.push(*block);
                    stack.pop();
                }
            }
        }
    }
    postorder.reverse();
    postorder
}

/// Whether a function calls the host in cold blocks.
fn has_cold_calls(func: &FuncData) -> bool {
    let mut insts =
        func.blocks().filter(|(_, block)| block.cold).flat_map(|(_, block)| &block.insts);
    insts.any(|&inst| matches!(func.inst(inst), InstData::HostCall { .. }))
}

fn successors(func: &FuncData, block: Block) -> Vec<Block> {
    let mut next = Vec::new();
    if let Some(terminator) = &func.block(block).terminator {
        terminator.for_each_block(|block, _| next.push(block));
    }
    next
}

/// A function being lowered.
struct Lowering<'a> {
    module: &'a Module,
    func: &'a FuncData,
    builder: FunctionBuilder<'a>,
    /// For each block of the IR the CLIF block.
    blocks: PrimaryMap<Block, ClifBlock>,
    /// For each value of the IR the CLIF value, once it is defined.
    values: PrimaryMap<Value, Option<ClifValue>>,
    /// The function's first argument: the address of the scan context.
    context: ClifValue,
    /// The address of the process image.
    image: Base,
    /// The base registers, each with the [place](memory) that it points to.
    bases: Vec<(i64, Base)>,
    /// The part of the stack frame for the function's local bits.
    local_bits: Option<StackSlot>,
    /// The block that is being lowered.
    ir_block: Block,
    /// What is known of the indices of arrays.
    indices: indices::Indices,
    /// Whether the current block is cold.
    cold: bool,
    /// Whether the target is x86-64, on which some operations have shorter forms.
    is_x86: bool,
    /// How often each value is used.
    uses: SecondaryMap<Value, u32>,
    /// What was made of doubles in conversions and integrality checks.
    truncated: Truncated,
    /// The doubles that are kept in registers.
    double_constants: DoubleConstants,
    /// The checks of variables at the function's entry that are made in vectors.
    variable_checks: VariableChecks,
    /// For each value whether it is an operand of an extension with zeros.
    is_extended: SecondaryMap<Value, bool>,
    /// The values of 8 and 16 bits that were loaded with that extension, each with the 32 bits.
    extended_loads: FastMap<Value, ClifValue>,
    /// Fields that are compared with constants.
    compared_fields: ComparedFields,
    /// The block in which all traps with a site leave the function, once there is such a trap. Its
    /// parameters are the two halves of the outcome.
    trap_exit: Option<ClifBlock>,
    /// The signature of the host function, once a call has needed it.
    host_signature: Option<cranelift_codegen::ir::SigRef>,
    /// The instruction that is being lowered, for error messages.
    inst: Option<Inst>,
    /// Truth values in 32 bits.
    truth_values: TruthValues,
    /// Rows of statements that are computed at once.
    vectors: Vectors,
}

/// The CLIF type of a value.
fn clif_type(ty: Type) -> types::Type {
    match ty {
        Type::I1 | Type::I8 => types::I8,
        Type::I16 => types::I16,
        Type::I32 => types::I32,
        Type::I64 => types::I64,
        Type::F64 => types::F64,
    }
}

impl Lowering<'_> {
    /// Lowers the whole function, beginning in its first block; `label` is the label to enter at.
    fn run(&mut self, label: ClifValue) -> LowerResult<()> {
        self.materialise_bases();
        self.materialise_constants();
        self.enter(label)?;
        for (block, _) in self.func.blocks() {
            self.params(block)?;
        }
        let order = order(self.func);
        // A block is sealed as soon as all that lead to it are lowered: until then, each variable that is used there
        // takes a parameter.
        let mut edges = PrimaryMap::from(vec![0u32; self.blocks.len()]);
        for block in order.iter().flat_map(|&block| successors(self.func, block)) {
            edges[block] += 1;
        }
        for block in order {
            if edges[block] == 0 {
                self.builder.seal_block(self.clif_block(block)?);
            }
            self.block(block)?;
            successors(self.func, block).iter().for_each(|&next| edges[next] -= 1);
        }
        self.write_trap_exit();
        Ok(())
    }

    /// The CLIF block of an IR block.
    fn clif_block(&self, block: Block) -> LowerResult<ClifBlock> {
        let found = self.blocks.get(block).copied();
        found.ok_or_else(|| InvalidIr(format!("there is no {block}")))
    }

    fn params(&mut self, block: Block) -> LowerResult<()> {
        let clif = self.clif_block(block)?;
        for &param in &self.func.block(block).params {
            let value = self.builder.append_block_param(clif, clif_type(self.func.ty(param)));
            self.define(param, value)?;
        }
        Ok(())
    }

    fn block(&mut self, block: Block) -> LowerResult<()> {
        let clif = self.clif_block(block)?;
        self.builder.switch_to_block(clif);
        self.ir_block = block;
        if self.variable_checks(block)? {
            return Ok(());
        }
        let data = self.func.block(block);
        self.cold = data.cold;
        if self.cold {
            self.builder.set_cold_block(clif);
        }
        for &inst in &data.insts {
            self.inst = Some(inst);
            self.inst(inst, block)?;
        }
        let terminator = data.terminator.as_ref();
        self.terminator(terminator.ok_or_else(|| InvalidIr(format!("{block} has no end")))?)
    }

    /// The CLIF value of an IR value.
    fn value(&mut self, value: Value) -> LowerResult<ClifValue> {
        if let Some(narrow) = self.narrow_truth(value)? {
            return Ok(narrow);
        }
        if let Some(constant) = self.double_in_register(value) {
            return Ok(constant);
        }
        if let Some(integer) = self.checked_integer(value) {
            return Ok(integer);
        }
        let found = self.values.get(value).copied().flatten();
        found.ok_or_else(|| InvalidIr(format!("{value} is used and not defined before")))
    }

    /// How often a value is used.
    fn use_count(&self, value: Value) -> u32 {
        self.uses[value]
    }

    /// Records the CLIF value of an IR value.
    fn define(&mut self, value: Value, clif: ClifValue) -> LowerResult<()> {
        let slot = self.values.get_mut(value);
        *slot.ok_or_else(|| InvalidIr(format!("there is no {value}")))? = Some(clif);
        Ok(())
    }

    fn inst(&mut self, inst: Inst, block: Block) -> LowerResult<()> {
        let loc = self.func.loc(inst);
        self.builder.set_srcloc(SourceLoc::new(loc.0));
        let data = *self.func.inst(inst);
        self.count_instruction();
        if self.vectors.leaves_out(inst) {
            return self.stored_row(inst);
        }
        if let Some(result) = self.func.result(inst)
            && match data {
                InstData::Load { ty, at } => self.load_truth(result, ty, at, block)?,
                InstData::Binary { op, args } => self.wide_binary(result, op, args)?,
                InstData::Unary { op: UnaryOp::Not, arg } => self.wide_not(result, arg)?,
                _ => false,
            }
        {
            return Ok(());
        }
        let result = match data {
            InstData::Iconst { ty, value } => Some(self.iconst(ty, value)),
            InstData::Fconst { bits } => Some(self.builder.ins().f64const(f64::from_bits(bits))),
            InstData::Unary { op, arg } => Some(self.unary(op, arg)?),
            InstData::Binary { op, args } => {
                let uses = self.func.result(inst).map_or(0, |result| self.use_count(result));
                Some(self.binary(op, args, uses)?)
            }
            InstData::Icmp { cond, args } => Some(self.icmp(cond, args)?),
            InstData::Fcmp { cond, args } => Some(self.fcmp(cond, args)?),
            InstData::Select { cond, args } => {
                let cond = self.truth(cond)?;
                let (a, b) = (self.value(args[0])?, self.value(args[1])?);
                Some(self.builder.ins().select(cond, a, b))
            }
            InstData::Convert { op, to, arg } => Some(self.convert(inst, op, to, arg)?),
            InstData::Bit { arg, number } => Some(self.bit(arg, number)?),
            InstData::Extract { op, arg, field } => Some(self.extract(inst, op, arg, field)?),
            InstData::Insert { args, field } => Some(self.insert(args, field)?),
            InstData::Load { ty, at } => {
                let result = self.func.result(inst).filter(|&result| self.is_also_extended(result));
                match result {
                    Some(result) => Some(self.load_extended(result, ty, at)?),
                    None => Some(self.load(ty, at)?),
                }
            }
            InstData::Store { at, value } => {
                self.store(at, value)?;
                None
            }
            InstData::Unpack { word, to } => {
                self.unpack(word, to)?;
                None
            }
            InstData::Pack { from } => Some(self.pack(from)?),
            InstData::IsLate => Some(self.is_late()),
            InstData::HostCall { function, args } => self.host_call(function, args.as_slice())?,
        };
        match (self.func.result(inst), result) {
            (Some(value), Some(clif)) => {
                self.define(value, clif)?;
                self.widen_for_index(value, clif);
                Ok(())
            }
            (None, None) => Ok(()),
            (Some(_), None) => Err(InvalidIr("it has a result where it gives none".into())),
            (None, Some(_)) => Err(InvalidIr("it has no result where it gives one".into())),
        }
    }

    /// A constant with zeros above its bits, as an integer of 64 bits; of a double its bits.
    fn iconst_extended(&mut self, ty: Type, value: i64) -> ClifValue {
        let mask = if ty.bits() == 64 { -1 } else { (1 << ty.bits()) - 1 };
        self.builder.ins().iconst(types::I64, value & mask)
    }

    fn iconst(&mut self, ty: Type, value: i64) -> ClifValue {
        // CLIF wants a narrow constant's high bits clear.
        let mask = if ty.bits() == 64 { -1 } else { (1 << ty.bits()) - 1 };
        self.builder.ins().iconst(clif_type(ty), value & mask)
    }

    fn host_call(&mut self, function: HostFn, args: &[Value]) -> LowerResult<Option<ClifValue>> {
        self.lower_waiting_loads(None)?;
        let pointer = self.builder.func.dfg.value_type(self.context);
        let signature = *self.host_signature.get_or_insert_with(|| {
            let mut signature = Signature::new(CallConv::SystemV);
            signature.params.extend([AbiParam::new(pointer), AbiParam::new(types::I32)]);
            signature.params.extend([AbiParam::new(types::I64); 4]);
            signature.returns.push(AbiParam::new(types::I64));
            self.builder.import_signature(signature)
        });
        let offset = std::mem::offset_of!(ScanContext, host) as i32;
        let flags = MemFlagsData::trusted().with_readonly();
        let callee = self.builder.ins().load(pointer, flags, self.context, offset);
        let number = self.builder.ins().iconst(types::I32, i64::from(function as u32));
        let mut operands = vec![self.context, number];
        for &arg in args {
            if let Some(constant) = self.func.constant(arg) {
                // A constant that was extended afterwards would be loaded from memory.
                operands.push(self.iconst_extended(self.func.ty(arg), constant));
                continue;
            }
            let value = self.value(arg)?;
            operands.push(match self.func.ty(arg) {
                Type::F64 => self.builder.ins().bitcast(types::I64, MemFlagsData::new(), value),
                Type::I64 => value,
                _ => self.builder.ins().uextend(types::I64, value),
            });
        }
        if operands.len() > 6 {
            return Err(InvalidIr("it has more than four arguments".into()));
        }
        while operands.len() < 6 {
            operands.push(self.builder.ins().iconst(types::I64, 0));
        }
        let call = self.builder.ins().call_indirect(signature, callee, &operands);
        let result = self.builder.inst_results(call)[0];
        if self.cold && matches!(self.image, Base::Changing(_)) {
            self.materialise_bases();
            self.materialise_constants();
        }
        Ok(function.signature().1.map(|ty| match ty {
            HostType::I32 => self.builder.ins().ireduce(types::I32, result),
            HostType::I64 => result,
            HostType::F64 => self.builder.ins().bitcast(types::F64, MemFlagsData::new(), result),
        }))
    }
}
