//! The kinematic programs of Turbo PMAC (Isx50): the forward one gives the axes from the motors where axes are matched, the
//! inverse one the motors from the axes for each move, or for each point of the path with segmentation. They belong to the
//! calculation, which no engine runs, and are interpreted here.

use plcc_abi::image::{read_f64, write_f64};
use plcc_abi::pmac::arithmetic::finite;
use plcc_abi::pmac::expression::{Op, evaluate};
use plcc_abi::pmac::motion::{Axis, AxisGroup, KinematicStep, MotionTables};
use plcc_abi::pmac::{Kind, fixed};

use crate::axes::Look;
use crate::events::Reason;
use crate::machine::{Machine, State};
use crate::sequence::{Progress, SequenceKind};

/// The most statements of a run.
const MAX_STATEMENTS: u32 = 1_000_000;
/// The most statements of a run that only shows where the axes are, which each tick may have several of.
const MAX_SHOWN_STATEMENTS: u32 = 10_000;

/// A program that does not end.
struct TooLong;

/// The variables that a kinematic program works with.
trait Variables {
    fn read(&self, kind: Kind, number: u32) -> f64;
    fn write(&mut self, kind: Kind, number: u32, value: f64);
    /// How many variables of a kind there are.
    fn count(&self) -> u32;
}

/// The value of an expression.
fn value(ops: &[Op], operands: &mut Vec<f64>, variables: &impl Variables) -> f64 {
    let radians = variables.read(Kind::I, 15) != 0.0;
    evaluate(ops, operands, radians, &mut |kind, number| variables.read(kind, number))
}

/// Runs a program.
fn run(
    steps: &[KinematicStep],
    operands: &mut Vec<f64>,
    variables: &mut impl Variables,
    most: u32,
) -> Result<(), TooLong> {
    let (mut at, mut done) = (0, 0);
    while let Some(step) = steps.get(at) {
        if done == most {
            return Err(TooLong);
        }
        done += 1;
        at += 1;
        match step {
            KinematicStep::Assign { kind, first, count, step, value: ops } => {
                let value = finite(value(ops, operands, variables));
                for k in 0..*count {
                    let number = u32::from(*first) + u32::from(k) * u32::from(*step);
                    variables.write(*kind, number, value);
                }
            }
            KinematicStep::AssignIndirect { kind, number, value: ops } => {
                let number =
                    fixed::index(value(number, operands, variables), variables.count() - 1);
                let value = finite(value(ops, operands, variables));
                variables.write(*kind, number, value);
            }
            KinematicStep::Unless(condition, to) => {
                if value(condition, operands, variables) == 0.0 {
                    at = *to as usize;
                }
            }
            KinematicStep::Jump(to) => at = *to as usize,
        }
    }
    Ok(())
}

/// The variables of the control, with the Q-variables of a coordinate system.
struct Own<'a, 'b> {
    machine: &'b mut Machine<'a>,
    system: usize,
}

impl Variables for Own<'_, '_> {
    fn read(&self, kind: Kind, number: u32) -> f64 {
        self.machine.look().variable(self.system, kind, number)
    }

    fn write(&mut self, kind: Kind, number: u32, value: f64) {
        let machine = &mut *self.machine;
        let layout = machine.setup.layout;
        match kind {
            Kind::P => write_f64(machine.memory.image, layout.p_offset(number), value),
            Kind::Q => machine.write_q(self.system, number, value),
            Kind::I => machine.write_i(number & (layout.count - 1), value),
            Kind::M => machine.write_m(number, value),
            // L-variables belong to PLCCs.
            Kind::L => {}
        }
    }

    fn count(&self) -> u32 {
        self.machine.setup.layout.count
    }
}

/// Room for a look at where the axes are, which is kept, so that nothing is allocated in a tick.
#[derive(Clone, Debug)]
pub(crate) struct Scratch {
    /// What the program has assigned.
    written: Vec<(Kind, u32, f64)>,
    operands: Vec<f64>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self { written: Vec::with_capacity(64), operands: Vec::with_capacity(64) }
    }
}

/// The variables for a look at where the axes are: what the program assigns is forgotten.
struct Tried<'a> {
    look: Look<'a>,
    system: usize,
    written: &'a mut Vec<(Kind, u32, f64)>,
}

impl Variables for Tried<'_> {
    fn read(&self, kind: Kind, number: u32) -> f64 {
        let same = |&&(own, own_number, _): &&(Kind, u32, f64)| (own, own_number) == (kind, number);
        match self.written.iter().find(same) {
            Some((_, _, value)) => *value,
            None => self.look.variable(self.system, kind, number),
        }
    }

    fn write(&mut self, kind: Kind, number: u32, value: f64) {
        let own = self.written.iter_mut().find(|own| (own.0, own.1) == (kind, number));
        match own {
            Some(own) => own.2 = value,
            None => self.written.push((kind, number, value)),
        }
    }

    fn count(&self) -> u32 {
        self.look.setup.layout.count
    }
}

/// A kinematic program that is in use: that of a coordinate system whose Isx50 is 1.
fn steps<'a>(
    tables: &'a MotionTables,
    look: &Look<'_>,
    system: usize,
    inverse: bool,
) -> Option<&'a [KinematicStep]> {
    if tables.kinematics.is_empty() || look.i(5050 + 100 * (system as u32 + 1)) != 1.0 {
        return None;
    }
    let own = |program: &&plcc_abi::pmac::motion::Kinematics| {
        usize::from(program.system) == system + 1 && program.inverse == inverse
    };
    tables.kinematics.iter().find(own).map(|program| program.steps.as_slice())
}

impl State {
    /// Whether a motor follows the inverse kinematic program of its coordinate system (`#1->I`).
    pub(crate) fn is_kinematic(&self, motor: usize) -> bool {
        self.motors[motor].definition.is_some_and(|own| own.group == AxisGroup::Kinematics)
    }
}

impl Look<'_> {
    /// A variable; Q of this coordinate system.
    fn variable(&self, system: usize, kind: Kind, number: u32) -> f64 {
        let (layout, image) = (&self.setup.layout, self.view.image);
        match kind {
            Kind::P => read_f64(image, layout.p_offset(number)),
            Kind::Q => {
                let base = layout.q_base_of(system as u32 + 1);
                read_f64(image, layout.q_offset(base.wrapping_add(number)))
            }
            Kind::I => self.i(number & (layout.count - 1)),
            Kind::M => self.view.read_m(number),
            Kind::L => 0.0,
        }
    }

    /// Whether a coordinate system has an inverse kinematic program that is in use.
    pub(crate) fn has_inverse(&self, system: usize) -> bool {
        steps(self.tables, self, system, true).is_some()
    }

    /// Where the axes are by the forward kinematic program, if the motors have these counts; `None` without one. Where the program
    /// takes too long they are where the last move takes them.
    pub(crate) fn tried_forward(
        &self,
        system: usize,
        counts: &impl Fn(&Self, usize) -> f64,
    ) -> Option<[f64; 9]> {
        let steps = steps(self.tables, self, system, false)?;
        let mut scratch = self.setup.scratch.try_borrow_mut().ok()?;
        let Scratch { written, operands } = &mut *scratch;
        written.clear();
        operands.clear();
        let mut variables = Tried { look: *self, system, written };
        for motor in self.motors_of(system) {
            variables.write(Kind::P, motor as u32 + 1, counts(self, motor));
        }
        if run(steps, operands, &mut variables, MAX_SHOWN_STATEMENTS).is_err() {
            return Some(self.base_axes(system, &self.state.systems[system].axes));
        }
        Some(std::array::from_fn(|axis| variables.read(Kind::Q, axis as u32 + 1)))
    }
}

impl Machine<'_> {
    /// Runs a kinematic program. A run-time error if it does not end.
    fn kinematics(&mut self, system: usize, steps: &[KinematicStep]) {
        let mut operands = std::mem::take(&mut self.state.operands);
        let mut own = Own { machine: self, system };
        let result = run(steps, &mut operands, &mut own, MAX_STATEMENTS);
        operands.clear();
        self.state.operands = operands;
        if result.is_err() {
            self.stop_with_error(system, Reason::Late);
        }
    }

    /// Where the axes are by the forward kinematic program; `None` without one. While segments are made the axes stay
    /// where the last move will bring them.
    pub(crate) fn forward(&mut self, system: usize) -> Option<[f64; 9]> {
        let steps = steps(self.tables, &self.look(), system, false)?;
        let sequence = &self.state.systems[system].sequence;
        if sequence.kind == SequenceKind::Segmented && sequence.progress != Progress::None {
            return Some(self.state.systems[system].axes);
        }
        for motor in self.motors_of(system) {
            let goal = self.state.systems[system].sequence.goal(motor);
            let counts = goal.unwrap_or(self.state.motors[motor].commanded);
            let offset = self.setup.layout.p_offset(motor as u32 + 1);
            write_f64(self.memory.image, offset, finite(counts));
        }
        self.kinematics(system, steps);
        let look = self.look();
        let axes = std::array::from_fn(|axis| look.variable(system, Kind::Q, axis as u32 + 1));
        Some(look.programmed_axes(system, axes).map(finite))
    }

    /// Has the inverse kinematic program compute the motors from the axes, and in PVT their velocities from those of the axes.
    /// Says whether there is one.
    pub(crate) fn inverse(
        &mut self,
        system: usize,
        axes: &[f64; 9],
        velocities: Option<&[f64; 9]>,
    ) -> bool {
        let Some(steps) = steps(self.tables, &self.look(), system, true) else { return false };
        let axes = self.look().base_axes(system, axes);
        for axis in Axis::ALL {
            self.write_q(system, 1 + axis as u32, axes[axis as usize]);
        }
        self.write_q(system, 10, f64::from(u8::from(velocities.is_some())));
        if let Some(velocities) = velocities {
            let velocities = self.look().base_velocities(system, velocities);
            for axis in Axis::ALL {
                self.write_q(system, 11 + axis as u32, velocities[axis as usize]);
            }
        }
        self.kinematics(system, steps);
        true
    }

    /// Where the inverse kinematic program has a motor, in counts.
    pub(crate) fn kinematic_position(&self, motor: usize) -> f64 {
        read_f64(self.memory.image, self.setup.layout.p_offset(motor as u32 + 1))
    }

    /// The velocity that it gives to a motor, in counts per Isx90.
    pub(crate) fn kinematic_velocity(&self, motor: usize) -> f64 {
        read_f64(self.memory.image, self.setup.layout.p_offset(motor as u32 + 101))
    }
}
