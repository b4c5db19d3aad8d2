//! Lowers a checked program to IR.
//!
//! Logical expressions have no branches: a LOGICAL is an i1, and both sides of every operator are
//! computed. An INTEGER is an i16; a LONG, and a product that is divided, is an i32.

mod assignment;

use plcc_abi::{Region, SourceLine, TrapCode, TrapSite, pmi::Type as PmiType};
use plcc_diag::{FileId, SourceMap};
use plcc_ir::{
    Address, BinaryOp, ChunkBuilder, ConvertOp, InstBuilder, IntCond, Module, Place, RegionId,
    Statement, Type, UnaryOp, Value,
};

use crate::common::{BrokenInvariant, ExpressionCode, LowerError, OrMissing};
use crate::pmi::{
    ast::{Action, Binary, Checked, Op, Ops, Step, Symbol, SymbolId},
    layout::{LONG_EXPRESSION, Layout, SCRATCH, is_long, region_name},
};

type Result<T = ()> = std::result::Result<T, BrokenInvariant>;

/// Lowers a program to a module with one task, its scan. `sources` holds the program's texts.
///
/// # Errors
/// If the program is too long, or it or its layout is inconsistent.
pub(crate) fn lower(
    checked: &Checked,
    layout: &Layout,
    sources: &SourceMap,
) -> std::result::Result<Module, LowerError> {
    let builder = ChunkBuilder::new(layout.size, layout.regions.clone());
    let mut lowerer = Lowerer::new(checked, layout, builder)?;
    lowerer.program(sources)?;
    match lowerer.builder.statement_over_budget() {
        Some(statement) => Err(LowerError::TooLong(statement)),
        None => Ok(lowerer.builder.finish()),
    }
}

/// Lowers an expression to a module that leaves its value, a LONG, behind the process image.
///
/// # Errors
/// If the program or its layout is inconsistent.
pub(crate) fn lower_expression(
    checked: &Checked,
    layout: &Layout,
    ops: &[Op],
) -> Result<ExpressionCode> {
    let result = layout.size.next_multiple_of(8);
    let mut regions = layout.regions.clone();
    regions.push(Region { name: "result".to_owned(), offset: result, size: 8, bits: false });
    let builder = ChunkBuilder::new(result + 8, regions);
    let mut lowerer = Lowerer::new(checked, layout, builder)?;
    let region = lowerer.builder.region("result").or_missing(|| "region `result`")?;
    let start = lowerer.builder.place();
    lowerer.builder.bind(start);
    lowerer.builder.task("expression", start);
    for &op in ops {
        let operand = lowerer.op(op)?;
        lowerer.stack.push(operand);
    }
    let value = lowerer.pop()?;
    let value = lowerer.as_type(value, Type::I32);
    lowerer.builder.func().store(Address::fixed(region, 0), value);
    lowerer.builder.ret();
    Ok(ExpressionCode { module: lowerer.builder.finish(), result, ty: Type::I32 })
}

/// A value on the evaluation stack.
#[derive(Clone, Copy, Debug)]
enum Operand {
    Const(i32),
    Value(Value, Type),
}

struct Lowerer<'a> {
    checked: &'a Checked,
    layout: &'a Layout,
    builder: ChunkBuilder,
    /// The regions of LOGICALs, INTEGERs and LONGs.
    regions: [RegionId; 3],
    /// Where the evaluation stack is kept when an expression is cut, if the program has long ones.
    scratch: Option<RegionId>,
    /// The evaluation stack of the expression that is being lowered.
    stack: Vec<Operand>,
    /// The statement that is being lowered.
    statement: SourceLine,
    /// The trap site that was added last, with its number.
    last_site: Option<(TrapSite, u32)>,
}

fn ir_type(ty: PmiType) -> Type {
    match ty {
        PmiType::Logical => Type::I1,
        PmiType::Integer => Type::I16,
        PmiType::Long => Type::I32,
    }
}

/// The narrowest type that holds a constant.
fn const_type(value: i32) -> Type {
    if i16::try_from(value).is_ok() { Type::I16 } else { Type::I32 }
}

impl<'a> Lowerer<'a> {
    fn new(checked: &'a Checked, layout: &'a Layout, builder: ChunkBuilder) -> Result<Self> {
        let region = |ty| {
            let name = region_name(ty);
            builder.region(name).or_missing(|| format!("region `{name}`"))
        };
        let regions =
            [region(PmiType::Logical)?, region(PmiType::Integer)?, region(PmiType::Long)?];
        let scratch = builder.region(SCRATCH);
        let statement = SourceLine { file: 0, line: 1 };
        let stack = vec![];
        let last_site = None;
        Ok(Self { checked, layout, builder, regions, scratch, stack, statement, last_site })
    }
}

impl Lowerer<'_> {
    fn program(&mut self, sources: &SourceMap) -> Result {
        for id in (0..sources.len() as u32).map(FileId) {
            self.builder.add_file(sources.path(id), sources.text(id));
        }
        let count = self.checked.steps.len();
        let mut places: Vec<Option<Place>> = vec![None; count + 1];
        for step in &self.checked.steps {
            let to = match step.action {
                Action::If { otherwise, .. } => otherwise,
                Action::Jump { to, .. } => to,
                Action::Assign { .. } => continue,
            };
            if let Some(slot) = places.get_mut((to as usize).min(count))
                && slot.is_none()
            {
                *slot = Some(self.builder.place());
            }
        }
        let start = self.builder.place();
        self.builder.bind(start);
        self.builder.task("scan", start);
        for (index, step) in self.checked.steps.iter().enumerate() {
            if let Some(place) = places.get(index).copied().flatten() {
                self.builder.bind(place);
            }
            self.step(step, &places)
                .map_err(|error| error.or_at(sources.path(step.span.file), step.line))?;
            if self.builder.statement_over_budget().is_some() {
                break;
            }
        }
        if let Some(place) = places.last().copied().flatten() {
            self.builder.bind(place);
        }
        self.builder.ret();
        Ok(())
    }

    fn step(&mut self, step: &Step, places: &[Option<Place>]) -> Result {
        let (span, line) = (step.span, step.line);
        self.statement = SourceLine { file: span.file.0, line };
        self.builder.statement(Statement {
            file: span.file.0,
            line,
            start: span.start,
            end: span.end,
        });
        let target = |to: u32| {
            let index = (to as usize).min(places.len().saturating_sub(1));
            places.get(index).copied().flatten().or_missing(|| format!("the place of step {index}"))
        };
        match &step.action {
            Action::Assign { target, value } => self.assign(target, value)?,
            Action::If { condition, otherwise } => {
                self.expression(condition)?;
                let condition = self.pop()?;
                let condition = self.logical(condition);
                let next = self.builder.place();
                let otherwise = target(*otherwise)?;
                self.builder.brif(condition, next, otherwise);
                self.builder.bind(next);
            }
            Action::Jump { to, .. } => {
                let place = target(*to)?;
                self.builder.jump(place);
            }
        }
        Ok(())
    }

    fn region(&self, ty: PmiType) -> RegionId {
        let [logical, integer, long] = self.regions;
        match ty {
            PmiType::Logical => logical,
            PmiType::Integer => integer,
            PmiType::Long => long,
        }
    }

    /// Where in the region of its type an offset of the image lies.
    fn within(&self, ty: PmiType, offset: u32) -> Result<u32> {
        let within = self.layout.base(ty).and_then(|base| offset.checked_sub(base));
        within.or_missing(|| format!("offset {offset} in region `{}`", region_name(ty)))
    }

    /// The address of what is at an offset of the image, in the region of its type.
    fn address(&self, ty: PmiType, offset: u32) -> Result<Address> {
        Ok(Address::fixed(self.region(ty), self.within(ty, offset)?))
    }

    fn symbol(&self, id: SymbolId) -> Result<&Symbol> {
        self.checked.symbol(id).or_missing(|| format!("symbol {}", id.0))
    }

    fn type_of(&self, id: SymbolId) -> Result<PmiType> {
        Ok(self.symbol(id)?.ty)
    }

    /// A symbol's offset in the image.
    fn offset(&self, id: SymbolId) -> Result<u32> {
        self.layout.offset(id).or_missing(|| format!("the place of symbol {}", id.0))
    }

    fn elements(&self, id: SymbolId) -> Result<u32> {
        let symbol = self.symbol(id)?;
        symbol.elements.or_missing(|| format!("the number of elements of {}", symbol.name))
    }

    fn load(&mut self, ty: PmiType, offset: u32) -> Result<Value> {
        let at = self.address(ty, offset)?;
        Ok(self.builder.func().load(ir_type(ty), at))
    }

    fn store(&mut self, ty: PmiType, offset: u32, value: Value) -> Result {
        let at = self.address(ty, offset)?;
        self.builder.func().store(at, value);
        Ok(())
    }

    /// Lowers an expression and pushes its value.
    fn expression(&mut self, ops: &Ops) -> Result {
        let long = is_long(ops);
        for (count, &op) in (1..).zip(self.checked.ops(ops)) {
            let operand = self.op(op)?;
            self.stack.push(operand);
            if long && count % LONG_EXPRESSION == 0 {
                self.cut()?;
            }
        }
        Ok(())
    }

    /// Lets the builder begin another function inside an expression. The stack is stored in the
    /// image before that place and loaded again after it.
    fn cut(&mut self) -> Result {
        let scratch = self.scratch.or_missing(|| format!("region `{SCRATCH}`"))?;
        let stack = std::mem::take(&mut self.stack);
        let slot = |depth: usize| Address::fixed(scratch, depth as u32 * 4);
        for (depth, &operand) in stack.iter().enumerate() {
            if let Operand::Value(..) = operand {
                let value = self.as_type(operand, Type::I32);
                self.builder.func().store(slot(depth), value);
            }
        }
        let next = self.builder.place();
        self.builder.bind(next);
        for (depth, operand) in stack.into_iter().enumerate() {
            let operand = match operand {
                Operand::Const(_) => operand,
                Operand::Value(_, ty) => {
                    let func = self.builder.func();
                    let kept = func.load(Type::I32, slot(depth));
                    Operand::Value(func.sextend_or_trunc(ty, kept), ty)
                }
            };
            self.stack.push(operand);
        }
        Ok(())
    }

    fn pop(&mut self) -> Result<Operand> {
        self.stack.pop().or_missing(|| "an operand")
    }

    /// Lowers one operation: pops its operands and returns its result.
    fn op(&mut self, op: Op) -> Result<Operand> {
        match op {
            Op::Const(value) => Ok(Operand::Const(value)),
            Op::Load(id) => self.load_at(id, 0),
            Op::LoadAt(id, index) => self.load_at(id, index),
            Op::Element(id) => {
                let index = self.pop()?;
                let index = self.check_index(id, index)?;
                let at = self.element(id, index)?;
                let ty = ir_type(self.type_of(id)?);
                Ok(Operand::Value(self.builder.func().load(ty, at), ty))
            }
            Op::Neg { long } => {
                let ty = if long { Type::I32 } else { Type::I16 };
                let operand = self.pop()?;
                let value = self.as_type(operand, ty);
                Ok(Operand::Value(self.builder.func().unary(UnaryOp::Neg, value), ty))
            }
            Op::Not => {
                let operand = self.pop()?;
                Ok(Operand::Value(self.not(operand), Type::I1))
            }
            Op::Binary(op) => {
                let right = self.pop()?;
                let left = self.pop()?;
                Ok(self.binary(op, left, right))
            }
        }
    }

    fn load_at(&mut self, id: SymbolId, index: u32) -> Result<Operand> {
        let ty = self.type_of(id)?;
        let offset = self.offset(id)? + index * ty.size();
        Ok(Operand::Value(self.load(ty, offset)?, ir_type(ty)))
    }

    /// Returns an index as an `i32` that is below the number of the array's elements. The code traps
    /// if there is no such element.
    fn check_index(&mut self, id: SymbolId, index: Operand) -> Result<Value> {
        let array = self.offset(id)?;
        let elements = self.elements(id)?;
        let fits = match index {
            Operand::Const(value) => u32::try_from(value).is_ok_and(|value| value < elements),
            Operand::Value(_, ty) => ty == Type::I1 && elements >= 2,
        };
        let index = match index {
            // A negative index becomes one of 2^15 or more, which no element has either. Its low 16
            // bits, which the trap is given, stay the same.
            Operand::Value(value, Type::I16) if elements <= 1 << 15 => {
                self.builder.func().zextend_or_trunc(Type::I32, value)
            }
            _ => self.as_type(index, Type::I32),
        };
        if !fits {
            let (code, statement) = (TrapCode::ArrayBounds, self.statement);
            let site = self.trap_site(TrapSite { code, statement, array: Some(array) });
            let func = self.builder.func();
            let inside = func.icmp_imm(IntCond::Ult, index, i64::from(elements));
            let (go, stop) = (func.create_block(), func.create_block());
            func.brif(inside, go, stop);
            func.switch_to(stop);
            let before = func.set_cold(true);
            let site = func.constant(Type::I32, site.into());
            func.trap_at(site, index);
            func.set_cold(before);
            func.switch_to(go);
        }
        Ok(index)
    }

    /// The number of a trap site. Accesses to one array in one statement have the same.
    fn trap_site(&mut self, site: TrapSite) -> u32 {
        match self.last_site {
            Some((last, number)) if last == site => number,
            _ => {
                let number = self.builder.trap_site(site);
                self.last_site = Some((site, number));
                number
            }
        }
    }

    /// An element's address, by an index that was checked.
    fn element(&self, id: SymbolId, index: Value) -> Result<Address> {
        let (ty, elements) = (self.type_of(id)?, self.elements(id)?);
        let offset = self.within(ty, self.offset(id)?)?;
        Ok(Address::indexed(self.region(ty), offset, index, ty.size(), elements))
    }

    /// An operand as a number of the type: truth values become 0 or 1.
    fn as_type(&mut self, operand: Operand, to: Type) -> Value {
        let func = self.builder.func();
        match operand {
            Operand::Const(value) => func.constant(to, i64::from(value)),
            Operand::Value(value, Type::I1) => func.zextend_or_trunc(to, value),
            Operand::Value(value, _) => func.sextend_or_trunc(to, value),
        }
    }

    /// An operand as a truth value.
    fn logical(&mut self, operand: Operand) -> Value {
        let func = self.builder.func();
        match operand {
            Operand::Const(value) => func.constant(Type::I1, i64::from(value != 0)),
            Operand::Value(value, Type::I1) => value,
            Operand::Value(value, _) => func.icmp_imm(IntCond::Ne, value, 0),
        }
    }

    fn not(&mut self, operand: Operand) -> Value {
        let func = self.builder.func();
        match operand {
            Operand::Const(value) => func.constant(Type::I1, i64::from(value == 0)),
            Operand::Value(value, Type::I1) => func.unary(UnaryOp::Not, value),
            Operand::Value(value, _) => func.icmp_imm(IntCond::Eq, value, 0),
        }
    }

    fn arithmetic(&mut self, op: BinaryOp, long: bool, a: Operand, b: Operand) -> Operand {
        let ty = if long { Type::I32 } else { Type::I16 };
        let (a, b) = (self.as_type(a, ty), self.as_type(b, ty));
        Operand::Value(self.builder.func().binary(op, a, b), ty)
    }

    fn binary(&mut self, op: Binary, left: Operand, right: Operand) -> Operand {
        match op {
            Binary::Add { long } => self.arithmetic(BinaryOp::Add, long, left, right),
            Binary::Sub { long } => self.arithmetic(BinaryOp::Sub, long, left, right),
            Binary::Mul { wide } => self.arithmetic(BinaryOp::Mul, wide, left, right),
            Binary::Div => self.divide(BinaryOp::Sdiv, left, right),
            Binary::Rem => self.divide(BinaryOp::Srem, left, right),
            Binary::Eq => self.compare(IntCond::Eq, left, right),
            Binary::Ne => self.compare(IntCond::Ne, left, right),
            Binary::Lt => self.compare(IntCond::Slt, left, right),
            Binary::Le => self.compare(IntCond::Sle, left, right),
            Binary::Gt => self.compare(IntCond::Sgt, left, right),
            Binary::Ge => self.compare(IntCond::Sge, left, right),
            Binary::And => self.logic(BinaryOp::And, left, right),
            Binary::Or => self.logic(BinaryOp::Or, left, right),
        }
    }

    fn logic(&mut self, op: BinaryOp, left: Operand, right: Operand) -> Operand {
        let (a, b) = (self.logical(left), self.logical(right));
        Operand::Value(self.builder.func().binary(op, a, b), Type::I1)
    }

    /// A quotient or remainder of 16 bits. If the divisor is 0, it is the dividend.
    fn divide(&mut self, op: BinaryOp, left: Operand, right: Operand) -> Operand {
        let (a, b) = (self.as_type(left, Type::I32), self.as_type(right, Type::I32));
        let func = self.builder.func();
        let mut result = func.binary(op, a, b);
        if !matches!(right, Operand::Const(1..) | Operand::Const(..=-1)) {
            let zero = func.icmp_imm(IntCond::Eq, b, 0);
            result = func.select(zero, a, result);
        }
        Operand::Value(func.convert(ConvertOp::Trunc, Type::I16, result), Type::I16)
    }

    fn compare(&mut self, cond: IntCond, left: Operand, right: Operand) -> Operand {
        let equality = matches!(cond, IntCond::Eq | IntCond::Ne);
        let type_of = |operand| match operand {
            Operand::Const(0 | 1) if equality => Type::I1,
            Operand::Const(value) => const_type(value),
            Operand::Value(_, Type::I1) if !equality => Type::I16,
            Operand::Value(_, ty) => ty,
        };
        let ty = type_of(left).max(type_of(right));
        let (a, b) = (self.as_type(left, ty), self.as_type(right, ty));
        Operand::Value(self.builder.func().icmp(cond, a, b), Type::I1)
    }
}
