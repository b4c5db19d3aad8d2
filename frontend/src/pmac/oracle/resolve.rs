//! Makes resolved statements from the checked ones, before the first scan.

use std::collections::HashMap;

use plcc_abi::image::read_u64;
use plcc_abi::pmac::{Definition, Field, Format, Kind, Layout, Space};

use super::memory::MemoryMap;
use super::resolved::{
    Bits, Comparison, Destination, IntegerOperand, LVariable, Operand, Operation, Statement,
    TableRange,
};
use crate::pmac::analyse::load::Loaded;
use crate::pmac::ast::{Download, Expr, Op, Stmt, StmtKind, Target};

/// What the resolved statements of all tasks refer to.
#[derive(Clone, Debug, Default)]
pub(super) struct Tables {
    /// L-variables.
    pub(super) l_variables: Vec<LVariable>,
    /// L-variables that range assignments write: their indices among `l_variables`.
    pub(super) l_variable_ranges: Vec<u32>,
    /// The operations of all expressions.
    pub(super) operations: Vec<Operation<Operand>>,
    /// The comparisons of conditions that consist of several.
    pub(super) comparisons: Vec<Comparison>,
    /// The operations of all integer expressions.
    pub(super) integer_operations: Vec<Operation<IntegerOperand>>,
    /// The definitions of M-variables after load, encoded, by number.
    pub(super) definitions: Vec<u64>,
    /// The values of statements of motion.
    pub(super) motion_values: Vec<TableRange>,
}

/// Resolves the names in the statements of a download.
pub(super) struct Resolver<'a> {
    download: &'a Download,
    layout: Layout,
    map: MemoryMap,
    /// For the number of each L-variable its index in `tables.l_variables`.
    l_variable_index: HashMap<u16, u32>,
    /// What the statements that were resolved so far refer to.
    pub(super) tables: Tables,
}

impl<'a> Resolver<'a> {
    pub(super) fn new(download: &'a Download, loaded: &Loaded) -> Self {
        let layout = loaded.layout;
        let definition = |number| read_u64(&loaded.image, layout.mdef + 8 * number);
        let definitions = (0..layout.count).map(definition).collect();
        let mut this = Self {
            download,
            layout,
            map: MemoryMap::new(layout.controller),
            l_variable_index: HashMap::new(),
            tables: Tables { definitions, ..Tables::default() },
        };
        for (&number, definition) in &download.l_defs {
            let (space, address, field) = match *definition {
                Definition::X { address, field } => (Space::X, address, field),
                Definition::Y { address, field } => (Space::Y, address, field),
                _ => continue,
            };
            let offset = this.map.plain_word(&layout, space, address);
            this.l_variable_index.insert(number, this.tables.l_variables.len() as u32);
            this.tables.l_variables.push(LVariable { number, space, address, field, offset });
        }
        this
    }

    pub(super) fn statement(&mut self, stmt: &Stmt) -> Statement {
        match stmt.kind {
            StmtKind::Assign(target, value) if stmt.integer => self.assign_integer(target, value),
            StmtKind::Assign(target, value) => self.assign(target, value),
            StmtKind::If(condition, target) | StmtKind::While(condition, target)
                if stmt.integer =>
            {
                let operations = self.integer_expression(condition);
                match *operations.of(&self.tables.integer_operations) {
                    [
                        Operation::Load(left),
                        Operation::Compare(cmp, IntegerOperand::Constant(right)),
                    ] => Statement::IfIntegerComparison(cmp, left, right, target),
                    _ => Statement::IfInteger(operations, target),
                }
            }
            StmtKind::If(condition, target) | StmtKind::While(condition, target) => {
                let operations = self.expression(condition);
                match Comparison::all(operations.of(&self.tables.operations)).as_deref() {
                    Some(&[comparison]) => Statement::IfComparison(comparison, target),
                    Some(comparisons) => {
                        let start = self.tables.comparisons.len();
                        self.tables.comparisons.extend_from_slice(comparisons);
                        let all = TableRange::since(start, &self.tables.comparisons);
                        Statement::IfAll(all, target)
                    }
                    None => Statement::If(operations, target),
                }
            }
            StmtKind::Jump(target) => Statement::Jump(target),
            StmtKind::EndWhile(head) => Statement::EndWhile(head),
            StmtKind::Plc(op, plcs) => Statement::Plc(op, plcs.compiled, plcs.bits),
            StmtKind::Address(None, Some(system)) => Statement::Address(u64::from(system)),
            StmtKind::Address(Some(motor), None) => Statement::AddressMotor(u32::from(motor)),
            StmtKind::Address(Some(motor), Some(system)) => {
                let [motor, system] = [motor, system].map(|n| self.number(f64::from(n)));
                Statement::AddressBoth(motor, Some(system))
            }
            StmtKind::AddressBy(motor, system) if motor.len > 0 => {
                let motor = self.expression(motor);
                let system = (system.len > 0).then(|| self.expression(system));
                Statement::AddressBoth(motor, system)
            }
            StmtKind::AddressBy(_, system) if system.len > 0 => {
                Statement::AddressBy(self.expression(system))
            }
            StmtKind::Address(None, None) | StmtKind::AddressBy(..) => Statement::Nothing,
            StmtKind::Motion(index, _) => {
                let values = self.download.motion.get(index as usize).map(|stmt| &stmt.values);
                let values = values.map_or(&[][..], Vec::as_slice);
                let ranges: Vec<_> = values.iter().map(|value| self.expression(*value)).collect();
                let start = self.tables.motion_values.len();
                self.tables.motion_values.extend(ranges);
                Statement::Motion(index, TableRange::since(start, &self.tables.motion_values))
            }
            StmtKind::Loop(head, index) => Statement::Loop(head, index),
            StmtKind::Text(index, value) => {
                Statement::Text(index, value.map(|value| self.expression(value)))
            }
            StmtKind::Define(index) => Statement::Define(index),
            StmtKind::Word(space, address, value) => {
                Statement::Word(space, address, self.expression(value))
            }
            StmtKind::Save => Statement::Save,
        }
    }

    /// An expression that is a number.
    fn number(&mut self, value: f64) -> TableRange {
        let start = self.tables.operations.len();
        self.tables.operations.push(Operation::Load(Operand::Constant(value)));
        TableRange::since(start, &self.tables.operations)
    }

    fn assign(&mut self, target: Target, value: Expr) -> Statement {
        if let Target::Var(Kind::P, number) = target {
            let offset = self.layout.p + 8 * u32::from(number);
            return Statement::AssignDouble(offset, self.expression(value));
        }
        if let Target::Var(Kind::M, number) = target
            && let Some((offset, field)) = self.field(number)
        {
            return Statement::AssignField(number, offset, field, self.expression(value));
        }
        let destination = match target {
            Target::Var(Kind::L, number) => match self.l_variable_index.get(&number) {
                Some(&index) => Destination::Variable(Kind::L, index),
                None => return Statement::Nothing,
            },
            Target::Var(kind, number) => Destination::Variable(kind, u32::from(number)),
            Target::Indirect(kind, index) => Destination::Indirect(kind, self.expression(index)),
            Target::Range { kind: Kind::L, first, count, step } => {
                Destination::LVariables(self.l_variable_range(first, count, step))
            }
            Target::Range { kind, first, count, step } => Destination::Range {
                kind,
                first: first.into(),
                count: count.into(),
                step: step.into(),
            },
        };
        Statement::Assign(destination, self.expression(value))
    }

    /// An assignment to L-variables whose right side is computed in integers.
    fn assign_integer(&mut self, target: Target, value: Expr) -> Statement {
        match target {
            Target::Var(_, number) => match self.l_variable_index.get(&number).copied() {
                Some(index) => Statement::AssignInteger(index, self.integer_expression(value)),
                None => Statement::Nothing,
            },
            Target::Range { first, count, step, .. } => {
                let l_variables = self.l_variable_range(first, count, step);
                Statement::AssignIntegers(l_variables, self.integer_expression(value))
            }
            Target::Indirect(..) => Statement::Nothing,
        }
    }

    fn l_variable_range(&mut self, first: u16, count: u16, step: u16) -> TableRange {
        let start = self.tables.l_variable_ranges.len();
        for k in 0..count {
            let number = first.wrapping_add(k.wrapping_mul(step));
            if let Some(&index) = self.l_variable_index.get(&number) {
                self.tables.l_variable_ranges.push(index);
            }
        }
        TableRange::since(start, &self.tables.l_variable_ranges)
    }

    /// The field that an M-variable means by its definition after load, and the offset of the field's word in the
    /// image; `None` if the definition means anything else.
    fn field(&self, number: u16) -> Option<(u32, Field)> {
        let (space, address, field) =
            match Definition::decode(*self.tables.definitions.get(usize::from(number))?) {
                Definition::X { address, field } => (Space::X, address, field),
                Definition::Y { address, field } => (Space::Y, address, field),
                _ => return None,
            };
        Some((self.map.plain_word(&self.layout, space, address)?, field))
    }

    fn expression(&mut self, expr: Expr) -> TableRange {
        let mut operations = std::mem::take(&mut self.tables.operations);
        let range = append(self.download.ops(expr), &mut operations, |op| match op {
            Op::Const(value) => Some(Operand::Constant(value)),
            Op::Var(kind, number) => Some(self.variable(kind, number)),
            Op::Indirect(_)
            | Op::Neg
            | Op::Bin(_)
            | Op::Call(_)
            | Op::Cmp(_)
            | Op::Both
            | Op::Either => None,
        });
        self.tables.operations = operations;
        range
    }

    fn integer_expression(&mut self, expr: Expr) -> TableRange {
        let mut operations = std::mem::take(&mut self.tables.integer_operations);
        let range = append(self.download.ops(expr), &mut operations, |op| match op {
            Op::Const(value) => Some(IntegerOperand::Constant(value as i32)),
            Op::Var(_, number) => Some(self.l_operand(number)),
            Op::Indirect(_)
            | Op::Neg
            | Op::Bin(_)
            | Op::Call(_)
            | Op::Cmp(_)
            | Op::Both
            | Op::Either => None,
        });
        self.tables.integer_operations = operations;
        range
    }

    /// An L-variable in a statement that is computed in integers.
    fn l_operand(&self, number: u16) -> IntegerOperand {
        let Some(&index) = self.l_variable_index.get(&number) else {
            return IntegerOperand::Constant(0);
        };
        let bits = self.tables.l_variables.get(index as usize).and_then(|variable| {
            // Integers have 24 bits with a sign, whatever the format says of a whole word.
            let field = match variable.field {
                Field { width: 24, format: Format::U, offset } => {
                    Field { width: 24, format: Format::S, offset }
                }
                other => other,
            };
            Bits::new(variable.offset?, field)
        });
        bits.map_or(IntegerOperand::L(index), |bits| IntegerOperand::Bits(number, bits))
    }

    fn variable(&self, kind: Kind, number: u16) -> Operand {
        let wide = u32::from(number);
        match kind {
            Kind::P => Operand::Double(self.layout.p + 8 * wide),
            Kind::I => Operand::Double(self.layout.i + 8 * wide),
            Kind::Q => Operand::Q(wide),
            Kind::L => Operand::L(self.l_variable_index.get(&number).copied().unwrap_or(u32::MAX)),
            Kind::M => {
                let bits = self.field(number).and_then(|(offset, field)| Bits::new(offset, field));
                bits.map_or(Operand::M(wide), |bits| Operand::Field(number, bits))
            }
        }
    }
}

/// Appends the operations of an expression to a table. `operand` gives what a constant or a variable is there, and
/// `None` for an operation that reads neither.
fn append<T>(
    ops: &[Op],
    table: &mut Vec<Operation<T>>,
    operand: impl Fn(Op) -> Option<T>,
) -> TableRange {
    let start = table.len();
    let mut depth = 0i32;
    let mut ops = ops.iter().copied().peekable();
    while let Some(op) = ops.next() {
        let Some(operand) = operand(op) else {
            depth -= i32::from(matches!(op, Op::Bin(_) | Op::Cmp(_) | Op::Both | Op::Either));
            table.push(match op {
                Op::Bin(bin) => Operation::BinaryWaiting(bin),
                Op::Cmp(cmp) => Operation::CompareWaiting(cmp),
                Op::Both => Operation::Both,
                Op::Either => Operation::Either,
                Op::Neg => Operation::Negate,
                Op::Call(func) => Operation::Call(func),
                Op::Indirect(kind) => Operation::Indirect(kind),
                Op::Const(_) | Op::Var(..) => continue,
            });
            continue;
        };
        let operation = match ops.peek() {
            Some(&Op::Bin(bin)) => Operation::Binary(bin, operand),
            Some(&Op::Cmp(cmp)) => Operation::Compare(cmp, operand),
            _ => {
                depth += 1;
                table.push(if depth == 1 {
                    Operation::Load(operand)
                } else {
                    Operation::Push(operand)
                });
                continue;
            }
        };
        ops.next();
        table.push(operation);
    }
    TableRange::since(start, table)
}
