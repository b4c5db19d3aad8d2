//! Compiles a module's functions in parallel and joins their code to one blob.
#![allow(unsafe_code)]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use cranelift_codegen::Context;
use cranelift_codegen::control::ControlPlane;
use cranelift_codegen::isa::unwind::systemv::UnwindInfo;
use cranelift_codegen::isa::unwind::{UnwindInfo as AnyUnwindInfo, UnwindInfoKind};
use cranelift_frontend::FunctionBuilderContext;
use plcc_abi::{Code, CodeLine, CodeParts, FunctionRange, RawOutcome, function_marker};
use plcc_ir::threads::in_threads;
use plcc_ir::{FuncData, Module, verify};

use crate::error::{MAX_CODE, panic_text};
use crate::{CodegenError, CodegenOptions, InternalError, Target, lower, unwind};

/// Functions begin at multiples of this, in bytes, with their markers in front of them.
const ALIGNMENT: usize = function_marker::LENGTH;

/// The number of IR instructions for which a further thread is started.
const INSTS_PER_THREAD: usize = 4000;

/// The code of one function and the tables that belong to it.
struct Compiled {
    bytes: Vec<u8>,
    /// By rising offset in `bytes`, the number of the statement that the code from there on was
    /// made for.
    locs: Vec<(u32, u32)>,
    unwind: UnwindInfo,
}

/// Compiles a module's functions, in several threads if there are many.
///
/// # Errors
/// [`CodegenError::Internal`] when the module breaks a rule of the [verifier](plcc_ir::verify) or
/// Cranelift refuses a function, [`CodegenError::TooLong`] when the code exceeds [`MAX_CODE`].
pub fn compile(
    module: &Module,
    target: &Target,
    options: CodegenOptions,
) -> Result<Code, CodegenError> {
    compile_within(module, target, options, MAX_CODE)
}

/// The same with another limit of the code's length in bytes.
fn compile_within(
    module: &Module,
    target: &Target,
    options: CodegenOptions,
    max_code: usize,
) -> Result<Code, CodegenError> {
    // What is checked here and in `compile_function` is what makes the code safe to run.
    let errors = if options.is_part { verify::part(module) } else { verify::module(module) };
    if let Some(error) = errors.first() {
        return Err(CodegenError::internal(format!("the IR is not valid: {error}")));
    }
    if module.trap_sites.len() > RawOutcome::MAX_TRAP_SITES as usize {
        return Err(CodegenError::TooLong(None));
    }
    let count = module.funcs().len();
    let size: usize = module.funcs().map(|(_, func)| func.inst_count()).sum();
    // The longest are compiled first, so that all threads end at about the same time.
    let mut order: Vec<_> =
        module.funcs().enumerate().map(|(index, (_, func))| (index, func)).collect();
    order.sort_by_key(|(_, func)| std::cmp::Reverse(func.inst_count()));
    let next = AtomicUsize::new(0);
    let worker = || {
        let mut done = Vec::new();
        let mut context = Context::new();
        let mut builder_context = FunctionBuilderContext::new();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(index, func)) = order.get(number) else { break };
            let result =
                compile_to_bytes(module, func, target, options, &mut context, &mut builder_context);
            let failed = result.is_err();
            done.push((index, result));
            if failed {
                break;
            }
        }
        done
    };
    let done = in_threads(count, size, INSTS_PER_THREAD, worker).into_iter();
    // A thread that was lost leaves functions out, which is found below.
    let mut results: Vec<_> = done.flat_map(Result::unwrap_or_default).collect();
    results.sort_unstable_by_key(|&(index, _)| index);
    let mut compiled = Vec::with_capacity(count);
    for (_, result) in results {
        compiled.push(result?);
    }
    if compiled.len() != count {
        return Err(CodegenError::internal("a thread of the compiler was lost"));
    }
    let mut parts = assemble(module, &compiled, options, max_code)?;
    let pieces = parts.functions.iter().zip(&compiled);
    let infos = pieces.map(|(function, piece)| (function.offset, &piece.unwind));
    parts.eh_frame = unwind::section(&*target.isa, parts.bytes.len(), infos)?;
    parts.trap_sites = Arc::new(module.trap_sites.clone());
    parts.architecture = target.architecture();
    parts.features = target.features().iter().map(ToString::to_string).collect();
    // SAFETY: Cranelift made every function for this target, with the signature of a `ChunkFn` and
    // the calling convention of C, and without relocations, so that it works at any address. The
    // lowering accesses nothing but the stack, the function's constants, the context, the epoch by the
    // context's address of it and, by addresses that it has checked against `image_size`, the image;
    // its only call is that of the context's host function; and every block ends in a jump within the
    // function or a return.
    let sealed = unsafe { Code::seal(parts) };
    sealed.map_err(|error| CodegenError::internal(error.to_string()))
}

/// Compiles one function and takes its code, line table and unwind information out of Cranelift's
/// context.
fn compile_to_bytes(
    module: &Module,
    func: &FuncData,
    target: &Target,
    options: CodegenOptions,
    context: &mut Context,
    builder_context: &mut FunctionBuilderContext,
) -> Result<Compiled, CodegenError> {
    compile_function(module, func, target, options, context, builder_context)?;
    let fail = |reason: &str| InternalError::new(module, func, None, reason);
    let code = context.compiled_code().ok_or_else(|| fail("there is no code"))?;
    if !code.buffer.relocs().is_empty() {
        return Err(fail("its code refers to something outside").into());
    }
    let mut locs: Vec<(u32, u32)> = Vec::new();
    for range in code.buffer.get_srclocs_sorted() {
        if !range.loc.is_default() && locs.last().is_none_or(|&(_, loc)| loc != range.loc.bits()) {
            locs.push((range.start, range.loc.bits()));
        }
    }
    let unwind = code.create_unwind_info_of_kind(&*target.isa, UnwindInfoKind::SystemV);
    let Ok(Some(AnyUnwindInfo::SystemV(unwind))) = unwind else {
        return Err(fail("there is no unwind information").into());
    };
    Ok(Compiled { bytes: code.code_buffer().to_vec(), locs, unwind })
}

/// Compiles one function of a module; its code is then in the context.
///
/// # Errors
/// [`CodegenError::Internal`] when the function breaks a rule of the verifier or Cranelift refuses
/// it. The contexts are then replaced by new ones, so they can be used again in any case.
pub fn compile_function(
    module: &Module,
    func: &FuncData,
    target: &Target,
    options: CodegenOptions,
    context: &mut Context,
    builder_context: &mut FunctionBuilderContext,
) -> Result<(), CodegenError> {
    context.clear();
    if let Some(error) = verify::function(module, func).first() {
        let reason = format!("the IR is not valid: {}", error.message);
        return Err(InternalError::new(module, func, error.inst, reason).into());
    }
    // Cranelift panics where it finds an error of its own.
    let result = catch_unwind(AssertUnwindSafe(|| {
        let isa = target.isa_for(module, func);
        lower::function(module, func, isa, options, &mut context.func, builder_context)?;
        let compiled = context.compile(isa, &mut ControlPlane::default());
        compiled.map(|_| ()).map_err(|error| {
            InternalError::new(module, func, None, format!("Cranelift: {:?}", error.inner))
        })
    }));
    let result = result.unwrap_or_else(|payload| {
        let reason = format!("Cranelift: {}", panic_text(&*payload));
        Err(InternalError::new(module, func, None, reason))
    });
    result.map_err(|error| {
        *context = Context::new();
        *builder_context = FunctionBuilderContext::new();
        error.into()
    })
}

/// Joins the functions' code to one blob, with the tables of functions, labels and lines.
fn assemble(
    module: &Module,
    compiled: &[Compiled],
    options: CodegenOptions,
    max_code: usize,
) -> Result<CodeParts, CodegenError> {
    let too_long = |piece: &Compiled| {
        let first = piece.locs.first().map(|&(_, loc)| loc as usize);
        CodegenError::TooLong(first.and_then(|loc| module.statements.get(loc).copied()))
    };
    let mut code = CodeParts { image_size: module.image_size, ..CodeParts::default() };
    let mut lines = vec![];
    for ((_, func), piece) in module.funcs().zip(compiled) {
        let marker = code.bytes.len().next_multiple_of(ALIGNMENT);
        code.bytes.resize(marker + function_marker::LENGTH, 0);
        if piece.bytes.len() > max_code.saturating_sub(code.bytes.len()) {
            return Err(too_long(piece));
        }
        let offset_of = |n: usize| u32::try_from(n).map_err(|_| too_long(piece));
        let offset = offset_of(code.bytes.len())?;
        code.bytes.extend(&piece.bytes);
        let len = offset_of(piece.bytes.len())?;
        code.functions.push(FunctionRange { name: func.name().into(), offset, len });
        for &(start, loc) in &piece.locs {
            let statement = module.statements.get(loc as usize);
            let statement = statement.ok_or_else(|| {
                let reason = format!("its code is for statement @{loc}, which is not there");
                InternalError::new(module, func, None, reason)
            })?;
            let (file, line) = (statement.file, statement.line);
            lines.push(CodeLine { offset: offset + start, file, line });
        }
    }
    let targets = module.label_targets();
    let labels = targets.iter().map(|(label, target)| {
        let function = target.and_then(|(func, _)| code.functions.get(func.index()));
        let offset = function.map(|function| function.offset);
        let offset = offset.or(options.is_part.then_some(CodeParts::NO_CODE));
        offset.ok_or_else(|| CodegenError::internal(format!("label {label} is nowhere")))
    });
    code.labels = labels.collect::<Result<_, _>>()?;
    code.lines = Arc::new(lines);
    code.label_lines = Arc::new(module.label_lines());
    function_marker::write(&mut code);
    Ok(code)
}

#[cfg(test)]
mod tests {
    use plcc_abi::Region;
    use plcc_ir::InstBuilder;
    use plcc_ir::{Address, BinaryOp, ChunkBuilder, Statement, Type};

    use super::*;

    #[test]
    fn code_that_is_too_long_names_the_statement_where_it_becomes_so() {
        let region = Region { name: "words".into(), offset: 0, size: 8, bits: false };
        let mut builder = ChunkBuilder::new(8, vec![region]).with_limit(50);
        let region = builder.region("words").unwrap();
        let start = builder.place();
        builder.bind(start);
        builder.task("scan", start);
        for line in 1..=400 {
            builder.statement(Statement { file: 0, line, start: 0, end: 0 });
            let at = Address::fixed(region, 0);
            let value = builder.func().load(Type::I32, at);
            let value = builder.func().binary_imm(BinaryOp::Mul, value, i64::from(line));
            builder.func().store(at, value);
        }
        builder.ret();
        let module = builder.finish();
        let target = Target::host().unwrap();
        let length =
            compile_within(&module, &target, CodegenOptions::NONE, MAX_CODE).unwrap().bytes.len();
        assert!(compile_within(&module, &target, CodegenOptions::NONE, length).is_ok());
        let error = compile_within(&module, &target, CodegenOptions::NONE, length - 1).unwrap_err();
        let CodegenError::TooLong(Some(statement)) = error else { panic!("{error}") };
        assert!(statement.line > 350, "{statement:?}");
    }
}
