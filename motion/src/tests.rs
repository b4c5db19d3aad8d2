//! Motors without an engine: rest leaves out nothing.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_abi::image::{read_u32, write_f64};
use plcc_abi::pmac::motion::registers::{define, write_float};
use plcc_abi::pmac::motion::{
    Axis, AxisDefinition, AxisGroup, Jog, JogGoal, MotionAction, MotionCommand, MotionKind,
    MotionName, MotionProgram, MotionStatement, MotionTables, MotorValue, MoveWord, Plant,
};
use plcc_abi::pmac::{Controller, Layout, Memory, Place, Space, SparseMemory};
use plcc_random::{Rng, seeds};

use crate::events::MotionEvent;
use crate::machine::{Machine, Setup, State};
use crate::system::System;
use crate::{Next, rest};

/// A machine with all that belongs to it.
#[derive(Clone)]
struct Rig {
    layout: Layout,
    setup: Setup,
    tables: MotionTables,
    state: State,
    image: Vec<u8>,
    sparse: SparseMemory,
    events: Vec<MotionEvent>,
    /// Each part of the tick is computed as if something had changed.
    restless: bool,
}

/// How many motors take part.
const MOTORS: u32 = 5;

impl Rig {
    fn new(rng: &mut Rng, turbo: bool) -> Self {
        let layout = Layout::new(if turbo { Controller::Turbo } else { Controller::Pmac });
        let jogs = [
            JogGoal::Positive,
            JogGoal::Negative,
            JogGoal::Stop,
            JogGoal::PreJog,
            JogGoal::To(150.5),
            JogGoal::By(-70.25),
        ];
        let jogs = jogs.map(|goal| MotionAction::Jog(Jog { goal, trigger: None }));
        let others = [
            MotionAction::Home,
            MotionAction::HomeZero,
            MotionAction::Kill,
            MotionAction::OpenLoop(3.0),
            MotionAction::Begin { program: 1, label: 0 },
            MotionAction::Run,
            MotionAction::Step,
            MotionAction::Abort,
            MotionAction::Hold,
            MotionAction::KillAll,
            MotionAction::TimeBase(80.0),
            MotionAction::Undefine { all: false },
        ];
        let commands = jogs.into_iter().chain(others);
        let statement = |line, kind| MotionStatement { kind, words: vec![], file: 0, line };
        let system =
            |number: u32| AxisDefinition { system: 1 + (number % 2) as u8, group: AxisGroup::Xyz };
        let tables = MotionTables {
            commands: commands
                .map(|action| MotionCommand { text: String::new(), action })
                .collect(),
            programs: vec![MotionProgram { number: 1, task: Some(0), ..MotionProgram::default() }],
            statements: vec![
                statement(1, MotionKind::Move(vec![MoveWord::Axis(Axis::X)])),
                statement(2, MotionKind::Dwell),
                statement(3, MotionKind::Return),
            ],
            definitions: (1..=MOTORS).map(|number| (number as u8, system(number))).collect(),
            ..MotionTables::default()
        };
        let plant = |number: u32| {
            let mut plant = Plant::new(number as u8);
            plant.limits = rng.chance(50).then_some((-300.0, 300.0));
            plant.stroke = rng.chance(50).then_some((-400.0, 400.0));
            plant.home = vec![(20.5, 60.0)];
            plant.index = 64;
            plant.lag = *rng.pick(&[0, 0, 1, 7]);
            plant
        };
        let plants: Vec<Plant> = (1..=MOTORS).map(plant).collect();
        let setup = Setup::new(&layout, &plants, &tables, &[]);
        let state = State::new(&setup, &tables);
        let mut rig = Self {
            layout,
            setup,
            tables,
            state,
            image: vec![0; layout.size as usize],
            sparse: SparseMemory::default(),
            events: vec![],
            restless: false,
        };
        for (number, value) in [(10, 4_194_304.0), (12, 2.0), (7, 3.0), (902, 2.0), (7012, 2.0)] {
            rig.i(number, value);
        }
        for number in 1..=MOTORS {
            for (variable, value) in [
                (0, 1.0),
                (8, 96.0),
                (9, 96.0),
                (11, 32_000.0),
                (12, 160.0),
                (15, 1.0),
                (16, 32.0),
                (17, 1.0),
                (19, 1.0),
                (20, 4.0),
                (22, 20.0),
                (23, 10.0),
                (25, f64::from(rig.channel(number))),
                (28, 32.0),
                (87, 4.0),
                (89, 30.0),
                (90, 1000.0),
                (94, 500_000.0),
                (95, 500_000.0),
            ] {
                rig.i(100 * number + variable, value);
            }
        }
        rig.with(|machine| {
            for number in 1..=MOTORS {
                define(&mut machine.memory, number, [10.0, 0.0, 0.0], 0.0);
            }
            for system in &machine.setup.systems {
                let offset = system.commanded_base;
                plcc_abi::image::write_u32(machine.memory.image, offset, 4_194_304);
            }
            machine.start();
        });
        rig
    }

    fn with(&mut self, act: impl FnOnce(&mut Machine<'_>)) {
        if self.restless {
            self.state.rest.end();
        }
        let memory =
            Memory { image: &mut self.image, layout: &self.layout, sparse: &mut self.sparse };
        act(&mut Machine {
            state: &mut self.state,
            setup: &self.setup,
            tables: &self.tables,
            memory,
            events: &mut self.events,
        });
    }

    fn i(&mut self, number: u32, value: f64) {
        write_f64(&mut self.image, self.layout.i_offset(number), value);
    }

    /// The address of a motor's flag word.
    fn channel(&self, motor: u32) -> u32 {
        match self.layout.controller {
            Controller::Pmac => 0xC000 + 4 * (motor - 1),
            Controller::Turbo => 0x7_8000 + 8 * ((motor - 1) & 3) + 0x100 * ((motor - 1) >> 2),
        }
    }

    /// The calculations of all coordinate systems, as an engine makes them.
    fn calculate(&mut self) {
        self.with(|machine| {
            for system in 1..=2 {
                let mut next = machine.begin_calculation(system);
                while let Next::Run { point, .. } = next {
                    let mut at = point;
                    while machine.ready(at) {
                        machine.value([12.5, 5.0, 0.0][at as usize]);
                        let suspended = machine.execute(at);
                        at = (at + 1).min(2);
                        if suspended {
                            break;
                        }
                    }
                    next = machine.after(at);
                }
            }
            machine.show_status();
        });
    }

    /// Something happens: a command, a stimulus, or a program writes to memory.
    fn happen(&mut self, rng: &mut Rng) {
        let motor = 1 + rng.below(MOTORS as usize) as u32;
        let channel = self.channel(motor);
        let commands = self.tables.commands.len();
        match rng.below(10) {
            0..=3 => {
                let index = rng.below(commands) as u32;
                let (mut motor, mut system) = (motor, 1 + motor % 2);
                self.with(|machine| machine.command(index, &mut motor, &mut system));
            }
            4 => {
                let what = *rng.pick(&[MotorValue::Fault, MotorValue::Jam, MotorValue::Physical]);
                let value = rng.below(2) as f64;
                self.with(|machine| machine.set(MotionName::Motor(motor as u8, what), value));
            }
            5 => {
                let variable = rng.pick(&[0, 0, 1, 6, 8, 9, 11, 12, 13, 14, 24, 25, 28, 34, 93]);
                let value = match *variable {
                    25 => {
                        *rng.pick(&[0, channel, channel | 1 << 16, channel | 1 << 20, channel + 1])
                    }
                    24 => *rng.pick(&[0, 1, 1 << 20, 1 << 23]),
                    0 => u32::from(rng.chance(80)),
                    93 => *rng.pick(&[0, 0x2B]),
                    _ => rng.below(200) as u32,
                };
                self.i(100 * motor + variable, f64::from(value));
            }
            6 => {
                let value = rng.below(6) as f64;
                self.i(7, value);
            }
            7 => {
                let words = &self.setup.motors[motor as usize - 1];
                let offsets = [words.commanded, words.status_x, words.status_y, words.output];
                let systems = &self.setup.systems[0];
                let others = [systems.status_y, systems.present_base, systems.commanded_base];
                let offset = *rng.pick(&[&offsets[..], &others[..]].concat());
                let word = rng.bits() as u32 & 0xFF_FFFF;
                self.with(|machine| machine.set_word(offset, word));
            }
            8 => {
                let (bit, on) = (1 << (14 + rng.below(10)), rng.chance(50));
                if let Place::Word(offset) = self.layout.place(Space::X, channel) {
                    let word = read_u32(&self.image, offset) & !bit | if on { bit } else { 0 };
                    self.with(|machine| machine.set_word(offset, word));
                    if rng.chance(50) {
                        self.state.overlay(offset, bit, word);
                    }
                }
            }
            _ => {
                let value = rng.below(40) as f64;
                let at = plcc_abi::pmac::motion::MotorRegisters::of(self.layout.controller, motor);
                self.with(|machine| write_float(&mut machine.memory, at.scales, value));
            }
        }
    }

    /// A command for a motor or a coordinate system.
    fn order(&mut self, action: &MotionAction, number: u32) {
        let found = self.tables.commands.iter().position(|command| command.action == *action);
        let (mut motor, mut system) = (number, number);
        self.with(|machine| machine.command(found.unwrap() as u32, &mut motor, &mut system));
    }

    /// The words that show what motors and coordinate systems do.
    fn shown(&self) -> Vec<u32> {
        let motors = self.setup.motors.iter();
        let motors = motors.flat_map(|it| [it.status_x, it.status_y, it.commanded, it.velocity]);
        let systems = self.setup.systems.iter();
        let systems = systems.flat_map(|it| [it.status_x, it.status_y, it.present_base]);
        motors.chain(systems).map(|offset| read_u32(&self.image, offset)).collect()
    }

    /// A tick in which nothing happens from outside. Gives what is shown after each of its parts.
    fn quiet_tick(&mut self) -> Vec<u32> {
        let mut seen = vec![];
        self.with(|machine| machine.servo());
        seen.extend(self.shown());
        self.with(|machine| machine.finish_servo());
        seen.extend(self.shown());
        self.with(|machine| machine.interrupt());
        self.calculate();
        seen.extend(self.shown());
        self.with(|machine| machine.housekeeping());
        seen.extend(self.shown());
        seen
    }

    /// A tick in which things happen between its parts, one in `rare` times.
    fn tick(&mut self, rng: &mut Rng, rare: usize) {
        let mut perhaps = |this: &mut Self, rare: usize| {
            if rng.below(rare) == 0 {
                this.happen(rng);
            }
        };
        perhaps(self, rare);
        self.with(|machine| machine.servo());
        perhaps(self, 8 * rare);
        self.with(|machine| machine.finish_servo());
        perhaps(self, 8 * rare);
        self.with(|machine| machine.interrupt());
        self.calculate();
        perhaps(self, 8 * rare);
        self.with(|machine| machine.housekeeping());
    }
}

/// A program that waits lets time pass, though nothing moves; so does one that is held.
#[test]
fn a_program_that_waits_is_not_at_rest() {
    for (turbo, held) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut rig = Rig::new(&mut Rng::new(5), turbo);
        for number in 1..=MOTORS {
            rig.order(&MotionAction::Jog(Jog { goal: JogGoal::Stop, trigger: None }), number);
        }
        let mut restless = Rig { restless: true, ..rig.clone() };
        let (mut dwelt, mut runs, mut rested) = (0, 0, 0);
        for tick in 0..3000 {
            for rig in [&mut rig, &mut restless] {
                match tick % 750 {
                    10 => {
                        for system in 1..=2 {
                            rig.order(&MotionAction::Begin { program: 1, label: 0 }, system);
                            rig.order(&MotionAction::Run, system);
                        }
                    }
                    40 if held => (1..=2).for_each(|system| rig.order(&MotionAction::Hold, system)),
                    400 if held => (1..=2).for_each(|system| rig.order(&MotionAction::Run, system)),
                    // I6 and I34 are seen in status words at once.
                    number @ (600 | 610) => {
                        let value = f64::from(u8::from(number == 600));
                        for motor in 1..=MOTORS {
                            rig.i(100 * motor + 6, value);
                            rig.i(100 * motor + 34, value);
                        }
                    }
                    _ => {}
                }
            }
            let what = format!("turbo {turbo}, held {held}, tick {tick}");
            assert_eq!(rig.quiet_tick(), restless.quiet_tick(), "{what}");
            assert!(rig.image == restless.image, "{what}: memory");
            assert_eq!(rig.state, restless.state, "{what}");
            assert_eq!(rig.events, restless.events, "{what}");
            dwelt += u32::from(rig.state.systems.iter().any(System::dwells));
            runs += u32::from(rig.state.systems.iter().any(|system| system.running));
            rested += u32::from(rest::Rest::is_rest(rig.state.rest));
        }
        assert!(dwelt > 10 && runs > dwelt && rested > 500, "{dwelt} {runs} {rested}");
    }
}

/// The words after the last ones of Turbo PMAC's gate arrays are not in the image: a motor with such a channel writes them anew in
/// each servo cycle, whatever a program has left there.
#[test]
fn a_channel_at_the_end_of_the_gate_arrays_is_written_in_each_cycle() {
    const LAST: u32 = 0x7_FFFF;
    let mut rig = Rig::new(&mut Rng::new(5), true);
    rig.i(100 + 25, f64::from(LAST));
    (0..100).for_each(|_| drop(rig.quiet_tick()));
    let counter = |rig: &mut Rig| {
        let mut word = 0;
        rig.with(|machine| word = machine.memory.read_word(Space::X, LAST + 1));
        word
    };
    let shown = counter(&mut rig);
    rig.with(|machine| machine.memory.write_word(Space::X, LAST + 1, shown ^ 0x12_3456));
    rig.quiet_tick();
    assert_eq!(counter(&mut rig), shown);
}

#[test]
fn at_rest_all_is_as_if_it_were_computed() {
    let (mut rested, mut ticks) = (0, 0);
    for seed in seeds(40) {
        let mut rng = Rng::new(seed);
        let turbo = seed % 4 == 3;
        let mut rig = Rig::new(&mut rng, turbo);
        let mut restless = Rig { restless: true, ..rig.clone() };
        let rare = *rng.pick(&[5, 40, 200]);
        for tick in 0..1000 {
            rig.tick(&mut rng.clone(), rare);
            restless.tick(&mut rng, rare);
            let what = format!("seed {seed}, tick {tick}");
            assert!(rig.image == restless.image, "{what}: memory");
            assert_eq!(rig.state, restless.state, "{what}");
            assert_eq!(rig.events, restless.events, "{what}");
            rested += u32::from(rest::Rest::is_rest(rig.state.rest));
            ticks += 1;
        }
    }
    // Not all is rest, and not all is motion.
    assert!(rested > ticks / 10 && rested < ticks * 9 / 10, "{rested} of {ticks} at rest");
}
