//! Instructions of two versions of a function that are followed in another way than in a scan: local bits, doubles, and what
//! happens in the order of the program.

use plcc_ir::{ConvertOp, Inst, InstData, RegionId, Type, UnaryOp, Value};

use super::terms::Function;
use super::walk::{Context, Happening, Version};
use crate::logic::{FALSE, Lit, Memory};
use crate::scan::instruction::State;

/// An instruction of a block.
pub(super) struct Step<'s, 'u, 'c, 'm> {
    pub(super) context: &'s mut Context<'u>,
    pub(super) version: &'s Version<'c, 'm>,
    pub(super) state: &'s mut State<'c, 'm>,
    pub(super) history: &'s mut Lit,
    pub(super) local: &'s mut Memory,
    pub(super) happenings: &'s mut Vec<Happening>,
}

impl Step<'_, '_, '_, '_> {
    pub(super) fn instruction(&mut self, inst: Inst) {
        if let Some(bits) = self.own(inst) {
            self.state.set_result(inst, bits);
        } else {
            self.state.instruction(&mut self.context.builder, inst);
        }
        let func = self.version.data;
        if let Some(result) = func.result(inst).filter(|&it| func.ty(it) == Type::I1) {
            let Context { builder, terms, .. } = &mut *self.context;
            let bits = self.state.bits(result);
            let bits = bits.into_iter().map(|bit| terms.truth(&builder.graph, bit)).collect();
            self.state.set_result(inst, bits);
        }
    }

    /// The result of an instruction that is followed in another way than in a scan.
    fn own(&mut self, inst: Inst) -> Option<Vec<Lit>> {
        let func = self.version.data;
        let Context { builder, terms, .. } = &mut *self.context;
        let graph = &mut builder.graph;
        let bits = |value: Value| self.state.bits(value);
        match *func.inst(inst) {
            InstData::Unary { op: UnaryOp::Fsqrt, arg } => {
                Some(terms.square_root(graph, &bits(arg)))
            }
            InstData::Unary { op: UnaryOp::Ffinite, arg } => {
                Some(terms.made_finite(graph, &bits(arg)))
            }
            InstData::Binary { op, args: [a, b] } if func.ty(a) == Type::F64 => {
                Some(terms.binary(graph, op, &bits(a), &bits(b)))
            }
            InstData::Binary { op, args: [a, b] } => {
                super::divide::binary(graph, terms, op, &bits(a), &bits(b))
            }
            InstData::Fcmp { cond, args: [a, b] } => {
                Some(vec![terms.compare(graph, cond, &bits(a), &bits(b))])
            }
            InstData::Convert { op: ConvertOp::IntToFloat, to: _, arg } => {
                Some(terms.of_int(graph, &bits(arg)))
            }
            InstData::Convert {
                op: op @ (ConvertOp::FloatToInt | ConvertOp::IsInteger | ConvertOp::IsIntegerOrNan),
                to,
                arg,
            } => Some(terms.convert(graph, op, to, &bits(arg))),
            InstData::HostCall { function, args } if function.is_pure() => {
                let args: Vec<Vec<Lit>> = args.as_slice().iter().map(|&arg| bits(arg)).collect();
                Some(terms.pure(graph, function, &args))
            }
            InstData::HostCall { function, args } => {
                let operands = args.as_slice().iter().flat_map(|&arg| bits(arg)).collect();
                let width = func.result(inst).map_or(0, |value| func.ty(value).bits() as usize);
                let result = self.happen(Function::Call(function), operands, width, true);
                Some(match function.double_range() {
                    plcc_abi::DoubleRange::Any => result,
                    range => super::universe::finite(
                        &mut self.context.builder.graph,
                        &result,
                        range == plcc_abi::DoubleRange::FiniteOrMinusZero,
                    ),
                })
            }
            InstData::IsLate => Some(self.happen(Function::Late, vec![], 1, false)),
            InstData::Load { ty, at } if at.region == RegionId::LOCAL_BITS => {
                let mut bits = self.local.load(at.offset as usize, ty.bytes() as usize);
                bits.truncate(ty.bits() as usize);
                Some(bits)
            }
            InstData::Store { at, value } if at.region == RegionId::LOCAL_BITS => {
                let bits = bits(value);
                self.local.store(at.offset as usize, &bits);
                Some(vec![])
            }
            InstData::Unpack { word, to } => {
                let word = bits(word);
                for group in to.iter() {
                    for (place, number) in to.bits(group).zip(8 * group..) {
                        let bit = word.get(number as usize).copied().unwrap_or(FALSE);
                        self.local.store(place as usize, &[bit]);
                    }
                }
                Some(vec![])
            }
            InstData::Pack { from } => {
                let mut word = vec![FALSE; 32];
                for group in from.iter() {
                    for (place, number) in from.bits(group).zip(8 * group..) {
                        if let Some(slot) = word.get_mut(number as usize) {
                            *slot = self.local.bit(place as usize, 0);
                        }
                    }
                }
                Some(word)
            }
            InstData::Load { ty, at } if at.volatile => {
                let offset = self.state.offset(&at);
                let index = at.index.map(|index| bits(index.value)).unwrap_or_default();
                let (scale, count) = at.index.map_or((0, 0), |index| (index.scale, index.count));
                let is_word = self.version.code.module.word_regions.contains(&at.region);
                let width = ty.bits() as usize;
                let read = Function::Read(offset, scale, count);
                let mut result = self.happen(read, index, width, false);
                if is_word && ty == Type::I32 {
                    for bit in result.iter_mut().skip(24) {
                        *bit = FALSE;
                    }
                }
                Some(result)
            }
            InstData::Store { at, value } if at.volatile => {
                let offset = self.state.offset(&at);
                let mut operands = at.index.map(|index| bits(index.value)).unwrap_or_default();
                operands.extend(bits(value));
                let (scale, count) = at.index.map_or((0, 0), |index| (index.scale, index.count));
                self.state.instruction(&mut self.context.builder, inst);
                self.happen(Function::Write(offset, scale, count), operands, 0, false);
                Some(vec![])
            }
            _ => None,
        }
    }

    /// Something happens that depends on all that happened before and, but for the clock, on the image.
    fn happen(
        &mut self,
        function: Function,
        operands: Vec<Lit>,
        width: usize,
        changes_image: bool,
    ) -> Vec<Lit> {
        let Context { builder, terms, universe, .. } = &mut *self.context;
        let graph = &mut builder.graph;
        let mut all = vec![*self.history];
        all.extend(operands);
        let memory = &mut self.state.arrival.memory;
        if function != Function::Late {
            all.extend(universe.bits(memory));
        }
        let image = if changes_image { universe.width() } else { 0 };
        let (results, application) = terms.apply(graph, function, all, 1 + width + image);
        let cond = self.state.arrival.cond;
        self.happenings.push(Happening { application, cond });
        let (history, rest) = results.split_at(1);
        let (result, raw) = rest.split_at(width.min(rest.len()));
        *self.history = history.first().copied().unwrap_or(FALSE);
        if changes_image {
            universe.fill(graph, memory, raw);
        }
        result.to_vec()
    }
}
