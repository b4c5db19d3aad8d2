//! Rules 6 to 8 and 10 to 13: types of operands, constants, addresses and labels.

use plcc_abi::HostType;

use super::Errors;
use crate::{
    Address, BinaryOp, Block, ConvertOp, FuncData, InstData, IntCond, Label, Module, SourceLoc,
    Terminator, Type, UnaryOp, Value, ValueDef,
};

pub(super) fn check_function(module: &Module, func: &FuncData, errors: &mut Errors) {
    for (block, data) in func.blocks() {
        errors.block = Some(block);
        for (number, &param) in data.params.iter().enumerate() {
            if func.def(param) != ValueDef::Param(block, number as u32) {
                errors.push(format!("{param} is not its parameter {number}"));
            }
        }
        for &inst in &data.insts {
            errors.inst = Some(inst);
            let instruction = func.inst(inst);
            let result = func.result(inst);
            if result.map(|value| func.ty(value)) != func.result_type(instruction) {
                errors.push("its result has another type than it gives");
            }
            if result.is_some_and(|value| func.def(value) != ValueDef::Result(inst)) {
                errors.push("its result is another's");
            }
            let loc = func.loc(inst);
            if loc != SourceLoc::NONE && loc.index() >= module.statements.len() {
                errors.push(format!("belongs to statement {loc}, which is not there"));
            }
            if let Some(message) = mistake(module, func, instruction) {
                errors.push(message);
            }
        }
        errors.inst = None;
        if let Some(terminator) = &data.terminator {
            check_terminator(module, func, terminator, errors);
        }
    }
    errors.block = None;
}

/// What is wrong with an instruction.
fn mistake(module: &Module, func: &FuncData, data: &InstData) -> Option<String> {
    let ty = |value: Value| func.ty(value);
    let type_mismatch = |[a, b]: [Value; 2]| {
        (ty(a) != ty(b)).then(|| format!("operands are {} and {}", ty(a), ty(b)))
    };
    let when_broken = |broken: bool, message: String| broken.then_some(message);
    match *data {
        InstData::Iconst { ty, value } => when_broken(
            !ty.is_int() || ty.wrap(value) != value,
            format!("{value} is no constant of type {ty}"),
        ),
        InstData::Fconst { bits: _ } => None,
        InstData::Unary { op, arg } => {
            let fits = match op {
                UnaryOp::Not => ty(arg).is_int(),
                UnaryOp::Neg => ty(arg).is_int() && ty(arg) != Type::I1,
                _ => ty(arg) == Type::F64,
            };
            when_broken(!fits, format!("{} of {}", op.name(), ty(arg)))
        }
        InstData::Binary { op, args } => type_mismatch(args).or_else(|| {
            let of = ty(args[0]);
            let fits = match of {
                Type::F64 => op.is_float(),
                Type::I1 => matches!(op, BinaryOp::And | BinaryOp::Or | BinaryOp::Xor),
                _ => !op.is_float(),
            };
            when_broken(!fits, format!("{} of {of}", op.name()))
        }),
        InstData::Icmp { cond, args } => type_mismatch(args).or_else(|| {
            let of = ty(args[0]);
            let fits = match of {
                Type::F64 => false,
                Type::I1 => matches!(cond, IntCond::Eq | IntCond::Ne),
                _ => true,
            };
            when_broken(!fits, format!("{} of {of}", cond.name()))
        }),
        InstData::Fcmp { cond, args } => type_mismatch(args).or_else(|| {
            when_broken(ty(args[0]) != Type::F64, format!("{} of {}", cond.name(), ty(args[0])))
        }),
        InstData::Select { cond, args } => type_mismatch(args)
            .or_else(|| when_broken(ty(cond) != Type::I1, format!("chooses by {}", ty(cond)))),
        InstData::Convert { op, to, arg } => {
            let from = ty(arg);
            let ints = from.is_int() && to.is_int();
            let wide = |ty| matches!(ty, Type::I32 | Type::I64);
            let fits = match op {
                ConvertOp::Sext | ConvertOp::Zext => ints && to.bits() > from.bits(),
                ConvertOp::Trunc => ints && to.bits() < from.bits(),
                ConvertOp::IntToFloat => wide(from) && to == Type::F64,
                ConvertOp::FloatToInt => from == Type::F64 && to == Type::I32,
                ConvertOp::Bitcast => {
                    matches!((from, to), (Type::I64, Type::F64) | (Type::F64, Type::I64))
                }
            };
            when_broken(!fits, format!("{} of {from} to {to}", op.name()))
        }
        InstData::Load { ty, at } => access_mistake(module, func, &at, ty, false),
        InstData::Store { at, value } => access_mistake(module, func, &at, ty(value), true),
        InstData::HostCall { function, args } => {
            let (wanted, _) = function.signature();
            let given = args.as_slice();
            let fits = wanted.len() == given.len()
                && wanted.iter().zip(given).all(|(&wanted, &arg)| host_type(wanted) == ty(arg));
            when_broken(
                !fits,
                format!("{} is called with other arguments than it has", function.name()),
            )
        }
    }
}

fn host_type(ty: HostType) -> Type {
    match ty {
        HostType::I32 => Type::I32,
        HostType::I64 => Type::I64,
        HostType::F64 => Type::F64,
    }
}

fn access_mistake(
    module: &Module,
    func: &FuncData,
    at: &Address,
    ty: Type,
    store: bool,
) -> Option<String> {
    let Some(region) = module.region(at.region) else {
        return Some(format!("{} is not there", at.region));
    };
    let (start, end) = at.extent(ty);
    if end > u64::from(region.size) {
        let size = region.size;
        return Some(format!("bytes {start} to {end} of {}, which has {size}", region.name));
    }
    if let Some(index) = at.index {
        if func.ty(index.value) != Type::I32 {
            return Some(format!("its index is {}", func.ty(index.value)));
        }
        if index.count == 0 {
            return Some("it has no elements".into());
        }
    }
    if ty == Type::I1 && !region.bits {
        return Some(format!("an i1 in {}, which is no region of bits", region.name));
    }
    if store && region.bits && ty != Type::I1 {
        return Some(format!("{ty} is stored in {}, a region of bits", region.name));
    }
    None
}

fn check_terminator(
    module: &Module,
    func: &FuncData,
    terminator: &Terminator,
    errors: &mut Errors,
) {
    let mut check_type = |value: Value, wanted: Type| {
        if func.ty(value) != wanted {
            errors.push(format!("{value} is {}, not {wanted}", func.ty(value)));
        }
    };
    match terminator {
        Terminator::Brif { cond, .. } => check_type(*cond, Type::I1),
        Terminator::Switch { arg, .. } => check_type(*arg, Type::I32),
        Terminator::GotoIndirect(label) => check_type(*label, Type::I32),
        Terminator::Goto(label) | Terminator::Suspend(label) => {
            check_label(module, *label, errors);
        }
        Terminator::Jump(_) | Terminator::Return | Terminator::Trap(_) => {}
    }
    terminator.for_each_block(|block, args| check_block_call(func, block, args, errors));
}

fn check_label(module: &Module, label: Label, errors: &mut Errors) {
    if !module.has_label(label) {
        errors.push(format!("{label} stands nowhere"));
    }
}

fn check_block_call(func: &FuncData, block: Block, args: &[Value], errors: &mut Errors) {
    let params = &func.block(block).params;
    if params.len() != args.len() {
        errors.push(format!("{block} has {} parameters, not {}", params.len(), args.len()));
    }
    for (&param, &arg) in params.iter().zip(args) {
        let (wanted, given) = (func.ty(param), func.ty(arg));
        if wanted != given {
            errors.push(format!("{block} takes {wanted} as {param}, not {given}"));
        }
    }
}
