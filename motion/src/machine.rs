//! What every step of the simulation works with.

use std::cell::RefCell;
use std::sync::Arc;

use plcc_abi::image::{read_f64, read_u32, write_f64, write_u32};
use plcc_abi::pmac::layout::ADDRESS_SIZE;
use plcc_abi::pmac::motion::registers::{MotorRegisters, SystemRegisters, motors, servo_units};
use plcc_abi::pmac::motion::{Axis, MotionTables, Plant};
use plcc_abi::pmac::{Controller, Layout, Memory, Place, Range, Space};
use serde::{Deserialize, Serialize};

use crate::calculation::Calculation;
use crate::carried_out::CarriedOut;
use crate::events::MotionEvent;
use crate::motor::{Loop, Motor};
use crate::rest::Rest;
use crate::system::System;
use crate::transform::Transformation;
use crate::words::{MotorWords, NOWHERE, SystemWords, WORD, read_float, write_double, write_float};

/// What stays for a whole run.
#[derive(Clone, Debug)]
pub struct Setup {
    pub(crate) layout: Layout,
    pub(crate) plants: Vec<Plant>,
    pub(crate) motors: Vec<MotorWords>,
    pub(crate) systems: Vec<SystemWords>,
    /// The texts of the commands of the tables, and of those that are done after the load.
    pub(crate) texts: Vec<Arc<str>>,
    pub(crate) start_texts: Vec<Arc<str>>,
    /// The texts of the panel's commands.
    pub(crate) panel: Vec<Arc<str>>,
    /// The ranges of I-variables.
    pub(crate) ranges: Vec<(u32, Range)>,
    /// Room for showing where axes are.
    pub(crate) scratch: RefCell<crate::kinematics::Scratch>,
}

/// The Y addresses of the DACs of a PMAC's motors (guide, appendix E).
const DACS: [u32; 8] = [0xC003, 0xC002, 0xC00B, 0xC00A, 0xC013, 0xC012, 0xC01B, 0xC01A];

impl Setup {
    /// The setup for a controller. `plants` are the motors of which the machine file says something.
    pub fn new(
        layout: &Layout,
        plants: &[Plant],
        tables: &MotionTables,
        ranges: &[(u32, Range)],
    ) -> Self {
        let count = motors(layout.controller);
        let word = |space, address| match layout.place(space, address) {
            Place::Word(offset) => offset,
            _ => NOWHERE,
        };
        let x = |address| word(Space::X, address);
        let y = |address| word(Space::Y, address);
        let pmac = layout.controller == Controller::Pmac;
        let motor = |number: u32| {
            let at = MotorRegisters::of(layout.controller, number);
            let index = number - 1;
            MotorWords {
                commanded: x(at.commanded),
                actual: x(at.actual),
                target: x(at.target),
                following_error: at.following_error.map_or(NOWHERE, x),
                velocity: x(at.velocity),
                filtered: if pmac { y(at.filtered) } else { x(at.filtered) },
                home_offset: y(at.home_offset),
                bias: x(at.bias),
                variable_jog: x(at.variable_jog),
                scales: x(at.scales),
                output: x(at.output),
                status_x: x(at.status_x),
                status_y: y(at.status_y),
                conversion: if pmac { x(0x720 + index) } else { NOWHERE },
                dac: DACS.get(index as usize).filter(|_| pmac).map_or(NOWHERE, |&dac| y(dac)),
            }
        };
        let system = |number| {
            let at = SystemRegisters::of(layout.controller, number);
            SystemWords {
                targets: x(at.targets),
                commanded_base: x(at.commanded_base),
                base_address: at.commanded_base,
                present_base: x(at.present_base),
                status_x: x(at.status_x),
                status_y: y(at.status_y),
            }
        };
        let plant = |number: u32| {
            let given = plants.iter().find(|plant| u32::from(plant.number) == number);
            given.cloned().unwrap_or_else(|| Plant::new(number as u8))
        };
        Self {
            layout: *layout,
            plants: (1..=count).map(plant).collect(),
            motors: (1..=count).map(motor).collect(),
            systems: (1..=layout.systems()).map(system).collect(),
            texts: tables.commands.iter().map(|command| command.text.as_str().into()).collect(),
            start_texts: tables.start.iter().map(|s| s.command.text.as_str().into()).collect(),
            panel: crate::panel::texts(),
            ranges: ranges.to_vec(),
            scratch: RefCell::default(),
        }
    }
}

/// A value that a stimulus row has given to bits of a word in this tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Overlay {
    pub(crate) offset: u32,
    pub(crate) mask: u32,
    pub(crate) bits: u32,
}

/// How many words rows may hold in a tick.
const MAX_OVERLAYS: usize = 64;

/// The state of the simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(crate) motors: Vec<Motor>,
    pub(crate) systems: Vec<System>,
    /// The transformations of axes (DEFINE TBUF).
    pub(crate) transformations: Vec<Transformation>,
    /// The number of the next command.
    pub(crate) age: u64,
    /// The word of the panel at the last housekeeping.
    pub(crate) panel: u32,
    #[serde(skip)]
    pub(crate) rest: Rest,
    #[serde(skip)]
    pub(crate) carried_out: CarriedOut,
    #[serde(skip)]
    pub(crate) overlays: Vec<Overlay>,
    #[serde(skip)]
    pub(crate) calculation: Calculation,
    /// The operands of the expression that a kinematic program computes; empty between two runs.
    #[serde(skip)]
    pub(crate) operands: Vec<f64>,
}

impl State {
    /// The state at power-up, before [`Machine::start`].
    pub fn new(setup: &Setup, tables: &MotionTables) -> Self {
        let count = setup.motors.len();
        let mut this = Self {
            motors: setup.plants.iter().map(Motor::new).collect(),
            systems: (0..setup.systems.len()).map(|_| System::new(count)).collect(),
            transformations: vec![Transformation::NONE; usize::from(tables.transformations)],
            age: 1,
            panel: 0,
            operands: Vec::new(),
            rest: Rest::default(),
            carried_out: CarriedOut::new(),
            overlays: Vec::with_capacity(MAX_OVERLAYS),
            calculation: Calculation::default(),
        };
        for &(number, definition) in &tables.definitions {
            if let Some(motor) = this.motors.get_mut(usize::from(number).wrapping_sub(1)) {
                motor.definition = Some(definition);
            }
            let system = usize::from(definition.system).wrapping_sub(1);
            if let Some(system) = this.systems.get_mut(system) {
                system.rematch = true;
            }
        }
        for &(number, modes) in &tables.modes {
            if let Some(system) = this.systems.get_mut(usize::from(number).wrapping_sub(1)) {
                system.modes = modes;
            }
        }
        this
    }

    /// Whether a state that was read fits this program: its motors, systems and programs.
    pub fn fits(&self, own: &Self, tables: &MotionTables) -> bool {
        let motors = own.motors.len();
        let place = |place: &crate::system::Place| {
            tables
                .programs
                .get(place.program as usize)
                .is_some_and(|program| program.task.is_some())
        };
        let counter = |system: &System| match &system.counter {
            crate::system::Counter::At(at) => place(at),
            _ => true,
        };
        self.motors.len() == motors
            && self.systems.len() == own.systems.len()
            && self.motors.iter().zip(&own.motors).all(|(read, own)| {
                read.lag.len() == own.lag.len()
                    && read.waiting.len() <= crate::motor::MAX_WAITING
                    && read.history.len() <= crate::motor::FILTER
                    && read
                        .definition
                        .is_none_or(|d| (1..=own_systems(self)).contains(&usize::from(d.system)))
            })
            && self.systems.iter().all(|system| {
                system.sequence.fits(motors)
                    && counter(system)
                    && system.stack.len() <= crate::system::MAX_DEPTH
                    && system.stack.iter().all(|frame| place(&frame.place))
                    && system.arguments.len() <= crate::system::MAX_ARGUMENTS
                    && system.sync.len() <= crate::system::MAX_SYNC
                    && system.kept.len() <= crate::system::MAX_KEPT
            })
    }

    /// Gives queues the room that they have at power-up, so that nothing is allocated in a tick.
    pub fn make_room(&mut self) {
        self.overlays.reserve(MAX_OVERLAYS);
        self.carried_out.make_room();
        self.operands.reserve(64);
        for motor in &mut self.motors {
            motor.waiting.reserve(crate::motor::MAX_WAITING + 1 - motor.waiting.len().min(32));
            motor.history.reserve(crate::motor::FILTER + 1 - motor.history.len().min(80));
            motor.lag.reserve(1);
        }
        for system in &mut self.systems {
            system.sync.reserve(crate::system::MAX_SYNC.saturating_sub(system.sync.len()));
            system.stack.reserve(crate::system::MAX_DEPTH.saturating_sub(system.stack.len()));
            system.kept.reserve(crate::system::MAX_KEPT.saturating_sub(system.kept.len()));
            let arguments = system.arguments.len();
            system.arguments.reserve(crate::system::MAX_ARGUMENTS.saturating_sub(arguments));
        }
    }

    /// Whether another download can take this state over, as [`take_over`](Self::take_over) does: no program runs that
    /// has other statements there.
    pub fn can_go_over(&self, was: &MotionTables, is: &MotionTables) -> bool {
        self.systems.iter().filter(|system| system.running).all(|system| {
            let place =
                |place: &crate::system::Place| same_program(was, is, place.program).is_some();
            let counter = match &system.counter {
                crate::system::Counter::At(at) => place(at),
                _ => true,
            };
            counter && system.stack.iter().all(|frame| place(&frame.place))
        })
    }

    /// Takes the state of another download's control over: motors and coordinate systems stay where they are. A
    /// program counter stays where the program has the same statements in both, else it goes to the program's top.
    pub fn take_over(&mut self, old: &mut Self, was: &MotionTables, is: &MotionTables) {
        self.rest.end();
        std::mem::swap(&mut self.motors, &mut old.motors);
        std::mem::swap(&mut self.systems, &mut old.systems);
        if !old.transformations.is_empty() {
            std::mem::swap(&mut self.transformations, &mut old.transformations);
        }
        self.age = self.age.max(old.age);
        for system in &mut self.systems {
            let mut known = true;
            for frame in &mut system.stack {
                match same_program(was, is, frame.place.program) {
                    Some(program) => frame.place.program = program,
                    None => known = false,
                }
            }
            if let crate::system::Counter::At(at) = system.counter {
                let number = was.programs.get(at.program as usize).map_or(0, |p| p.number);
                system.counter = match same_program(was, is, at.program).filter(|_| known) {
                    Some(program) => {
                        crate::system::Counter::At(crate::system::Place { program, ..at })
                    }
                    None => crate::system::Counter::Label(number, 0),
                };
            }
            if !known {
                system.stack.clear();
                system.arguments.clear();
            }
        }
    }

    /// The indices of a coordinate system's motors.
    pub(crate) fn motors_of(&self, system: usize) -> impl Iterator<Item = usize> + use<> {
        let mut bits = 0u32;
        for (index, motor) in self.motors.iter().enumerate() {
            let its = motor.definition.is_some_and(|d| usize::from(d.system) == system + 1);
            bits |= u32::from(its) << index;
        }
        std::iter::from_fn(move || {
            if bits == 0 {
                return None;
            }
            let index = bits.trailing_zeros();
            bits &= bits - 1;
            Some(index as usize)
        })
    }

    /// The lowest motor of a coordinate system, which a COMMAND of its motion program addresses; both from 1. 1 where
    /// it has no motor.
    pub fn lowest_motor(&self, system: u32) -> u32 {
        let its = |motor: &Motor| motor.definition.is_some_and(|d| u32::from(d.system) == system);
        self.motors.iter().position(its).map_or(1, |index| index as u32 + 1)
    }

    /// Notes that a row has set bits of a word: what the plant would write there waits for the next tick.
    pub fn overlay(&mut self, offset: u32, mask: u32, bits: u32) {
        self.rest.end();
        if self.overlays.len() < MAX_OVERLAYS {
            self.overlays.push(Overlay { offset, mask, bits });
        }
    }
}

/// The index in other tables of the program that has the same statements; `None` if there is none.
fn same_program(was: &MotionTables, is: &MotionTables, program: u32) -> Option<u32> {
    let old = was.programs.get(program as usize)?;
    let same = |new: &plcc_abi::pmac::motion::MotionProgram| {
        new.task.is_some() && (new.number, new.fingerprint) == (old.number, old.fingerprint)
    };
    is.programs.iter().position(same).map(|index| index as u32)
}

fn own_systems(state: &State) -> usize {
    state.systems.len()
}

/// The simulation with everything that it works with.
pub struct Machine<'a> {
    /// The state.
    pub state: &'a mut State,
    /// What stays.
    pub setup: &'a Setup,
    /// The program's tables.
    pub tables: &'a MotionTables,
    /// The control's memory.
    pub memory: Memory<'a>,
    /// What happens is appended.
    pub events: &'a mut Vec<MotionEvent>,
}

impl Machine<'_> {
    pub(crate) fn turbo(&self) -> bool {
        self.setup.layout.controller == Controller::Turbo
    }

    /// An I-variable.
    #[inline]
    pub(crate) fn i(&self, number: u32) -> f64 {
        read_f64(self.memory.image, self.setup.layout.i_offset(number))
    }

    /// An I-variable of a motor, by its index from 0.
    #[inline]
    pub(crate) fn motor_i(&self, motor: usize, number: u32) -> f64 {
        self.i(100 * (motor as u32 + 1) + number)
    }

    /// The number of an I-variable of a coordinate system, by its index from 0: Ix87 to Ix98, Isx87 to Isx98 on Turbo.
    pub(crate) fn system_number(&self, system: usize, number: u32) -> u32 {
        let base = if self.turbo() { 5000 } else { 0 };
        base + 100 * (system as u32 + 1) + number
    }

    /// An I-variable of a coordinate system.
    #[inline]
    pub(crate) fn system_i(&self, system: usize, number: u32) -> f64 {
        self.i(self.system_number(system, number))
    }

    /// Assigns to an I-variable, which brings the value into its range.
    pub(crate) fn write_i(&mut self, number: u32, value: f64) {
        let ranges = &self.setup.ranges;
        let value = match ranges.binary_search_by_key(&number, |(number, _)| *number) {
            Ok(index) => ranges.get(index).map_or(value, |(_, range)| range.convert(value)),
            Err(_) => value,
        };
        let offset = self.setup.layout.i_offset(number);
        write_f64(self.memory.image, offset, plcc_abi::pmac::arithmetic::finite(value));
    }

    #[inline]
    pub(crate) fn word(&self, offset: u32) -> u32 {
        read_u32(self.memory.image, offset)
    }

    #[inline]
    pub(crate) fn set_word(&mut self, offset: u32, word: u32) {
        write_u32(self.memory.image, offset, word & WORD);
    }

    /// Writes a 48-bit integer to the X word at an offset and the Y word behind it.
    #[inline]
    pub(crate) fn set_double(&mut self, offset: u32, bits: u64) {
        write_double(self.memory.image, offset, bits);
    }

    /// The time of a servo cycle in units.
    pub(crate) fn servo_units(&self) -> i64 {
        servo_units(&self.setup.layout, self.memory.image)
    }

    /// The index of a motor's coordinate system.
    pub(crate) fn system_of(&self, motor: usize) -> Option<usize> {
        let definition = self.state.motors[motor].definition?;
        Some(usize::from(definition.system) - 1)
    }

    /// The indices of a coordinate system's motors.
    pub(crate) fn motors_of(&self, system: usize) -> impl Iterator<Item = usize> + use<> {
        self.state.motors_of(system)
    }

    pub(crate) fn motor_count(&self) -> usize {
        self.state.motors.len()
    }

    pub(crate) fn system_count(&self) -> usize {
        self.state.systems.len()
    }

    /// Puts the motors and coordinate systems into their state after load, and does the commands of the download
    /// that move, run or answer, as in the background of a tick -1.
    pub fn start(&mut self) {
        for system in 0..self.system_count() {
            self.state.systems[system].base = self.commanded_base(system);
            for axis in Axis::ALL {
                let offset = self.setup.systems[system].targets + ADDRESS_SIZE * axis as u32;
                let target = read_float(self.memory.image, offset);
                self.state.systems[system].axes[axis as usize] = target;
            }
        }
        for motor in 0..self.motor_count() {
            let active = self.motor_i(motor, 0) != 0.0;
            let this = &mut self.state.motors[motor];
            this.active = active;
            this.mode = if active { Loop::Closed } else { Loop::Killed };
        }
        self.open_panel();
        self.write_inputs();
        self.read_inputs();
        for motor in &mut self.state.motors {
            motor.inputs_before = motor.inputs;
        }
        self.registers();
        let tables = self.tables;
        for (index, start) in tables.start.iter().enumerate() {
            let address = crate::commands::Address {
                motor: usize::from(start.motor).saturating_sub(1),
                system: usize::from(start.system).saturating_sub(1),
            };
            let text = self.setup.start_texts[index].clone();
            self.carry_out(&start.command.action, &text, address);
        }
        self.write_status();
    }

    /// Assigns to an M-variable.
    pub(crate) fn write_m(&mut self, number: u32, value: f64) {
        self.memory.write_m(number, value);
    }

    /// The target of an axis in its register.
    pub(crate) fn show_axis(&mut self, system: usize, axis: Axis) {
        let offset = self.setup.systems[system].targets + ADDRESS_SIZE * axis as u32;
        let value = self.state.systems[system].axes[axis as usize];
        write_float(self.memory.image, offset, value);
    }
}
