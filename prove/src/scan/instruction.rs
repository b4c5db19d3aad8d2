//! Single instructions of the IR on literals; what each gives is what [`plcc_ir::eval`] says.

use plcc_ir::{
    Address, BinaryOp, ConvertOp, ExtractOp, Func, FuncData, Inst, InstData, IntCond, RegionId,
    Type, UnaryOp, Value, eval,
};
use rustc_hash::FxHashMap;

use super::functions;
use super::paths::{Control, FUEL, Followed};
use super::{Arrival, Builder, Code};
use crate::logic::{FALSE, Graph, Lit, TRUE};

/// How many elements of an array an access at a computed index may have.
pub(crate) const MOST_ELEMENTS: u32 = 4096;

/// A block that is being executed.
pub(crate) struct State<'c, 'm> {
    pub(super) code: &'c Code<'m>,
    pub(crate) func: &'m FuncData,
    pub(super) crossing: &'c [bool],
    pub(crate) arrival: Arrival,
    /// The values of this block.
    pub(super) local: FxHashMap<u32, Vec<Lit>>,
    pub(super) control: Control,
}

impl<'c, 'm> State<'c, 'm> {
    /// A block of a function of [`Code::of_functions`].
    pub(crate) fn of_function(code: &'c Code<'m>, func: Func, arrival: Arrival) -> Option<Self> {
        Some(Self {
            code,
            func: code.module.funcs.get(func.index())?,
            crossing: code.crossing(func),
            arrival,
            local: FxHashMap::default(),
            control: Control::default(),
        })
    }
}

impl State<'_, '_> {
    /// The bits of a value.
    pub(crate) fn bits(&self, value: Value) -> Vec<Lit> {
        let own = self.local.get(&value.0).or_else(|| self.arrival.values.get(&value.0));
        own.cloned().unwrap_or_else(|| vec![FALSE; self.func.ty(value).bits() as usize])
    }

    fn constant(&self, value: Value) -> Option<i64> {
        number(&self.bits(value))
    }

    pub(crate) fn instruction(&mut self, builder: &mut Builder, inst: Inst) {
        let bits = self.result(builder, inst);
        self.set_result(inst, bits);
    }

    /// Puts the result of an instruction, if it has one.
    pub(crate) fn set_result(&mut self, inst: Inst, bits: Vec<Lit>) {
        let Some(result) = self.func.result(inst) else { return };
        if self.crossing.get(result.0 as usize).copied().unwrap_or(true) {
            self.arrival.values.insert(result.0, bits.clone());
        }
        self.local.insert(result.0, bits);
    }

    /// What is not computed: something of which only equal operands are known to give equal results.
    fn not_computed(&self, builder: &mut Builder, inst: Inst, text: &str) -> Vec<Lit> {
        let data = self.func.inst(inst);
        let mut operands = vec![];
        data.for_each_arg(|value| operands.extend(self.bits(value)));
        let width = self.func.result(inst).map_or(0, |value| self.func.ty(value).bits() as usize);
        let mut plain = *data;
        plain.for_each_arg_mut(|value| *value = Value(0));
        let reason = self.code.reason(text, self.func.loc(inst));
        builder.function(format!("{plain:?}"), operands, width, reason)
    }

    fn result(&mut self, builder: &mut Builder, inst: Inst) -> Vec<Lit> {
        let func = self.func;
        let data = func.inst(inst);
        if let Some(found) = self.by_table(builder, inst) {
            return found;
        }
        let graph = &mut builder.graph;
        match *data {
            InstData::Iconst { ty, value } => graph.number(ty.bits() as usize, value),
            InstData::Fconst { bits } => graph.number(64, bits as i64),
            InstData::Unary { op, arg } => {
                let x = self.bits(arg);
                match op {
                    UnaryOp::Not => graph.invert(&x),
                    UnaryOp::Neg => graph.negate(&x),
                    UnaryOp::Fneg | UnaryOp::Fabs => {
                        let mut x = x;
                        if let Some(sign) = x.last_mut() {
                            *sign = if op == UnaryOp::Fneg { !*sign } else { FALSE };
                        }
                        x
                    }
                    UnaryOp::Ffloor => graph.without_fraction(&x, |sign| sign),
                    UnaryOp::Fceil => graph.without_fraction(&x, |sign| !sign),
                    UnaryOp::Ftrunc => graph.without_fraction(&x, |_| FALSE),
                    UnaryOp::Ffinite => graph.finite(&x),
                    UnaryOp::Fsqrt => match number(&x) {
                        Some(x) => graph.number(64, eval::unary(op, Type::F64, x)),
                        None => self.not_computed(builder, inst, FRACTIONS),
                    },
                }
            }
            InstData::Binary { op, args: [a, b] } => {
                let (x, y) = (self.bits(a), self.bits(b));
                if let (Some(x), Some(y)) = (number(&x), number(&y)) {
                    let ty = func.ty(a);
                    return graph.number(ty.bits() as usize, eval::binary(op, ty, x, y));
                }
                Self::binary(graph, op, &x, &y)
            }
            InstData::Icmp { cond, args: [a, b] } => {
                let (x, y) = (self.bits(a), self.bits(b));
                vec![match cond {
                    IntCond::Eq => graph.equal(&x, &y),
                    IntCond::Ne => !graph.equal(&x, &y),
                    IntCond::Slt => graph.less_signed(&x, &y),
                    IntCond::Sge => !graph.less_signed(&x, &y),
                    IntCond::Sgt => graph.less_signed(&y, &x),
                    IntCond::Sle => !graph.less_signed(&y, &x),
                    IntCond::Ult => graph.less_unsigned(&x, &y),
                    IntCond::Uge => !graph.less_unsigned(&x, &y),
                    IntCond::Ugt => graph.less_unsigned(&y, &x),
                    IntCond::Ule => !graph.less_unsigned(&y, &x),
                }]
            }
            InstData::Fcmp { cond, args: [a, b] } => {
                let (x, y) = (self.bits(a), self.bits(b));
                let compared = graph.compare_floats(&x, &y);
                vec![graph.float_condition(cond, compared)]
            }
            InstData::Select { cond, args: [a, b] } => {
                let cond = self.bits(cond).first().copied().unwrap_or(FALSE);
                let (x, y) = (self.bits(a), self.bits(b));
                graph.choose_bits(cond, &x, &y)
            }
            InstData::Convert { op, to, arg } => {
                let x = self.bits(arg);
                let width = to.bits() as usize;
                match op {
                    ConvertOp::Sext => graph.resize_signed(&x, width),
                    ConvertOp::Zext | ConvertOp::Trunc => graph.resize(&x, width, FALSE),
                    ConvertOp::Bitcast => x,
                    ConvertOp::IntToFloat => {
                        // A truth value is 0 or 1.
                        let sign =
                            if x.len() == 1 { FALSE } else { x.last().copied().unwrap_or(FALSE) };
                        let wide = graph.resize(&x, x.len() + 1, sign);
                        graph.float_of_int(&wide)
                    }
                    ConvertOp::FloatToInt => {
                        let int = graph.int_of_float(&x);
                        graph.resize_signed(&int, width)
                    }
                    ConvertOp::IsInteger => vec![graph.is_integer(&x).0],
                    ConvertOp::IsIntegerOrNan => {
                        let (is_integer, is_nan) = graph.is_integer(&x);
                        vec![graph.or(is_integer, is_nan)]
                    }
                }
            }
            InstData::Bit { arg, number } => {
                vec![self.bits(arg).get(usize::from(number)).copied().unwrap_or(FALSE)]
            }
            InstData::Extract { op, arg, field } => {
                let x = self.bits(arg);
                let (first, width) = (usize::from(field.first), usize::from(field.width));
                let part: Vec<Lit> = x.iter().copied().skip(first).take(width).collect();
                match op {
                    ExtractOp::Unsigned => graph.resize(&part, x.len(), FALSE),
                    ExtractOp::Signed => graph.resize_signed(&part, x.len()),
                }
            }
            InstData::Insert { args: [word, bits], field } => {
                let mut x = self.bits(word);
                let bits = self.bits(bits);
                let (first, width) = (usize::from(field.first), usize::from(field.width));
                for (slot, bit) in
                    x.iter_mut().skip(first).take(width).zip(bits.into_iter().chain([FALSE; 64]))
                {
                    *slot = bit;
                }
                x
            }
            InstData::Load { ty, at } => self.load(builder, inst, ty, &at),
            InstData::Store { at, value } => {
                self.store(builder, inst, &at, value);
                vec![]
            }
            // The IR as the front end makes it has no local bits.
            InstData::Unpack { .. } => vec![],
            InstData::Pack { .. } => self.not_computed(builder, inst, "keeps bits in bytes"),
            InstData::IsLate => vec![FALSE],
            InstData::HostCall { function, .. } => {
                if function.is_pure() {
                    let mut args = vec![];
                    data.for_each_arg(|value| args.push(self.bits(value)));
                    let found = functions::pure(graph, function, &args);
                    let (result, known) = found.unwrap_or((vec![], FALSE));
                    if known == TRUE {
                        return result;
                    }
                    let open = self.not_computed(builder, inst, FRACTIONS);
                    return match known {
                        FALSE => open,
                        _ => builder.graph.choose_bits(known, &result, &open),
                    };
                }
                if let Some(pmac) = builder.pmac.clone() {
                    let mut args = vec![];
                    data.for_each_arg(|value| args.push(self.bits(value)));
                    let reason = self.code.reason(HOST, func.loc(inst));
                    let Arrival { cond, memory, .. } = &mut self.arrival;
                    return pmac.call(builder, *cond, memory, (function, &args), &reason);
                }
                self.call(builder, inst, function.name());
                let width = func.result(inst).map_or(0, |value| func.ty(value).bits() as usize);
                let reason = self.code.reason(HOST, func.loc(inst));
                builder.unknown(width, reason)
            }
        }
    }

    fn binary(graph: &mut Graph, op: BinaryOp, x: &[Lit], y: &[Lit]) -> Vec<Lit> {
        let width = x.len();
        let sign = x.last().copied().unwrap_or(FALSE);
        let bitwise = |graph: &mut Graph, f: fn(&mut Graph, Lit, Lit) -> Lit| {
            x.iter().zip(y).map(|(&a, &b)| f(graph, a, b)).collect::<Vec<Lit>>()
        };
        match op {
            BinaryOp::Add => graph.add(x, y),
            BinaryOp::Sub => graph.subtract(x, y).0,
            BinaryOp::Mul => graph.multiply(x, y),
            BinaryOp::Umulh => {
                let (a, b) = (graph.resize(x, 2 * width, FALSE), graph.resize(y, 2 * width, FALSE));
                graph.multiply(&a, &b).split_off(width)
            }
            BinaryOp::Sdiv | BinaryOp::Srem | BinaryOp::Udiv | BinaryOp::Urem => {
                let (quotient, rest) = match op {
                    BinaryOp::Sdiv | BinaryOp::Srem => graph.divide_signed(x, y),
                    _ => graph.divide_unsigned(x, y),
                };
                let is_quotient = matches!(op, BinaryOp::Sdiv | BinaryOp::Udiv);
                let result = if is_quotient { quotient } else { rest };
                let divides = graph.is_not_zero(y);
                result.into_iter().map(|bit| graph.and(divides, bit)).collect()
            }
            BinaryOp::Smod => {
                let (_, rest) = graph.divide_signed(x, y);
                let sign_y = y.last().copied().unwrap_or(FALSE);
                let sign_rest = rest.last().copied().unwrap_or(FALSE);
                let (is_rest, other_sign) =
                    (graph.is_not_zero(&rest), graph.xor(sign_rest, sign_y));
                let moved = graph.and(is_rest, other_sign);
                let sum = graph.add(&rest, y);
                let result = graph.choose_bits(moved, &sum, &rest);
                let divides = graph.is_not_zero(y);
                result.into_iter().map(|bit| graph.and(divides, bit)).collect()
            }
            BinaryOp::And => bitwise(graph, Graph::and),
            BinaryOp::Or => bitwise(graph, Graph::or),
            BinaryOp::Xor => bitwise(graph, Graph::xor),
            BinaryOp::Shl => graph.shift(x, y, true, FALSE),
            BinaryOp::Lshr => graph.shift(x, y, false, FALSE),
            BinaryOp::Ashr => graph.shift(x, y, false, sign),
            BinaryOp::Smin | BinaryOp::Smax | BinaryOp::Umin | BinaryOp::Umax => {
                let less = match op {
                    BinaryOp::Smin | BinaryOp::Smax => graph.less_signed(x, y),
                    _ => graph.less_unsigned(x, y),
                };
                match op {
                    BinaryOp::Smin | BinaryOp::Umin => graph.choose_bits(less, x, y),
                    _ => graph.choose_bits(less, y, x),
                }
            }
            BinaryOp::Fadd => graph.add_floats(x, y),
            BinaryOp::Fsub => graph.subtract_floats(x, y),
            BinaryOp::Fmul => graph.multiply_floats(x, y),
            BinaryOp::Fdiv => graph.divide_floats(x, y),
        }
    }

    /// The offset in the image of an address without its index.
    pub(crate) fn offset(&self, at: &Address) -> usize {
        let region = self.code.module.region(at.region).map_or(0, |region| region.offset);
        region.wrapping_add(at.offset) as usize
    }

    /// The part of the control's own that an address is.
    fn followed(&self, at: &Address) -> Option<Followed> {
        self.code.paths.followed(at, |value| self.constant(value))
    }

    fn load(&mut self, builder: &mut Builder, inst: Inst, ty: Type, at: &Address) -> Vec<Lit> {
        let width = ty.bits() as usize;
        if at.region == RegionId::LOCAL_BITS {
            return self.not_computed(builder, inst, "keeps bits in bytes");
        }
        if let Some(followed) = self.followed(at) {
            let value = match followed {
                Followed::Depth => Some(self.control.depth),
                Followed::Fuel => Some(FUEL),
                Followed::OnEmpty => Some(0),
                Followed::Pending => self.control.pending,
                Followed::Site(index) => index
                    .and_then(|index| usize::try_from(index).ok())
                    .and_then(|index| self.control.sites.get(index).copied()),
            };
            return builder.graph.number(width, value.unwrap_or(0));
        }
        let (offset, bytes) = (self.offset(at), ty.bytes() as usize);
        let element = |state: &Self, number: u32, scale: u32| {
            let mut bits = state.arrival.memory.load(offset + (number * scale) as usize, bytes);
            bits.truncate(width);
            bits
        };
        let Some(index) = at.index else { return element(self, 0, 0) };
        let number = self.bits(index.value);
        if let Some(known) = crate::scan::instruction::number(&number) {
            let known = known as u32;
            return element(self, if known < index.count { known } else { 0 }, index.scale);
        }
        if index.count > MOST_ELEMENTS {
            let reason = self.code.reason(LARGE_ARRAY, self.func.loc(inst));
            return builder.unknown(width, reason);
        }
        // A tree of choices, by the bits of the index from the lowest on.
        let mut values: Vec<Vec<Lit>> =
            (0..index.count).map(|number| element(self, number, index.scale)).collect();
        let first = values.first().cloned().unwrap_or_default();
        for &bit in &number {
            if values.len() <= 1 {
                break;
            }
            values = values
                .chunks(2)
                .map(|pair| match pair {
                    [low, high] => builder.graph.choose_bits(bit, high, low),
                    [low] => low.clone(),
                    _ => vec![],
                })
                .collect();
        }
        let count = builder.graph.number(number.len(), index.count.into());
        let inside = builder.graph.less_unsigned(&number, &count);
        let found = values.into_iter().next().unwrap_or_default();
        builder.graph.choose_bits(inside, &found, &first)
    }

    fn store(&mut self, builder: &mut Builder, inst: Inst, at: &Address, value: Value) {
        if at.region == RegionId::LOCAL_BITS {
            return;
        }
        let bits = self.bits(value);
        match self.followed(at) {
            Some(Followed::Fuel) => {
                self.arrival.passed += 1;
                return;
            }
            Some(Followed::Depth) => {
                self.control.depth = number(&bits).unwrap_or(0);
                return;
            }
            Some(Followed::Site(index)) => {
                let index = index.and_then(|index| usize::try_from(index).ok()).unwrap_or(0);
                if self.control.sites.len() <= index {
                    self.control.sites.resize(index.min(1000) + 1, -1);
                }
                if let Some(slot) = self.control.sites.get_mut(index) {
                    *slot = number(&bits).unwrap_or(-1);
                }
                return;
            }
            Some(Followed::Pending) => {
                self.control.pending = number(&bits);
                return;
            }
            Some(Followed::OnEmpty) => return,
            None => {}
        }
        let offset = self.offset(at);
        let Some(index) = at.index else {
            self.arrival.memory.store(offset, &bits);
            return;
        };
        let position = self.bits(index.value);
        if let Some(known) = number(&position) {
            let known = known as u32;
            let known = if known < index.count { known } else { 0 };
            self.arrival.memory.store(offset + (known * index.scale) as usize, &bits);
            return;
        }
        if index.count > MOST_ELEMENTS {
            let reason = self.code.reason(LARGE_ARRAY, self.func.loc(inst));
            let reason = builder.reason(reason);
            builder.escapes.push((self.arrival.cond, reason));
            return;
        }
        let graph = &mut builder.graph;
        let count = graph.number(position.len(), index.count.into());
        let inside = graph.less_unsigned(&position, &count);
        for element in 0..index.count {
            let this = graph.number(position.len(), element.into());
            let mut is_this = graph.equal(&position, &this);
            if element == 0 {
                is_this = graph.or(is_this, !inside);
            }
            let at = offset + (element * index.scale) as usize;
            let mut old = self.arrival.memory.load(at, bits.len().div_ceil(8));
            old.truncate(bits.len());
            let new = graph.choose_bits(is_this, &bits, &old);
            self.arrival.memory.store(at, &new);
        }
    }

    /// A function of the control that changes the program's variables: afterwards they can have any value.
    fn call(&mut self, builder: &mut Builder, inst: Inst, name: &str) {
        let reason = self.code.reason(HOST, self.func.loc(inst));
        if !name.starts_with("nct_") {
            let reason = builder.reason(reason);
            builder.escapes.push((self.arrival.cond, reason));
            return;
        }
        for name in plcc_abi::nct::layout::region::FLAG {
            let region = self.code.module.regions.iter().find(|region| region.name == name);
            let Some(region) = region else { continue };
            for byte in 0..region.size {
                let offset = (region.offset + byte) as usize;
                // The byte behind F999 is always 0.
                let is_last = !region.bits && byte >= plcc_abi::nct::FLAG_BYTES as u32;
                if is_last {
                    continue;
                }
                let width = if region.bits { 1 } else { 8 };
                let bits = builder.unknown(width, reason.clone());
                self.arrival.memory.store(offset, &bits);
            }
        }
    }
}

const FRACTIONS: &str = "computes a function of fractions that is not followed";
const HOST: &str = "is a function of the control that is not followed";
const LARGE_ARRAY: &str = "names an element of an array that is too large to be followed";

/// The number that bits are, if all of them are known, with copies of its sign in front; a single bit is 0 or 1.
pub(crate) fn number(bits: &[Lit]) -> Option<i64> {
    let mut value = 0_u64;
    for (place, bit) in bits.iter().enumerate() {
        value |= u64::from(bit.value()?).checked_shl(place as u32).unwrap_or(0);
    }
    let spare = 64_u32.saturating_sub(bits.len() as u32);
    match bits.len() {
        0 => None,
        1 => Some(value as i64),
        _ => Some((value as i64).wrapping_shl(spare).wrapping_shr(spare)),
    }
}
