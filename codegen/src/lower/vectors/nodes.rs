//! How rows of values are computed: lane by lane the same operation, down to loads and constants.

use plcc_ir::{Address, BinaryOp, ConvertOp, InstData, Type, UnaryOp, Value};

use super::plan::{Planner, SHAPE_DEPTH};
use super::row::{Format, Node};

impl Planner<'_> {
    /// The node that computes a row of values.
    pub(super) fn row(&mut self, lanes: &[Value], format: Format, depth: u32) -> Option<usize> {
        let key = (lanes.to_vec(), format);
        if let Some(&known) = self.known.get(&key) {
            return Some(known);
        }
        let node = self.node(lanes, format, depth)?;
        self.vectors.nodes.push(node);
        let number = self.vectors.nodes.len() - 1;
        self.added.push(key.clone());
        self.known.insert(key, number);
        Some(number)
    }

    /// How a row of values is computed; operations are followed to a depth.
    fn node(&mut self, lanes: &[Value], format: Format, depth: u32) -> Option<Node> {
        let first = *lanes.first()?;
        let ty = self.func.ty(first);
        if !format.holds(ty) || lanes.iter().any(|&lane| self.func.ty(lane) != ty) {
            return None;
        }
        let constants: Option<Vec<i64>> =
            lanes.iter().map(|&lane| self.func.constant(lane)).collect();
        if let Some(constants) = constants {
            return Some(Node::Constants(ty, format, constants));
        }
        if lanes.iter().all(|&lane| lane == first) {
            return Some(Node::Splat(first, format));
        }
        let depth = depth.checked_sub(1)?;
        let data: Vec<InstData> = lanes
            .iter()
            .map(|&lane| {
                let inst = self.func.definition(lane)?;
                let here = self.positions[inst] != u32::MAX;
                here.then(|| *self.func.inst(inst))
            })
            .collect::<Option<_>>()?;
        match *data.first()? {
            InstData::Load { .. } => self.loads(lanes, &data, format),
            InstData::Unary { op: op @ (UnaryOp::Not | UnaryOp::Neg), .. } => {
                let args: Vec<Value> = data
                    .iter()
                    .map(|data| match *data {
                        InstData::Unary { op: other, arg } if other == op => Some(arg),
                        _ => None,
                    })
                    .collect::<Option<_>>()?;
                Some(Node::Unary(op, self.row(&args, format, depth)?, format))
            }
            InstData::Binary { op, .. } if is_lanewise(op) => {
                let args = data.iter().map(|data| match *data {
                    InstData::Binary { op: other, args } if other == op => Some(args),
                    _ => None,
                });
                let args = args.collect::<Option<Vec<_>>>()?;
                let args = self.operands(args, op.is_commutative(), format, depth)?;
                Some(Node::Binary(op, args))
            }
            InstData::Icmp { cond, args: [a, _] }
                if format == Format::Integers(self.func.ty(a)) =>
            {
                let args = data.iter().map(|data| match *data {
                    InstData::Icmp { cond: other, args } if other == cond => Some(args),
                    _ => None,
                });
                let args = args.collect::<Option<Vec<_>>>()?;
                let args = self.operands(args, false, format, depth)?;
                Some(Node::Compare(cond, args))
            }
            InstData::Select { .. } => {
                let parts = data.iter().map(|data| match *data {
                    InstData::Select { cond, args: [a, b] } => Some((cond, (a, b))),
                    _ => None,
                });
                let (conds, args): (Vec<_>, Vec<_>) =
                    parts.collect::<Option<Vec<_>>>()?.into_iter().unzip();
                let (a, b): (Vec<_>, Vec<_>) = args.into_iter().unzip();
                let cond = self.row(&conds, format, depth)?;
                let args = [self.row(&a, format, depth)?, self.row(&b, format, depth)?];
                Some(Node::Select(cond, args, format))
            }
            InstData::Convert { op: ConvertOp::Zext, to, arg }
                if self.func.ty(arg) == Type::I1 && format == Format::Integers(to) =>
            {
                let args = data.iter().map(|data| match *data {
                    InstData::Convert { op: ConvertOp::Zext, to: _, arg } => Some(arg),
                    _ => None,
                });
                let args = args.collect::<Option<Vec<_>>>()?;
                Some(Node::Extend(self.row(&args, format, depth)?, format))
            }
            _ => None,
        }
    }

    /// The rows of both operands. Those of an operation that allows it are exchanged in lanes where they then
    /// are more like those of the first lane.
    fn operands(
        &mut self,
        mut args: Vec<[Value; 2]>,
        is_commutative: bool,
        format: Format,
        depth: u32,
    ) -> Option<[usize; 2]> {
        if is_commutative {
            let shapes = |args: [Value; 2]| args.map(|arg| self.shape(arg, SHAPE_DEPTH));
            let wanted = shapes(*args.first()?);
            if wanted[0] != wanted[1] {
                for args in &mut args {
                    let [a, b] = shapes(*args);
                    if [a, b] != wanted && [b, a] == wanted {
                        args.swap(0, 1);
                    }
                }
            }
        }
        let (a, b): (Vec<Value>, Vec<Value>) = args.into_iter().map(|[a, b]| (a, b)).unzip();
        Some([self.row(&a, format, depth)?, self.row(&b, format, depth)?])
    }

    /// A row of loads.
    fn loads(&self, lanes: &[Value], data: &[InstData], format: Format) -> Option<Node> {
        let ty = self.func.ty(*lanes.first()?);
        let mut addresses = vec![];
        for (&lane, data) in lanes.iter().zip(data) {
            let InstData::Load { ty: _, at } = *data else { return None };
            let position = self.positions[self.func.definition(lane)?];
            if at.index.is_some() || at.volatile || self.has_effect_between(position, self.end) {
                return None;
            }
            let bytes = self.bytes(&at, ty)?;
            if self.indexed_between(position, self.end, &bytes, true) {
                return None;
            }
            for byte in bytes {
                let mut accesses = self.accesses.get(&byte).into_iter().flatten();
                let changes = |&(then, is_store): &(u32, bool)| {
                    is_store
                        && (position..=self.end).contains(&then)
                        && self.delayed.get(&then).is_none_or(|&end| end < self.end)
                };
                if accesses.any(changes) {
                    return None;
                }
            }
            addresses.push(at);
        }
        let first = *addresses.first()?;
        let is_neighbour = |(at, number): (&Address, u32)| {
            at.region == first.region && at.offset == first.offset + number * ty.bytes()
        };
        Some(if addresses.iter().zip(0..).all(is_neighbour) {
            Node::Load(first, ty, format)
        } else if addresses.iter().all(|&at| at == first) {
            Node::SplatLoad(first, ty, format)
        } else {
            Node::Gather(addresses, ty, format)
        })
    }
}

/// Whether an operation works on each lane alone, as a vector instruction.
fn is_lanewise(op: BinaryOp) -> bool {
    matches!(
        op,
        BinaryOp::And
            | BinaryOp::Or
            | BinaryOp::Xor
            | BinaryOp::Add
            | BinaryOp::Sub
            | BinaryOp::Smin
            | BinaryOp::Smax
            | BinaryOp::Umin
            | BinaryOp::Umax
    )
}
