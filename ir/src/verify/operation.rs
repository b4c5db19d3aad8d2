//! Rules 6 to 8 and 10 to 13: types of operands, constants, addresses and labels.

use std::fmt;
use std::ops::Range;

use plcc_abi::HostType;

use super::error::Errors;
use crate::{
    Address, BitGroups, Block, Field, FuncData, InstData, Label, Module, RegionId, StatementId,
    Terminator, Type, Value, ValueDef,
};

pub(super) fn check_function(module: &Module, func: &FuncData, errors: &mut Errors) {
    for (block, data) in func.blocks() {
        errors.block = Some(block);
        for (number, &param) in data.params.iter().enumerate() {
            if func.def(param) != ValueDef::Param(block, number as u32) {
                errors.push(format!(
                    "{param} is listed as parameter {number}, but is defined by something else"
                ));
            }
        }
        for &inst in &data.insts {
            errors.inst = Some(inst);
            let instruction = func.inst(inst);
            let result = func.result(inst);
            let (given, wanted) =
                (result.map(|value| func.ty(value)), func.result_type(instruction));
            if given != wanted {
                let (given, wanted) = (type_or_nothing(given), type_or_nothing(wanted));
                errors.push(format!("its result is {given}, but the operation gives {wanted}"));
            }
            if result.is_some_and(|value| func.def(value) != ValueDef::Result(inst)) {
                errors.push("its result is defined by something else");
            }
            let loc = func.loc(inst);
            if loc != StatementId::NONE && loc.index() >= module.statements.len() {
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

/// The type of a result, for messages.
fn type_or_nothing(ty: Option<Type>) -> &'static str {
    ty.map_or("nothing", Type::name)
}

/// What is wrong with an instruction; `None` if it keeps the rules.
fn mistake(module: &Module, func: &FuncData, data: &InstData) -> Option<String> {
    let ty = |value: Value| func.ty(value);
    let type_mismatch = |[a, b]: [Value; 2]| {
        (ty(a) != ty(b)).then(|| format!("its operands are {} and {}", ty(a), ty(b)))
    };
    // The text is made only for an instruction that breaks a rule.
    let when_broken =
        |broken: bool, message: fmt::Arguments<'_>| broken.then(|| message.to_string());
    match *data {
        InstData::Iconst { ty, value } => when_broken(
            !ty.is_int() || ty.wrap(value) != value,
            format_args!("{value} is not a constant of type {ty}"),
        ),
        InstData::Fconst { bits: _ } => None,
        InstData::Unary { op, arg } => {
            let fits = op.operands().include(ty(arg));
            when_broken(!fits, format_args!("{} takes no {}", op.name(), ty(arg)))
        }
        InstData::Binary { op, args } => type_mismatch(args).or_else(|| {
            let of = ty(args[0]);
            let fits = op.operands().include(of);
            when_broken(!fits, format_args!("{} takes no {of}", op.name()))
        }),
        InstData::Icmp { cond, args } => type_mismatch(args).or_else(|| {
            let of = ty(args[0]);
            let fits = cond.operands().include(of);
            when_broken(!fits, format_args!("{} takes no {of}", cond.name()))
        }),
        InstData::Fcmp { cond, args } => type_mismatch(args).or_else(|| {
            when_broken(
                ty(args[0]) != Type::F64,
                format_args!("{} takes no {}", cond.name(), ty(args[0])),
            )
        }),
        InstData::Select { cond, args } => type_mismatch(args).or_else(|| {
            when_broken(ty(cond) != Type::I1, format_args!("its condition is {}, not i1", ty(cond)))
        }),
        InstData::Convert { op, to, arg } => {
            let from = ty(arg);
            when_broken(
                !op.converts(from, to),
                format_args!("{} cannot convert {from} to {to}", op.name()),
            )
        }
        InstData::Bit { arg, number } => field_mistake(ty(arg), Field::bit(number)),
        InstData::Extract { op: _, arg, field } => field_mistake(ty(arg), field),
        InstData::Insert { args: [word, bits], field } => {
            let fits = ty(bits) == ty(word) || ty(bits) == Type::I1 && field.width == 1;
            field_mistake(ty(word), field).or_else(|| {
                when_broken(
                    !fits,
                    format_args!(
                        "{} bits of an {} can't be an {}",
                        field.width,
                        ty(word),
                        ty(bits)
                    ),
                )
            })
        }
        InstData::Load { ty, at } => access_mistake(module, func, &at, ty, false),
        InstData::Store { at, value } => access_mistake(module, func, &at, ty(value), true),
        InstData::Unpack { word, to } => when_broken(
            ty(word) != Type::I32,
            format_args!("it unpacks an {}, not an i32", ty(word)),
        )
        .or_else(|| groups_mistake(func, to)),
        InstData::Pack { from } => groups_mistake(func, from),
        InstData::IsLate => None,
        InstData::HostCall { function, args } => {
            let (wanted, _) = function.signature();
            let given = args.as_slice();
            let fits = wanted.len() == given.len()
                && wanted.iter().zip(given).all(|(&wanted, &arg)| host_type(wanted) == ty(arg));
            when_broken(
                !fits,
                format_args!("these are not the arguments that {} takes", function.name()),
            )
        }
    }
}

/// What is wrong with a field of an integer of a type.
fn field_mistake(ty: Type, field: Field) -> Option<String> {
    let Field { first, width } = field;
    (!field.fits(ty)).then(|| format!("an {ty} has no field of {width} bits from bit {first} on"))
}

fn host_type(ty: HostType) -> Type {
    match ty {
        HostType::I32 => Type::I32,
        HostType::I64 => Type::I64,
        HostType::F64 => Type::F64,
    }
}

/// What is wrong with an access to the process image; `None` if it keeps the rules.
fn access_mistake(
    module: &Module,
    func: &FuncData,
    at: &Address,
    ty: Type,
    store: bool,
) -> Option<String> {
    if at.region == RegionId::LOCAL_BITS {
        return local_bit_mistake(func, at, ty);
    }
    let Some(region) = module.region(at.region) else {
        return Some(format!("{} is not there", at.region));
    };
    let Range { start, end } = at.extent(ty);
    if end > u64::from(region.size) {
        let size = region.size;
        return Some(format!(
            "accesses bytes {start}..{end} of {}, which has {size} bytes",
            region.name
        ));
    }
    if let Some(index) = at.index {
        if func.ty(index.value) != Type::I32 {
            return Some(format!("its index is {}, not i32", func.ty(index.value)));
        }
        if index.count == 0 {
            return Some("its array has no elements".into());
        }
    }
    if ty == Type::I1 && !region.bits {
        return Some(format!("accesses an i1 in {}, which is not a region of bits", region.name));
    }
    if store && region.bits && ty != Type::I1 {
        return Some(format!("stores an {ty} in {}, which is a region of bits", region.name));
    }
    None
}

/// What is wrong with an access to a local bit; `None` if it keeps the rules.
fn local_bit_mistake(func: &FuncData, at: &Address, ty: Type) -> Option<String> {
    let count = func.local_bits();
    if at.index.is_some() || at.volatile {
        Some("accesses a local bit by an index, or as volatile".into())
    } else if ty != Type::I1 {
        Some(format!("accesses an {ty} among the local bits"))
    } else if at.offset >= count {
        Some(format!("accesses local bit {}, but there are {count}", at.offset))
    } else {
        None
    }
}

/// What is wrong with the groups of local bits that an instruction packs or unpacks; `None` if they keep the rules.
fn groups_mistake(func: &FuncData, groups: BitGroups) -> Option<String> {
    let count = func.local_bits();
    if groups.groups == 0 || u32::from(groups.groups) >> BitGroups::COUNT != 0 {
        return Some("it has no groups of bits, or such as a word has not".into());
    }
    let end = groups.iter().map(|group| groups.bits(group).end).max().unwrap_or(0);
    (end > u64::from(count))
        .then(|| format!("it reaches up to local bit {}, but there are {count}", end - 1))
}

/// Checks the operands, labels and blocks of a terminator.
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
        Terminator::TrapAt { site, index } => {
            check_type(*site, Type::I32);
            check_type(*index, Type::I32);
        }
        Terminator::Goto(label) | Terminator::Suspend(label) => {
            check_label(module, *label, errors);
        }
        Terminator::Jump(_) | Terminator::Return | Terminator::Trap(_) => {}
    }
    terminator.for_each_block(|block, args| check_block_call(func, block, args, errors));
}

fn check_label(module: &Module, label: Label, errors: &mut Errors) {
    if !module.has_label(label) {
        errors.push(format!("{label} is not a label of the module"));
    }
}

/// Checks the values that are passed to the parameters of a block.
fn check_block_call(func: &FuncData, block: Block, args: &[Value], errors: &mut Errors) {
    let params = &func.block(block).params;
    if params.len() != args.len() {
        errors.push(format!(
            "{block} has {} parameters, but {} values are passed",
            params.len(),
            args.len()
        ));
    }
    for (&param, &arg) in params.iter().zip(args) {
        let (wanted, given) = (func.ty(param), func.ty(arg));
        if wanted != given {
            errors.push(format!("{block} takes {wanted} as {param}, not {given}"));
        }
    }
}
