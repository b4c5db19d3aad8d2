//! The 20 ms slice (NCT 1.2, 1.3).

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use plcc_abi::image::write_u16;
use plcc_abi::nct::{self, LINE_BYTES, NctName, NctSettings, NctTables, context};
use plcc_abi::{Engine, Program, Tables, Trap, TrapCode};
use thiserror::Error;

use crate::aliased_names::with_given;
use crate::checkpoint::{CheckpointError, ProgramIdentity, write_state};
use crate::clock_decisions::ClockDecisions;
use crate::force_list::ONE_BIT;
use crate::image_memory::ImageMemoryError;
use crate::names::Names;
use crate::online_change::{Plan, TakeOver};
use crate::safe_outputs::SafeLines;
use crate::watchdog::Watchdog;
use crate::{
    ClockDecision, DeferredAssignment, Event, Executive, Place, Restored, Setting, Stop,
    TaskStatus, Value, VariableKey,
};

use super::events::Messages;
use super::flag_row::FlagRow;
use super::image::{Image, Module};
use super::memory::NcMemory;
use super::modules::{MAX_SAFEPOINTS, SHARE_OF_SLICE};
use super::names::{self, NctNames};
use super::outputs;
use super::state::State;
use super::time::UsedBefore;
use super::validate;
use super::variables;

/// Milliseconds of a slice.
const SLICE_MS: u64 = 20;
/// Slices in a second and in a minute.
const SECOND: u64 = 50;
const MINUTE: u64 = 3000;
/// Y541: where it is 1 in slice 0, :000 sees the inputs of each slice, else those of the slice in which it
/// began.
const NO_SYNCHRONISATION: (usize, u8) = (54, 1);
/// Y546, by which the program enables :002.
const LEVEL2_ENABLE: (usize, u8) = (54, 6);

/// How many interface boards a machine with these settings has.
pub(super) fn boards(settings: &NctSettings) -> u8 {
    settings.boards.unwrap_or(4).min(4)
}

/// What may be chosen when a program is run.
#[derive(Clone, Debug, Default)]
pub struct NctOptions {
    /// The machine's settings. A program's own come from its [tables](NctTables::settings).
    pub settings: NctSettings,
    /// Safepoints after which :000 is suspended in a slice of simulated time; 10 000 where not
    /// said.
    pub level0_safepoints: Option<u32>,
    /// Modules are suspended and stopped by the clock, not by counting.
    pub realtime: bool,
}

/// Why a program can't be run.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NctLoadError {
    /// It is in another language.
    #[error("this is not an NCT program")]
    OtherDialect,
    /// Its tables don't fit together.
    #[error("the program is damaged: {0}")]
    Damaged(String),
    /// There is no memory for its image.
    #[error(transparent)]
    Memory(#[from] ImageMemoryError),
}

/// The executive of an NCT program.
#[derive(Debug)]
pub struct NctExecutive {
    pub(super) image: Image,
    pub(super) tables: Arc<NctTables>,
    messages: Messages,
    /// With the names that people gave.
    names: Arc<dyn Names>,
    /// The bytes of the output image that drive the physical lines.
    output_row: FlagRow<LINE_BYTES>,
    pub(super) state: State,
    identity: ProgramIdentity,
    pub(super) decisions: ClockDecisions,
    /// How many calls of modules this tick has begun.
    pub(super) calls: u32,
    /// The names of the program's sources.
    files: Vec<String>,
    has_level2: bool,
    pub(super) period_ms: u64,
    pub(super) boards: usize,
    safe_lines: SafeLines,
    pub(super) level0_safepoints: u32,
    pub(super) realtime: bool,
    pub(super) watchdog: Option<Watchdog>,
    pub(super) used_before: UsedBefore,
    /// For each module, whether it used more than half of its last share of real time. :000 and :001
    /// have one share.
    took_long: [bool; nct::MODULES],
}

impl NctExecutive {
    /// Makes a control at power-up.
    ///
    /// # Errors
    /// When the program is of another dialect, or its tables don't fit its image.
    pub fn new(program: &Program, options: NctOptions) -> Result<Self, NctLoadError> {
        let Tables::Nct(tables) = &program.tables else { return Err(NctLoadError::OtherDialect) };
        let NctOptions { settings, level0_safepoints, realtime } = options;
        validate::tables(tables, program).map_err(NctLoadError::Damaged)?;
        let mut image = Image::new(program, tables)?;
        for &(number, value) in &settings.constants {
            if (1..nct::RP_COUNT).contains(&number) {
                write_u16(&mut image.bytes, image.places.rp + u32::from(number) * 2, value);
            }
        }
        for pot in &settings.tool_pots {
            let row = nct::RETAINED_FROM + usize::from(pot.pot) * 2;
            for (location, byte) in tables.flags.iter().skip(row).zip(pot.word().to_le_bytes()) {
                location.write(&mut image.bytes, byte);
            }
        }
        let (boards, shared) = (boards(&settings), Arc::new(tables.clone()));
        let memory = NcMemory::new(&settings);
        let messages = Messages::new(tables, image.bytes.len());
        Ok(Self {
            state: State::new(memory, image.input_lengths(), messages.count()),
            identity: ProgramIdentity::new(program),
            decisions: ClockDecisions::default(),
            calls: 0,
            safe_lines: outputs::all_off(image.places.lines_out),
            files: program.files.clone(),
            output_row: FlagRow::new(&tables.outputs, image.bytes.len()),
            image,
            messages,
            names: with_given(
                Arc::new(NctNames::new(program, Arc::clone(&shared), boards)),
                &program.names,
            ),
            tables: shared,
            has_level2: program.tasks.len() > 2,
            period_ms: settings.control.period_ms(),
            boards: boards.into(),
            level0_safepoints: level0_safepoints.unwrap_or(10_000).max(1),
            realtime,
            watchdog: None,
            used_before: UsedBefore::default(),
            took_long: [false; nct::MODULES],
        })
    }

    /// A flag of the output image.
    fn output(&self, (byte, bit): (usize, u8)) -> bool {
        self.tables.outputs.get(byte).is_some_and(|location| location.bit(&self.image.bytes, bit))
    }

    /// Lets the timers go down (NCT 2.4) by the time of `slices` slices from the present one on. Before slice 0
    /// no time has passed.
    fn count(&mut self, slices: u64) {
        let from = self.state.tick.max(1);
        let end = self.state.tick.saturating_add(slices).max(from);
        let (t, h, m) = (self.image.places.t, self.image.places.h, self.image.places.m);
        if end > from {
            self.image.count_down::<{ nct::T_COUNT as usize * 2 }>(t, end - from);
        }
        // Mostly one slice has passed, with which no second ends.
        if end - from == 1 && !from.is_multiple_of(SECOND) {
            return;
        }
        let seconds = (end - 1) / SECOND - (from - 1) / SECOND;
        if seconds > 0 {
            self.image.count_down::<{ nct::H_COUNT as usize * 2 }>(h, seconds);
        }
        let minutes = (end - 1) / MINUTE - (from - 1) / MINUTE;
        if minutes > 0 {
            self.image.count_down::<{ nct::M_COUNT as usize * 2 }>(m, minutes);
        }
    }

    /// Copies the output image to the physical outputs, and forced values over them.
    fn drive_lines(&mut self) {
        let values = self.output_row.read(&self.image.bytes);
        let lines = self.image.bytes.get_mut(self.image.places.lines_out as usize..);
        if let Some(values) = values.get(..self.boards * 10)
            && let Some(lines) = lines.and_then(|lines| lines.get_mut(..values.len()))
        {
            lines.copy_from_slice(values);
        }
        self.state.forces.apply_to_outputs(&mut self.image.bytes, self.image.places.lines_out);
    }

    /// Why a module was stopped.
    pub(super) fn stop(&self, module: Module, Trap { code, statement, element: _ }: Trap) -> Stop {
        let place = statement.and_then(|statement| Place::new(&self.files, statement));
        let at = |before: &str| {
            place.as_ref().map_or_else(String::new, |place| format!("{before}{place}"))
        };
        let (code, message) = match code {
            TrapCode::Watchdog => (
                format!("PLC TIMEOUT{module}"),
                format!(
                    "module :00{module} did not reach its J{module} within its time{}",
                    Place::where_stopped(place.as_ref())
                ),
            ),
            TrapCode::Timeout if self.realtime => (
                format!("PLC TIMEOUT{module}"),
                format!(
                    "module :00{module} did not reach its J{module} within its time{}",
                    at("; then it jumped back or called in ")
                ),
            ),
            TrapCode::Timeout => (
                format!("PLC TIMEOUT{module}"),
                format!(
                    "module :00{module} passed {MAX_SAFEPOINTS} backward jumps and calls without \
                     reaching its J{module}{}",
                    at("; the last one is in ")
                ),
            ),
            TrapCode::CallDepth => (
                "CALL DEPTH".to_string(),
                format!(
                    "module :00{module} nested calls more than {} deep{}",
                    nct::context::MAX_DEPTH,
                    at(", by the call in ")
                ),
            ),
            TrapCode::Internal | TrapCode::ArrayBounds | TrapCode::HostPanic => {
                return Stop::internal_error(code);
            }
        };
        Stop { code, message, place }
    }

    /// A share of real time begins.
    fn begin_share(&self, module: Module) -> Option<Instant> {
        self.realtime.then(|| {
            self.used_before.begin(self.took_long.get(module).is_some_and(|long| *long));
            Instant::now()
        })
    }

    /// A share of real time has ended, whose module may have taken long.
    fn end_share(&mut self, module: Module, began: Option<Instant>, share: Duration) {
        if let (Some(began), Some(long)) = (began, self.took_long.get_mut(module)) {
            *long = began.elapsed() > share / 2;
        }
    }

    /// Runs :002, in a share of its own.
    fn run_level2(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        let began = self.begin_share(2);
        self.run(engine, 2, began)?;
        self.end_share(2, began, Duration::from_millis(self.period_ms));
        Ok(())
    }

    /// Runs the modules of a tick, each when it is due.
    fn run_modules(&mut self, engine: &mut dyn Engine) -> Result<(), Stop> {
        if self.has_level2 && self.output(LEVEL2_ENABLE) {
            self.run_level2(engine)?;
        }
        let began = self.begin_share(1);
        self.count(1);
        self.latch();
        self.run(engine, 1, began)?;
        if self.state.tick == 0 {
            self.state.synchronised = !self.output(NO_SYNCHRONISATION);
        }
        self.run_level0(engine, began)?;
        self.end_share(1, began, SHARE_OF_SLICE);
        self.drive_lines();
        self.image.compare_input_images(&self.state.modules);
        if self.has_level2 {
            for _ in 1..SLICE_MS / self.period_ms {
                if self.output(LEVEL2_ENABLE) {
                    self.run_level2(engine)?;
                }
            }
        }
        Ok(())
    }

    /// Sets a variable as an assignment would: to the low 16 bits, or the lowest one.
    fn set_name(&mut self, name: NctName, value: Setting) {
        variables::Target {
            image: &mut self.image,
            tables: &self.tables,
            modules: &mut self.state.modules,
            nc_flags: &mut self.state.nc_flags,
        }
        .set(name, value.integer() as u16);
    }

    pub(super) fn view(&self) -> variables::View<'_> {
        variables::View { image: &self.image, modules: &self.state.modules, tables: &self.tables }
    }
}

impl Executive for NctExecutive {
    fn tick_ns(&self) -> u64 {
        SLICE_MS * 1_000_000
    }

    fn tick(&mut self, engine: &mut dyn Engine, events: &mut Vec<Event>) -> Result<(), Stop> {
        self.decisions.begin_tick();
        self.calls = 0;
        let result = self.run_modules(engine);
        if result.is_err() {
            self.image.show(&mut self.state.modules, false);
            self.drive_safe_outputs();
        }
        let State { messages, tick, .. } = &mut self.state;
        let rh = self.image.places.rh;
        self.messages.update(messages, &self.image.bytes, rh, *tick, events);
        self.state.tick += 1;
        result
    }

    fn skip_ticks(&mut self, count: u64) {
        self.count(count);
        self.state.tick = self.state.tick.saturating_add(count);
    }

    fn names(&self) -> Arc<dyn Names> {
        Arc::clone(&self.names)
    }

    fn read(&self, key: VariableKey) -> Value {
        Value::Int(names::name(key).map_or(0, |name| self.view().get(name)).into())
    }

    fn read_into(&self, key: VariableKey, value: &mut Value) {
        *value = self.read(key);
    }

    fn write(&mut self, key: VariableKey, value: Setting) {
        if let Some(name) = names::name(key) {
            self.set_name(name, value);
        }
    }

    fn force(&mut self, key: VariableKey, value: Option<Setting>) -> Result<(), &'static str> {
        let Some(name) = names::name(key) else { return Err("can't be forced") };
        let value = value.map(Setting::integer);
        if name.is_bit() && !matches!(value, None | Some(0 | 1)) {
            return Err(ONE_BIT);
        }
        self.state.forces.set(name, value.map(|value| value as u16))
    }

    fn each_force(&self, see: &mut dyn FnMut(VariableKey, Setting)) {
        for (name, word) in self.state.forces.list() {
            see(names::key(name), Setting::Int(word.into()));
        }
    }

    fn is_held(&self, key: VariableKey) -> bool {
        names::name(key).is_some_and(|name| self.state.forces.hold(name))
    }

    fn each_deferred_assignment(&self, _: &mut dyn FnMut(DeferredAssignment<'_>)) {}

    fn fingerprint(&self) -> u64 {
        self.identity.fingerprint()
    }

    fn take_over(&mut self, old: &mut dyn Executive, plan: &Plan) -> TakeOver {
        let old = old.as_any_mut().downcast_mut::<Self>();
        let (Some(old), Some(plan)) = (old, plan.of_control()) else {
            return TakeOver::Impossible;
        };
        self.take_over_from(old, plan);
        TakeOver::Done
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }

    fn retained_into(&self, out: &mut Vec<u8>) -> bool {
        let locations = self.tables.flags.iter().skip(nct::RETAINED_FROM);
        out.extend(locations.map(|location| location.read(&self.image.bytes)));
        true
    }

    /// What the program changes is not counted, so that the data has to be compared.
    fn retained_revision(&self) -> Option<u64> {
        None
    }

    fn restore(&mut self, retained: &[u8]) -> Result<Restored, String> {
        let locations = self.tables.flags.get(nct::RETAINED_FROM..).unwrap_or_default();
        if retained.len() != locations.len() {
            return Err(format!(
                "it holds {} bytes, F500 to F999 are {}",
                retained.len(),
                locations.len()
            ));
        }
        for (location, &byte) in locations.iter().zip(retained) {
            location.write(&mut self.image.bytes, byte);
        }
        // All programs have the same flags, so that there is nothing to tell.
        Ok(Restored { kept: retained.len(), ..Restored::default() })
    }

    fn shortest_time_limit(&self) -> Option<Duration> {
        let level2 = self.has_level2.then(|| Duration::from_millis(self.period_ms));
        Some(level2.unwrap_or(SHARE_OF_SLICE).min(SHARE_OF_SLICE))
    }

    fn set_watchdog(&mut self, watchdog: Watchdog) {
        self.watchdog = Some(watchdog);
    }

    fn image(&self) -> &[u8] {
        &self.image.bytes
    }

    fn set_image(&mut self, image: &[u8]) {
        if image.len() == self.image.bytes.len() {
            self.image.bytes.copy_from_slice(image);
            self.image.input_images_replaced();
        }
    }

    fn set_safe_lines(&mut self, lines: SafeLines) {
        self.safe_lines = lines;
    }

    fn safe_lines(&self) -> &SafeLines {
        &self.safe_lines
    }

    fn drive_safe_outputs(&mut self) {
        self.safe_lines.drive(&mut self.image.bytes);
    }

    fn checkpoint(&self) -> Vec<u8> {
        self.identity.write(&self.image.bytes, &self.state)
    }

    fn state_into(&self, out: &mut Vec<u8>) {
        write_state(&self.state, out);
    }

    fn compared_ranges(&self) -> Vec<Range<u32>> {
        // How much fuel a call gets at a time depends on the clock.
        let context = self.image.places.context;
        let fuel = context + context::FUEL..context + context::ON_EMPTY + 1;
        self.identity.image_without(self.image.bytes.len(), &["scratch", "waiting"], &[fuel])
    }

    fn clock_decisions(&self) -> &[ClockDecision] {
        self.decisions.noted()
    }

    fn follow_clock(&mut self, decisions: Option<&[ClockDecision]>) {
        self.decisions.follow(decisions);
    }

    /// The modules always run.
    fn task_statuses(&self) -> Vec<TaskStatus> {
        vec![]
    }

    /// The image is small, and all of it counts as used.
    fn used_ranges(&self) -> Vec<Range<u32>> {
        vec![]
    }

    fn resume(&mut self, checkpoint: &[u8]) -> Result<(), CheckpointError> {
        let size = self.image.bytes.len();
        let (image, state): (_, State) = self.identity.read(size, checkpoint)?;
        let mut resume = state.resume.iter().enumerate();
        let resumes = resume.all(|(module, &from)| self.identity.can_resume(module, from));
        if !resumes || !state.fits(&self.state) {
            return Err(CheckpointError::Damaged);
        }
        self.image.bytes.copy_from_slice(&image);
        self.state = state;
        self.state.forces.list_again();
        self.image.input_images_replaced();
        Ok(())
    }
}
