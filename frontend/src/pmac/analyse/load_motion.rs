//! What a download's on-line commands do to motors and coordinate systems, where these are simulated. Definitions
//! of axes, time bases and modes act in their place among the other commands; what moves, runs or answers is done
//! after the load (decided).

use plcc_abi::pmac::motion::registers::{self, SystemRegisters};
use plcc_abi::pmac::motion::tables::Modes;
use plcc_abi::pmac::motion::{Axis, AxisDefinition, MotionAction, MotionCommand, StartCommand};
use plcc_abi::pmac::{Memory, Run, Space, SparseMemory};
use std::collections::BTreeMap;

/// The state of motors and coordinate systems after load.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LoadedMotion {
    /// By how the image differs from that without simulation.
    pub(crate) image: Vec<Run>,
    /// Memory outside the image.
    pub(crate) sparse: SparseMemory,
    /// The commands that are done after the load.
    pub(crate) start: Vec<StartCommand>,
    /// The axes of motors.
    pub(crate) definitions: BTreeMap<u8, AxisDefinition>,
    /// The modes of coordinate systems.
    pub(crate) modes: BTreeMap<u8, Modes>,
    /// How many axis transformations there are.
    pub(crate) transformations: u16,
    /// The addressed motor.
    motor: u8,
    /// The targets of axes that commands have set, by coordinate system.
    axes: BTreeMap<u8, [f64; 9]>,
    /// The coordinate systems whose time base a command has set.
    based: u32,
}

impl LoadedMotion {
    pub(crate) fn new() -> Self {
        Self { motor: 1, ..Self::default() }
    }

    /// Executes a command with this coordinate system addressed.
    pub(crate) fn execute(&mut self, memory: &mut Memory<'_>, system: u8, command: &MotionCommand) {
        match command.action {
            MotionAction::Motor(motor) => self.motor = motor,
            MotionAction::Define { motor, group, scales, offset } => {
                if self.definitions.get(&motor).is_some_and(|own| own.system != system) {
                    return self.refuse(system, motor, command);
                }
                match group {
                    Some(group) => {
                        self.definitions.insert(motor, AxisDefinition { system, group });
                        registers::define(memory, motor.into(), scales, offset.unwrap_or(0.0));
                    }
                    None => {
                        self.definitions.remove(&motor);
                    }
                }
            }
            MotionAction::Undefine { all } => {
                self.definitions.retain(|_, own| !all && own.system != system);
            }
            MotionAction::TimeBase(percent) => {
                if percent < 0.0 {
                    return self.refuse(system, self.motor, command);
                }
                let at = SystemRegisters::of(memory.layout.controller, system.into());
                let word = registers::time_base(memory.layout, memory.image, percent);
                memory.write_word(Space::X, at.commanded_base, word);
                self.based |= 1 << system;
            }
            MotionAction::Incremental(incremental, axes) => {
                let modes = self.modes.entry(system).or_default();
                modes.incremental = match incremental {
                    true => modes.incremental.and(axes),
                    false => modes.incremental.without(axes),
                };
            }
            MotionAction::FeedrateAxes(axes) => {
                self.modes.entry(system).or_default().feedrate = axes;
            }
            MotionAction::SetAxis(axis, value) => self.set_axis(memory, system, axis, value),
            MotionAction::ZeroAxes => {
                for axis in Axis::ALL {
                    self.set_axis(memory, system, axis, 0.0);
                }
            }
            MotionAction::Transformations(count) => self.transformations = count,
            MotionAction::Nothing => {}
            _ => self.start.push(StartCommand {
                motor: self.motor,
                system,
                command: command.clone(),
            }),
        }
    }

    fn refuse(&mut self, system: u8, motor: u8, command: &MotionCommand) {
        let action = MotionAction::Refused("ERR003".to_owned());
        let command = MotionCommand { text: command.text.clone(), action };
        self.start.push(StartCommand { motor, system, command });
    }

    /// `{axis}=c`: the bias makes the commanded position, which is 0 after power-up, that of the axis.
    fn set_axis(&mut self, memory: &mut Memory<'_>, system: u8, axis: Axis, value: f64) {
        let axes = self.axes.entry(system).or_default();
        if let Some(slot) = axes.get_mut(axis as usize) {
            *slot = value;
        }
        let axes = *axes;
        let at = SystemRegisters::of(memory.layout.controller, system.into());
        registers::write_float(memory, at.targets + axis as u32, value);
        for (&motor, definition) in &self.definitions {
            if definition.system != system {
                continue;
            }
            let scales = registers::scales(&memory.view(), motor.into());
            let part = |slot: usize| {
                let axis = definition.group.axis(slot)?;
                let scale = *scales.get(slot)?;
                Some((axis, scale, scale * axes.get(axis as usize)?))
            };
            let of = |slot| part(slot).map_or(0.0, |(_, _, value)| value);
            let follows =
                (0..3).filter_map(part).any(|(own, scale, _)| own == axis && scale != 0.0);
            if follows {
                registers::set_bias(memory, motor.into(), (of(0) + of(1)) + of(2));
            }
        }
    }

    /// What is left to do when the whole text is loaded: the commanded time base is I10 where the text did not set
    /// it.
    pub(crate) fn finish(&mut self, memory: &mut Memory<'_>) {
        let units = registers::servo_units(memory.layout, memory.image);
        for system in 1..=memory.layout.systems() {
            let at = SystemRegisters::of(memory.layout.controller, system).commanded_base;
            if self.based & 1 << system == 0 && memory.read_word(Space::X, at) == 0 {
                memory.write_word(Space::X, at, units as u32);
            }
        }
    }

    /// By how the image where motion is simulated differs from the other one.
    pub(crate) fn differs(plain: &[u8], simulated: &[u8]) -> Vec<Run> {
        /// Most of the image is the same, and lines of this size are compared at once.
        const LINE: usize = 64;
        let mut runs: Vec<Run> = Vec::new();
        let lines = plain.chunks(LINE).zip(simulated.chunks(LINE)).zip((0u32..).step_by(LINE));
        let differing = lines.filter(|((old, new), _)| old != new);
        let bytes = differing.flat_map(|((old, new), start)| (start..).zip(old.iter().zip(new)));
        for (offset, (old, new)) in bytes {
            if old == new {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.offset + run.bytes.len() as u32 == offset => run.bytes.push(*new),
                _ => runs.push(Run { offset, bytes: vec![*new] }),
            }
        }
        runs
    }
}

/// The default of an I-variable where motion is simulated: of Turbo PMAC the flags of its motors, which without
/// simulation are 0.
pub(crate) fn simulated_default(
    controller: plcc_abi::pmac::Controller,
    number: u32,
) -> Option<f64> {
    if controller != plcc_abi::pmac::Controller::Turbo || !(100..3300).contains(&number) {
        return None;
    }
    let motor = number / 100 - 1;
    match number % 100 {
        24 => Some(1.0),
        25 => Some(f64::from(0x7_8000 + 8 * (motor & 3) + 0x100 * (motor >> 2))),
        _ => None,
    }
}
