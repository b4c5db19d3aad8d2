//! What happens in a servo cycle, and in which order (guide, PMAC Tasks; rulings, Time).

use plcc_abi::{
    Engine, Outcome, Scan,
    image::{read_f64, read_u32, write_f64, write_u32},
    pmac::{COMMAND_CONTEXT, Place, Space, context, fixed::sign_extend},
};

use super::{PmacExecutive, control::Status};
use crate::Stop;

/// The watchdog's register, Y:$1F of a PMAC, and what housekeeping sets it to.
const WATCHDOG_REGISTER: u32 = 0x1F;
const WATCHDOG_START: u32 = 4095;

/// The most negative value of a signed 24-bit timer, where it stops.
const TIMER_END: i64 = -0x80_0000;

impl PmacExecutive {
    /// One servo cycle.
    pub(super) fn servo_cycle(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        self.count_time();
        if self.until_interrupt == 0 {
            self.until_interrupt = self.i(8);
            self.interrupt(engine)?;
        } else {
            self.until_interrupt -= 1;
        }
        for _ in 0..self.options.background_steps {
            self.background_step(engine)?;
        }
        Ok(())
    }

    /// An I-variable that is a small number.
    fn i(&self, number: u32) -> u32 {
        read_f64(&self.image, self.control.layout.i_offset(number)) as u32
    }

    /// The servo cycle counter X:0 goes up, the timers go down.
    fn count_time(&mut self) {
        let layout = self.control.layout;
        if let Place::Word(offset) = layout.place(Space::X, 0) {
            let count = read_u32(&self.image, offset).wrapping_add(1) & 0xFF_FFFF;
            write_u32(&mut self.image, offset, count);
        }
        for address in [0x700, 0x701] {
            for space in [Space::X, Space::Y] {
                if let Place::Word(offset) = layout.place(space, address) {
                    let time = sign_extend(u64::from(read_u32(&self.image, offset)), 24);
                    let time = (time - 1).max(TIMER_END) as u32 & 0xFF_FFFF;
                    write_u32(&mut self.image, offset, time);
                }
            }
        }
        if !layout.turbo {
            return;
        }
        // Isx11 and Isx12: I5111 for coordinate system 1, I6012 for 10.
        for system in 1..=layout.systems() {
            for timer in [11, 12] {
                let offset = layout.i_offset(5000 + 100 * system + timer);
                let time = read_f64(&self.image, offset) - 1.0;
                write_f64(&mut self.image, offset, time.max(TIMER_END as f64));
            }
        }
    }

    /// The real-time interrupt: PLC0, then PLCC0.
    fn interrupt(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        if !self.control.layout.turbo {
            let left = self.watchdog_register().saturating_sub(8);
            self.set_watchdog_register(left);
        }
        if let Some(watchdog) = &mut self.watchdog {
            watchdog.interrupt()?;
        }
        if matches!(self.i(5), 1 | 3) {
            self.run_if_enabled(context(false, 0), engine)?;
            self.run_if_enabled(context(true, 0), engine)?;
        }
        Ok(())
    }

    /// The next interpreted PLC, all PLCCs, housekeeping, commands.
    fn background_step(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        if self.background_on()
            && let Some(number) = self.next_plc()
        {
            self.last_plc = number;
            self.run_if_enabled(context(false, number), engine)?;
        }
        for number in 1..32 {
            if self.background_on() {
                self.run_if_enabled(context(true, number), engine)?;
            }
        }
        self.housekeeping()?;
        self.do_commands(engine)
    }

    fn background_on(&self) -> bool {
        matches!(self.i(5), 2 | 3)
    }

    /// The enabled interpreted PLC after the last one, around from 31 to 1.
    fn next_plc(&self) -> Option<u32> {
        let last = self.last_plc;
        (last + 1..32).chain(1..=last).find(|number| self.is_enabled(context(false, *number)))
    }

    fn is_enabled(&self, context: u32) -> bool {
        let plc = self.control.plcs.get(context as usize);
        plc.is_some_and(|plc| plc.status == Status::Enabled)
    }

    fn run_if_enabled(&mut self, context: u32, engine: &mut dyn Engine) -> Result<(), Stop> {
        let Some(plc) = self.control.plcs.get_mut(context as usize) else {
            return Ok(());
        };
        if plc.status != Status::Enabled {
            return Ok(());
        }
        let task = plc.task;
        if core::mem::take(&mut plc.restart) {
            engine.reset(task);
        }
        self.run(context, task, engine)
    }

    /// One scan of a task.
    fn run(&mut self, context: u32, task: usize, engine: &mut dyn Engine) -> Result<(), Stop> {
        self.control.running = context;
        let mut scan = Scan { image: &mut self.image, host: &mut self.control };
        match engine.call(task, &mut scan) {
            Outcome::End | Outcome::Suspended => Ok(()),
            Outcome::Trap(code) => Err(Stop {
                code: "WATCHDOG".into(),
                message: format!("a program was stopped from inside ({})", code.name()),
            }),
        }
    }

    fn housekeeping(&mut self) -> Result<(), Stop> {
        if !self.control.layout.turbo {
            self.set_watchdog_register(WATCHDOG_START);
        }
        match &mut self.watchdog {
            Some(watchdog) => {
                let cycle = read_f64(&self.image, self.control.layout.i_offset(10)) / 8_388_608e3;
                let interval = read_f64(&self.image, self.control.layout.i_offset(8)) + 1.0;
                watchdog.background(cycle * interval)
            }
            None => Ok(()),
        }
    }

    fn watchdog_register(&self) -> u32 {
        self.view().read_word(Space::Y, WATCHDOG_REGISTER)
    }

    fn set_watchdog_register(&mut self, value: u32) {
        self.memory().write_word(Space::Y, WATCHDOG_REGISTER, value);
    }

    /// The commands that were queued.
    fn do_commands(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        while let Some(command) = self.control.queue.pop_front() {
            let offset = self.control.layout.q_base + 4 * COMMAND_CONTEXT;
            write_u32(&mut self.image, offset, command.q_base);
            self.run(COMMAND_CONTEXT, command.task as usize, engine)?;
        }
        Ok(())
    }
}
