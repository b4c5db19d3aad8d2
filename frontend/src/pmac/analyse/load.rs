//! The state after load, which is what the on-line commands of a download make, executed in their
//! order.

use plcc_abi::image::{read_f64, write_f64, write_u32};
use plcc_abi::pmac::{
    Assumption, Controller, Kind, Layout, Memory, PlcOp, Range, Space, SparseMemory, Variable,
    arithmetic, fixed, layout::CONTEXTS,
};

use super::load_motion::{LoadedMotion, simulated_default};
use crate::pmac::ast::{Action, Download, Op, Target, WriteKind};
use crate::pmac::reference::tables;

/// Which of the PLCs or PLCCs 0 to 31 are enabled and which are paused: bit n is program n.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlcStates {
    pub(crate) enabled: u32,
    pub(crate) paused: u32,
}

impl PlcStates {
    /// The state after power-up: all are enabled.
    const START: Self = Self { enabled: u32::MAX, paused: 0 };

    /// Applies ENABLE, DISABLE, PAUSE or RESUME to the programs whose bits are 1 in `set`.
    fn apply(&mut self, op: PlcOp, set: u32) {
        let Self { enabled, paused } = *self;
        (self.enabled, self.paused) = match op {
            PlcOp::Enable => (enabled | set, paused & !set),
            PlcOp::Disable => (enabled & !set, paused & !set),
            PlcOp::Pause => (enabled & !set, paused | enabled & set),
            PlcOp::Resume => (enabled | paused & set, paused & !set),
        };
    }
}

/// The state after load, with which a program starts.
#[derive(Clone, Debug)]
pub(crate) struct Loaded {
    pub(crate) layout: Layout,
    /// The image after load.
    pub(crate) image: Vec<u8>,
    /// Memory words outside of the image.
    pub(crate) sparse: SparseMemory,
    /// Which PLCs are enabled or paused.
    pub(crate) plcs: PlcStates,
    /// Which PLCCs are enabled.
    pub(crate) plccs: PlcStates,
    /// The PLCCs that DELETE has erased, a bit for each. They have no statements.
    pub(crate) erased: u32,
    /// Whether the download has a SAVE.
    pub(crate) save: bool,
    /// The variables that on-line assignments name, for dumps.
    pub(crate) named: Vec<Variable>,
    /// The ranges of I-variables, by rising number.
    pub(crate) ranges: Vec<(u32, Range)>,
    /// The definitions of M-variables that code for this state assumes.
    pub(crate) assumed: Vec<Assumption>,
    /// The state of motors and coordinate systems.
    pub(crate) motion: LoadedMotion,
}

/// Executes on-line commands.
struct OnlineExecutor {
    /// The state that they have made so far.
    out: Loaded,
    /// The addressed coordinate system.
    system: u32,
    /// The stack of the evaluator.
    stack: Vec<f64>,
    /// Whether commands for motors and coordinate systems are executed, as where motion is simulated.
    simulates: bool,
}

/// Executes a download's on-line commands. `assumed` of the result is still empty, see
/// `assumptions.rs`.
pub(crate) fn load(download: &Download) -> Loaded {
    let mut plain = executed(download, false);
    let simulated = executed(download, true);
    let mut motion = simulated.motion;
    motion.image = LoadedMotion::differs(&plain.image, &simulated.image);
    motion.sparse = simulated.sparse;
    plain.motion = motion;
    plain
}

/// The state after load, with what commands do to motors and coordinate systems or without.
fn executed(download: &Download, simulates: bool) -> Loaded {
    let layout = Layout::new(download.controller);
    let mut image = vec![0; layout.size as usize];
    for number in 0..layout.count {
        let value = default(download.controller, number, simulates);
        write_f64(&mut image, layout.i_offset(number), value);
    }
    for context in 0..CONTEXTS {
        write_u32(&mut image, layout.q_base_at(context), layout.q_base_of(1));
    }
    let mut executor = OnlineExecutor {
        out: Loaded {
            layout,
            image,
            sparse: SparseMemory::default(),
            plcs: PlcStates::START,
            plccs: PlcStates::START,
            erased: 0,
            save: false,
            named: Vec::new(),
            ranges: tables::ranges(download.controller),
            assumed: Vec::new(),
            motion: LoadedMotion::new(),
        },
        system: 1,
        stack: Vec::new(),
        simulates,
    };
    for online in &download.online {
        executor.execute(download, &online.action);
    }
    if simulates {
        let mut motion = std::mem::take(&mut executor.out.motion);
        motion.finish(&mut executor.memory());
        executor.out.motion = motion;
    }
    executor.out
}

/// The default of an I-variable.
fn default(controller: Controller, number: u32, simulates: bool) -> f64 {
    let simulated = simulated_default(controller, number).filter(|_| simulates);
    simulated.unwrap_or_else(|| tables::i_default(controller, number))
}

impl OnlineExecutor {
    fn execute(&mut self, download: &Download, action: &Action) {
        match *action {
            Action::Assign(target, expr) => self.assign(download, target, expr),
            Action::Defaults(first, count, step) => {
                if count == 1 {
                    self.record_named(Kind::I, first);
                }
                for k in 0..count {
                    let number = first + k * step;
                    let value = default(download.controller, u32::from(number), self.simulates);
                    self.write(Kind::I, u32::from(number), value);
                }
            }
            Action::Define(first, count, definition) => {
                for number in first..first + count {
                    self.memory().define(u32::from(number), definition);
                }
            }
            Action::Plc(op, plcs) => {
                let states = if plcs.compiled { &mut self.out.plccs } else { &mut self.out.plcs };
                states.apply(op, plcs.bits);
            }
            Action::System(system) => self.system = u32::from(system),
            Action::Write(kind, address, ref values) => {
                for (k, &value) in (0..).zip(values) {
                    let value = arithmetic::finite(self.value(download.ops(value)));
                    self.write_memory(kind, address.wrapping_add(k), value);
                }
            }
            Action::Save => self.out.save = true,
            Action::DeletePlcc(number) => self.out.erased |= 1 << (number & 31),
            Action::Motion(ref command) if self.simulates => {
                let mut motion = std::mem::take(&mut self.out.motion);
                let system = self.system as u8;
                motion.execute(&mut self.memory(), system, command);
                self.out.motion = motion;
            }
            Action::Motion(_) => {}
        }
    }

    fn memory(&mut self) -> Memory<'_> {
        let out = &mut self.out;
        Memory { image: &mut out.image, layout: &out.layout, sparse: &mut out.sparse }
    }

    fn write_memory(&mut self, kind: WriteKind, address: u32, value: f64) {
        use plcc_abi::pmac::Definition;
        let address = address & self.out.layout.address_mask();
        let word = fixed::bits(value) as u32;
        match kind {
            WriteKind::X => self.memory().write_word(Space::X, address, word),
            WriteKind::Y => self.memory().write_word(Space::Y, address, word),
            // Both write 48 bits, of which X has the high ones.
            WriteKind::Long | WriteKind::Double => {
                self.memory().write(Definition::D { address }, value);
            }
            WriteKind::Program => {}
        }
    }

    fn assign(&mut self, download: &Download, target: Target, expr: crate::pmac::ast::Expr) {
        let ops = download.ops(expr);
        if let Target::Var(kind, number) = target {
            self.record_named(kind, number);
        }
        self.record_operands(target.index().map_or(&[], |index| download.ops(index)));
        self.record_operands(ops);
        let value = arithmetic::finite(self.value(ops));
        if let Target::Indirect(kind, index) = target {
            let index = self.value(download.ops(index));
            self.write(kind, fixed::index(index, self.out.layout.count - 1), value);
        }
        for (kind, number) in target.named() {
            self.write(kind, u32::from(number), value);
        }
    }

    /// Records a variable for dumps.
    fn record_named(&mut self, kind: Kind, number: u16) {
        let system = if kind == Kind::Q { self.system } else { 1 };
        self.out.named.push(Variable { kind, number: u32::from(number), system });
    }

    fn record_operands(&mut self, ops: &[Op]) {
        for op in ops {
            if let Op::Var(kind, number) = *op {
                self.record_named(kind, number);
            }
        }
    }

    fn value(&mut self, ops: &[Op]) -> f64 {
        let layout = self.out.layout;
        let base = layout.q_base_of(self.system);
        let mut stack = std::mem::take(&mut self.stack);
        let radians = read_f64(&self.out.image, layout.i_offset(15)) != 0.0;
        let value = {
            let out = &mut self.out;
            let memory =
                Memory { image: &mut out.image, layout: &out.layout, sparse: &mut out.sparse };
            plcc_abi::pmac::expression::evaluate(ops, &mut stack, radians, &mut |kind, number| {
                match kind {
                    Kind::P => read_f64(memory.image, layout.p_offset(number)),
                    Kind::Q => read_f64(memory.image, layout.q_offset(base.wrapping_add(number))),
                    Kind::I => read_f64(memory.image, layout.i_offset(number)),
                    Kind::M => memory.read_m(number),
                    Kind::L => 0.0,
                }
            })
        };
        self.stack = stack;
        value
    }

    fn write(&mut self, kind: Kind, number: u32, value: f64) {
        let layout = self.out.layout;
        let offset = match kind {
            Kind::P => layout.p_offset(number),
            Kind::Q => layout.q_offset(layout.q_base_of(self.system).wrapping_add(number)),
            Kind::I => {
                let value = match self.out.ranges.binary_search_by_key(&number, |r| r.0) {
                    Ok(index) => self.out.ranges.get(index).map_or(value, |r| r.1.convert(value)),
                    Err(_) => value,
                };
                return write_f64(&mut self.out.image, layout.i_offset(number), value);
            }
            Kind::M => return self.memory().write_m(number, value),
            Kind::L => return,
        };
        write_f64(&mut self.out.image, offset, value);
    }
}
