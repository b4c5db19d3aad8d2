//! Where each variable lies in the process image.
//!
//! Each type has a region of its own, so that two accesses of different types never touch the same
//! byte: `logical` (a byte for each LOGICAL), `integer`, and `long`, in which the timers' counters
//! lie too. Variables of a type lie in the order of their declarations, or else of their first use, but
//! the program's own among them in the natural order of their names. The region `port` has a byte of physical lines for each port. Programs with very long
//! expressions have a region `scratch`, in which compiled code keeps their intermediate values.

use plcc_abi::Region;
use plcc_abi::image::{read_i16, read_i32, read_u8};
use plcc_abi::pmi::{PORTS, Type};

use crate::common::natural_cmp;
use crate::pmi::ast::{Action, Checked, Meaning, Op, Ops, Symbol, SymbolId, Target};

/// An expression with more operations than this may be cut into several functions. What is on the
/// evaluation stack at a cut is then kept in the image.
pub(crate) const LONG_EXPRESSION: u32 = 1000;

/// The name of the region in which the evaluation stack is kept at a cut.
pub(crate) const SCRATCH: &str = "scratch";

/// The image's layout.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    /// By rising offset: `logical`, `integer`, `long`, `port` and, if it is needed, `scratch`.
    pub(crate) regions: Vec<Region>,
    /// The image's size in bytes.
    pub(crate) size: u32,
    /// Offset of each timer's counter.
    pub(crate) counters: Vec<u32>,
    /// Offset of the byte that holds each flip-flop's clock as it was last assigned.
    pub(crate) last_clocks: Vec<u32>,
    /// Offset of the physical lines, a byte for each port.
    pub(crate) ports: u32,
    /// Offset of each symbol, by its [`SymbolId`].
    offsets: Vec<u32>,
}

/// Where a variable lies in the image: its offset in bytes, and its type.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Location {
    pub(crate) offset: u32,
    pub(crate) ty: Type,
}

impl Location {
    /// The location of a LOGICAL.
    pub(crate) fn logical(offset: u32) -> Self {
        Self { offset, ty: Type::Logical }
    }

    /// The variable's value.
    pub(crate) fn read(self, image: &[u8]) -> i32 {
        match self.ty {
            Type::Logical => i32::from(read_u8(image, self.offset)),
            Type::Integer => i32::from(read_i16(image, self.offset)),
            Type::Long => read_i32(image, self.offset),
        }
    }
}

/// The name of the region of a type's variables.
pub(crate) fn region_name(ty: Type) -> &'static str {
    match ty {
        Type::Logical => "logical",
        Type::Integer => "integer",
        Type::Long => "long",
    }
}

impl Layout {
    /// Lays out a program's variables.
    pub(crate) fn new(checked: &Checked) -> Self {
        Self::in_order_of(checked, |name| name)
    }

    /// Lays out a program's variables, in the order of what `spelled` makes of their names.
    pub(crate) fn in_order_of<'n>(
        checked: &'n Checked,
        spelled: impl Fn(&'n str) -> &'n str,
    ) -> Self {
        let mut this = Self { offsets: vec![0; checked.symbols.len()], ..Self::default() };
        for ty in [Type::Logical, Type::Integer, Type::Long] {
            let start = this.size;
            for (offset, symbol) in this.offsets.iter_mut().zip(&checked.symbols) {
                if symbol.ty == ty && !matches!(symbol.meaning, Meaning::Label(_)) {
                    *offset = this.size;
                    this.size += symbol.elements.unwrap_or(1) * ty.size();
                }
            }
            this.sort(checked, ty, &spelled);
            match ty {
                Type::Logical => this.last_clocks = this.allocate(checked.flipflops.len(), 1),
                Type::Integer => {}
                Type::Long => this.counters = this.allocate(checked.timers.len(), 4),
            }
            this.region(region_name(ty), start, ty == Type::Logical);
        }
        this.ports = this.size;
        this.size += PORTS;
        this.region("port", this.ports, false);
        let depth = scratch_depth(checked);
        if depth > 0 {
            let start = this.size;
            this.size += depth * 4;
            this.region(SCRATCH, start, false);
        }
        this
    }

    /// Lets the program's own variables of a type that are not arrays exchange their offsets, so that they are
    /// in the natural order of their names: those of KEY1, KEY2, KEY3 and so on are neighbours, also if
    /// statements mention LAMP1 between KEY1 and KEY2. Statements that do the same with each of them are
    /// then computed at once.
    fn sort<'n>(&mut self, checked: &'n Checked, ty: Type, spelled: impl Fn(&'n str) -> &'n str) {
        let is_own = |symbol: &Symbol| {
            symbol.ty == ty
                && symbol.meaning == Meaning::Variable
                && !symbol.executive
                && symbol.elements.is_none()
        };
        let symbols = checked.symbols.iter().enumerate();
        let mut own: Vec<(usize, &'n Symbol)> =
            symbols.filter(|(_, symbol)| is_own(symbol)).collect();
        let offsets: Vec<u32> =
            own.iter().filter_map(|&(id, _)| self.offsets.get(id).copied()).collect();
        own.sort_by(|(_, a), (_, b)| natural_cmp(spelled(&a.name), spelled(&b.name)));
        for ((id, _), offset) in own.into_iter().zip(offsets) {
            if let Some(slot) = self.offsets.get_mut(id) {
                *slot = offset;
            }
        }
    }

    /// Makes room for `count` values of `size` bytes each and returns their offsets.
    fn allocate(&mut self, count: usize, size: u32) -> Vec<u32> {
        let start = self.size;
        self.size += count as u32 * size;
        (0..count as u32).map(|i| start + i * size).collect()
    }

    /// Ends a region that started at `start`.
    fn region(&mut self, name: &str, start: u32, bits: bool) {
        let size = self.size - start;
        self.regions.push(Region { name: name.to_owned(), offset: start, size, bits });
        self.size = self.size.next_multiple_of(8);
    }

    /// A symbol's offset in the image.
    pub(crate) fn offset(&self, id: SymbolId) -> Option<u32> {
        self.offsets.get(id.0 as usize).copied()
    }

    /// The offset of a type's region.
    pub(crate) fn base(&self, ty: Type) -> Option<u32> {
        let index = match ty {
            Type::Logical => 0,
            Type::Integer => 1,
            Type::Long => 2,
        };
        self.regions.get(index).map(|region: &Region| region.offset)
    }
}

/// How deep the evaluation stack of a long expression becomes at most; 0 if no expression is long.
fn scratch_depth(checked: &Checked) -> u32 {
    let expressions = checked.steps.iter().map(|step| match &step.action {
        Action::Assign { target: Target::Element(_, index), value } => (value, Some(index)),
        Action::Assign { value, .. } => (value, None),
        Action::If { condition, .. } => (condition, None),
        Action::Jump { .. } => (&(0..0), None),
    });
    expressions
        .filter(|(value, index)| is_long(value) || index.is_some_and(is_long))
        .map(|(value, index)| {
            // The index is computed first, and stays on the stack below the value's operands.
            let (index, below) = index.map_or((0, 0), |index| (depth(checked, index), 1));
            index.max(below + depth(checked, value))
        })
        .max()
        .unwrap_or(0)
}

/// Whether an expression is long enough to be cut into several functions.
pub(crate) fn is_long(ops: &Ops) -> bool {
    ops.end - ops.start > LONG_EXPRESSION
}

/// How deep the evaluation stack of an expression becomes.
fn depth(checked: &Checked, ops: &Ops) -> u32 {
    let (mut now, mut most) = (0u32, 0);
    for op in checked.ops(ops) {
        match op {
            Op::Const(_) | Op::Load(_) | Op::LoadAt(..) => now += 1,
            Op::Element(_) | Op::Neg { .. } | Op::Not => {}
            Op::Binary(_) => now = now.saturating_sub(1),
        }
        most = most.max(now);
    }
    most
}
