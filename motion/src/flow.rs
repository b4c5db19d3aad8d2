//! Where motion programs go on: jumps, subroutines, codes, ends and steps (guide, Subroutines).

use plcc_abi::pmac::motion::Destination;

use crate::calculation::Jump;
use crate::events::{Reason, State};
use crate::machine::Machine;
use crate::system::{Counter, MAX_DEPTH, Place};

impl Machine<'_> {
    /// A jump to a label of a program.
    pub(crate) fn jump(
        &mut self,
        system: usize,
        program: u32,
        label: f64,
        make: impl Fn(Place) -> Jump,
    ) -> bool {
        let label = label.round();
        let number = if (0.0..=4e9).contains(&label) { Some(label as u32) } else { None };
        let point = number.and_then(|n| self.tables.programs.get(program as usize)?.label(n));
        let Some(point) = point else { return self.stop_with_error(system, Reason::Label) };
        let jump = make(Place { program, point });
        self.state.calculation.jump = jump;
        match jump {
            Jump::Into(_) if self.state.systems[system].stack.len() >= MAX_DEPTH => {
                self.state.calculation.jump = Jump::None;
                self.stop_with_error(system, Reason::Depth)
            }
            _ => true,
        }
    }

    /// CALL: the program in front of the point, the label behind it.
    pub(crate) fn call(&mut self, system: usize, value: f64) -> bool {
        let Destination { program, label } = Destination::of_number(value);
        let number = if (0.0..=4e9).contains(&program) { program as u32 } else { u32::MAX };
        let programs = &self.tables.programs;
        let found = programs.iter().position(|p| p.number == number && p.task.is_some());
        let Some(program) = found else {
            return self.stop_with_error(system, Reason::Program);
        };
        if label == 0.0 {
            let place = Place { program: program as u32, point: 0 };
            if self.state.systems[system].stack.len() >= MAX_DEPTH {
                return self.stop_with_error(system, Reason::Depth);
            }
            self.state.calculation.jump = Jump::Into(place);
            return true;
        }
        self.jump(system, program as u32, label, Jump::Into)
    }

    /// G, M, T and D codes: calls of programs from 1000 on. What is not there is passed over.
    pub(crate) fn code(&mut self, system: usize, code: u8, value: f64) -> bool {
        let Destination { program: number, label } = Destination::of_code(code, value);
        let programs = &self.tables.programs;
        let found = programs
            .iter()
            .position(|program| f64::from(program.number) == number && program.task.is_some());
        let label = if (0.0..=4e9).contains(&label) { label as u32 } else { u32::MAX };
        let point = found.and_then(|index| programs[index].label(label));
        let (Some(program), Some(point)) = (found, point) else { return false };
        if self.state.systems[system].stack.len() >= MAX_DEPTH {
            return self.stop_with_error(system, Reason::Depth);
        }
        self.state.calculation.jump = Jump::Into(Place { program: program as u32, point });
        true
    }

    /// A backward jump: the second one in a calculation is its last.
    pub(crate) fn backward(&mut self, system: usize) -> bool {
        self.state.calculation.jumps += 1;
        if self.state.calculation.jumps < 2 {
            return false;
        }
        self.idle_calculation(system);
        true
    }

    /// Whether a step ends behind a line (I53, of Turbo PMAC Isx53), not behind a move. Lines without statements of motion
    /// belong to the one in front of them.
    pub(crate) fn steps_by_line(&self, system: usize) -> bool {
        let this = &self.state.systems[system];
        let by_line = || if self.turbo() { self.system_i(system, 53) } else { self.i(53) };
        this.step && !this.block && by_line() == 1.0
    }

    /// Whether a step ends behind this move.
    pub(crate) fn ends_step(&self, system: usize) -> bool {
        let this = &self.state.systems[system];
        this.step && !this.block && !self.steps_by_line(system)
    }

    /// A step is over: its move is closed, and the program stops.
    pub(crate) fn end_step(&mut self, system: usize) -> bool {
        self.close_sequence(system);
        self.stop_program(system, Reason::Step);
        self.state.calculation.stop = true;
        true
    }

    /// The calculation has come to the program's end, or to a STOP.
    pub(crate) fn end_program(&mut self, system: usize, reason: Option<Reason>) -> bool {
        self.close_sequence(system);
        self.state.calculation.stop = true;
        let number = self.program_number(system);
        if reason.is_none() {
            let chosen = self.state.systems[system].chosen;
            let counter = match chosen {
                Some(program) => Counter::Label(program, 0),
                None => Counter::Default,
            };
            self.state.systems[system].counter = counter;
            self.state.calculation.placed = true;
        }
        let state = if reason.is_none() { State::Ended } else { State::Stopped };
        self.program_over(system, number, state, reason);
        true
    }
}
