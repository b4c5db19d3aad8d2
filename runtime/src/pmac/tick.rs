//! What happens in a servo cycle, and in which order (guide, PMAC Tasks; rulings, Time).

use std::ops::Range;

use plcc_abi::{
    Engine, Outcome, ResumePoint, Scan, TimeLimit, Trap, TrapCode,
    image::{read_f64, read_u32, write_f64, write_u32},
    pmac::{
        COMMAND_CONTEXT, Controller, Layout, MOTION_CONTEXT, Place, Space, context,
        fixed::sign_extend, layout::WORD_SIZE,
    },
};

use super::{PmacExecutive, state::Status, watchdog};
use crate::watchdog::Watchdog;
use crate::{ClockDecision, Place as SourcePlace, Stop, Trip};

/// What housekeeping sets the watchdog's register to.
const WATCHDOG_START: u32 = 4095;

/// By how much each real-time interrupt lowers that register: after 512 interrupts without housekeeping it
/// is 0.
const WATCHDOG_STEP: u32 = 8;

/// The bit of the global status that says that an interrupt was not done when the next one was due.
const REENTRY: u32 = 1 << 22;

/// A servo cycle in 1/8388608 ms, the default of I10.
const SERVO_CYCLE: f64 = 3_713_707.0;

/// The most negative value of a signed 24-bit timer, where it stops.
const TIMER_END: i64 = -0x80_0000;

/// Offsets of the words that the executive itself counts in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clocks {
    /// The servo cycle counter X:0.
    cycles: u32,
    /// The timers X and Y:$700 and $701.
    timers: [u32; 4],
    /// The watchdog's register, Y:$1F of a PMAC.
    watchdog: u32,
    /// The first word of the global status, X:$3; X:$6 of a Turbo PMAC.
    status: u32,
}

impl Clocks {
    pub(super) fn new(layout: &Layout) -> Self {
        let word = |space, address| match layout.place(space, address) {
            Place::Word(offset) => offset,
            // Each of these addresses is a word of the image.
            _ => u32::MAX,
        };
        Self {
            cycles: word(Space::X, 0),
            timers: [
                word(Space::X, 0x700),
                word(Space::Y, 0x700),
                word(Space::X, 0x701),
                word(Space::Y, 0x701),
            ],
            // The guide names it for PMAC only. At an offset outside the image nothing is read or written.
            watchdog: match layout.controller {
                Controller::Pmac => word(Space::Y, 0x1F),
                Controller::Turbo => u32::MAX,
            },
            status: match layout.controller {
                Controller::Pmac => word(Space::X, 3),
                Controller::Turbo => word(Space::X, 6),
            },
        }
    }

    /// The parts of the image that the executive itself changes.
    pub(super) fn ranges(&self) -> impl Iterator<Item = Range<u32>> {
        let words = [self.cycles, self.watchdog, self.status].into_iter().chain(self.timers);
        words.filter(|offset| *offset != u32::MAX).map(|offset| offset..offset + WORD_SIZE)
    }
}

/// What users call the program with a context.
fn program_name(context: u32) -> String {
    match context {
        COMMAND_CONTEXT => "a COMMAND".into(),
        MOTION_CONTEXT => "a motion program".into(),
        32.. => format!("PLCC {}", context - 32),
        _ => format!("PLC {context}"),
    }
}

impl PmacExecutive {
    /// One servo cycle.
    pub(super) fn servo_cycle(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        self.count_time(1);
        self.servo();
        if self.host.state.until_interrupt == 0 {
            self.host.state.until_interrupt = self.i(8);
            self.interrupt(engine)?;
        } else {
            self.host.state.until_interrupt -= 1;
        }
        for step in 0..self.options.background_steps {
            self.background_step(engine, step)?;
        }
        Ok(())
    }

    /// An I-variable that is a small number.
    #[inline]
    fn i(&self, number: u32) -> u32 {
        read_f64(&self.image, self.host.layout.i_offset(number)) as u32
    }

    /// Lets the time of servo cycles pass that are not run. A real-time interrupt whose time has come
    /// meanwhile is done in the next one.
    pub(super) fn skip_cycles(&mut self, cycles: u64) {
        self.count_time(cycles);
        let left = &mut self.host.state.until_interrupt;
        *left = left.saturating_sub(u32::try_from(cycles).unwrap_or(u32::MAX));
    }

    /// The servo cycle counter X:0 goes up, the timers go down, by a number of cycles.
    fn count_time(&mut self, cycles: u64) {
        let layout = self.host.layout;
        let clocks = self.clocks;
        let count = read_u32(&self.image, clocks.cycles).wrapping_add(cycles as u32) & 0xFF_FFFF;
        write_u32(&mut self.image, clocks.cycles, count);
        let passed = i64::try_from(cycles).unwrap_or(i64::MAX);
        for offset in clocks.timers {
            let time = sign_extend(u64::from(read_u32(&self.image, offset)), 24);
            let time = time.saturating_sub(passed).max(TIMER_END) as u32 & 0xFF_FFFF;
            write_u32(&mut self.image, offset, time);
        }
        if layout.controller == Controller::Pmac {
            return;
        }
        // Isx11 and Isx12: I5111 for coordinate system 1, I6012 for 10.
        for system in 1..=layout.systems() {
            for timer in [11, 12] {
                let offset = layout.i_offset(5000 + 100 * system + timer);
                let time = read_f64(&self.image, offset) - cycles as f64;
                write_f64(&mut self.image, offset, time.max(TIMER_END as f64));
            }
        }
    }

    /// The real-time interrupt: PLC0, then PLCC0.
    fn interrupt(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        let left = read_u32(&self.image, self.clocks.watchdog).saturating_sub(WATCHDOG_STEP);
        write_u32(&mut self.image, self.clocks.watchdog, left);
        self.watch_interrupt()?;
        if self.simulates() {
            self.host.with_motion(&mut self.image, |machine| machine.interrupt());
        }
        if matches!(self.i(5), 1 | 3) {
            self.run_if_enabled(false, 0, engine)?;
            self.run_if_enabled(true, 0, engine)?;
        }
        self.calculate(engine)?;
        let interval = self.interrupt_interval();
        if self.is_overdue(interval) {
            self.decisions.note(ClockDecision::Overdue);
            let status = read_u32(&self.image, self.clocks.status) | REENTRY;
            write_u32(&mut self.image, self.clocks.status, status);
        }
        Ok(())
    }

    /// The time of a servo cycle in seconds, as I10 says. On a PMAC I10 only tells the programs that time and
    /// sets nothing, so 0 does not stop the clock: the time is the default then.
    pub(super) fn cycle_seconds(&self) -> f64 {
        let units = read_f64(&self.image, self.host.layout.i_offset(10));
        (if units > 0.0 { units } else { SERVO_CYCLE }) / 8_388_608e3
    }

    /// The time between interrupts in seconds.
    fn interrupt_interval(&self) -> f64 {
        self.cycle_seconds() * (read_f64(&self.image, self.host.layout.i_offset(8)) + 1.0)
    }

    /// The next interpreted PLC, all PLCCs, housekeeping, commands.
    fn background_step(&mut self, engine: &mut dyn Engine, step: u32) -> Result<(), Stop> {
        if self.background_on()
            && let Some(number) = self.next_plc()
        {
            self.host.state.last_plc = number;
            self.run_if_enabled(false, number, engine)?;
        }
        let mut from = 1;
        while let Some(number) = self.host.state.plccs.next(from)
            && self.background_on()
        {
            self.run_if_enabled(true, number, engine)?;
            from = number + 1;
        }
        self.housekeeping(step)?;
        self.do_commands(engine)
    }

    fn background_on(&self) -> bool {
        matches!(self.i(5), 2 | 3)
    }

    /// The enabled interpreted PLC after the last one, around from 31 to 1.
    fn next_plc(&self) -> Option<u32> {
        let plcs = &self.host.state.plcs;
        plcs.next(self.host.state.last_plc + 1).or_else(|| plcs.next(1))
    }

    fn run_if_enabled(
        &mut self,
        compiled: bool,
        number: u32,
        engine: &mut dyn Engine,
    ) -> Result<(), Stop> {
        let plcs = if compiled { &mut self.host.state.plccs } else { &mut self.host.state.plcs };
        let Some(plc) = plcs.get_mut(number) else {
            return Ok(());
        };
        if plc.status != Status::Enabled {
            return Ok(());
        }
        let task = plc.task;
        let restart = core::mem::take(&mut plc.restart);
        let from = plc.resume.take().filter(|_| !restart);
        let resume = self.run(context(compiled, number), task, from, engine)?;
        let plcs = if compiled { &mut self.host.state.plccs } else { &mut self.host.state.plcs };
        if let Some(plc) = plcs.get_mut(number) {
            plc.resume = resume;
        }
        Ok(())
    }

    /// Runs one scan of a task. Gives the resume point at which the next one goes on; `None` if that begins at
    /// the top.
    pub(super) fn run(
        &mut self,
        context: u32,
        task: usize,
        from: Option<ResumePoint>,
        engine: &mut dyn Engine,
    ) -> Result<Option<ResumePoint>, Stop> {
        self.host.running = context;
        let limit = self.scan_watchdog.as_ref().map_or(TimeLimit::NONE, Watchdog::begin_scan);
        let mut scan = Scan { image: &mut self.image, host: &mut self.host, limit };
        let outcome = engine.call(task, from, &mut scan);
        if let Some(watchdog) = &self.scan_watchdog {
            watchdog.end();
        }
        match outcome {
            Outcome::End => Ok(None),
            Outcome::Suspended(point) => Ok(Some(point)),
            Outcome::Trap(Trap { code: TrapCode::Watchdog, statement, .. }) => {
                self.decisions.note(ClockDecision::Cut);
                let place =
                    statement.and_then(|statement| SourcePlace::new(&self.files, statement));
                let message = format!(
                    "{} took longer than the watchdog allows{}",
                    program_name(context),
                    SourcePlace::where_stopped(place.as_ref())
                );
                Err(Stop { code: "WATCHDOG".into(), message, place })
            }
            // PMAC's programs have no traps of their own.
            Outcome::Trap(trap) => Err(Stop::internal_error(trap.code)),
        }
    }

    fn housekeeping(&mut self, step: u32) -> Result<(), Stop> {
        write_u32(&mut self.image, self.clocks.watchdog, WATCHDOG_START);
        if self.simulates() {
            self.host.with_motion(&mut self.image, |machine| machine.housekeeping());
        }
        let interval = self.interrupt_interval();
        let tripped = ClockDecision::BackgroundTripped { step };
        let in_time = match (self.decisions.followed(), &mut self.watchdog) {
            (Some(_), _) => !self.decisions.follows(tripped),
            (None, Some(watchdog)) => watchdog.background(interval),
            (None, None) => true,
        };
        if in_time {
            return Ok(());
        }
        self.decisions.note(tripped);
        Err(watchdog::stop(Trip::Starved))
    }

    /// Has the watchdog see that a real-time interrupt came.
    fn watch_interrupt(&mut self) -> Result<(), Stop> {
        let trip = match (self.decisions.followed(), &mut self.watchdog) {
            (Some(followed), _) => followed.iter().find_map(|decision| match decision {
                ClockDecision::InterruptTripped(trip) => Some(*trip),
                _ => None,
            }),
            (None, Some(watchdog)) => watchdog.interrupt(),
            (None, None) => None,
        };
        let Some(trip) = trip else { return Ok(()) };
        self.decisions.note(ClockDecision::InterruptTripped(trip));
        Err(watchdog::stop(trip))
    }

    /// Whether more time than an interval has passed since the real-time interrupt came.
    fn is_overdue(&self, interval: f64) -> bool {
        match (self.decisions.followed(), &self.watchdog) {
            (Some(_), _) => self.decisions.follows(ClockDecision::Overdue),
            (None, Some(watchdog)) => watchdog.is_overdue(interval),
            (None, None) => false,
        }
    }
}
