//! The values of all points, between the drivers and the image file.

use std::time::Duration;

use plcc_configuration::Point;
use plcc_image::{Direction, ImageReader, Input, InputWriter, Snapshot, State, Symbol};

/// The image file with its points. Drivers name a point by its index.
#[derive(Debug)]
pub(crate) struct Hub {
    reader: ImageReader,
    /// What gives the control its inputs; nothing when it has left.
    writer: Option<InputWriter>,
    points: Vec<(Point, Option<Input>)>,
    /// All variables of the program.
    #[cfg_attr(not(feature = "opcua"), expect(dead_code, reason = "only OPC UA shows them"))]
    symbols: Vec<Symbol>,
    silence: Duration,
    /// The tick that was read last, with safe outputs where they must be.
    tick: Option<Snapshot>,
    /// Whether the outputs in `tick` have their safe values, since the control ends no ticks or `plcio` ends.
    safe: bool,
    /// Whether `plcio` ends.
    ending: bool,
}

/// What a control is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ControlState {
    /// Its first tick has not ended.
    Waiting,
    /// It runs its program.
    Running,
    /// Its program is stopped, by a fault or by a command.
    Stopped,
    /// It ends no ticks.
    Silent,
    /// It has ended.
    Ended,
}

#[cfg(any(feature = "opcua", feature = "mqtt", feature = "zenoh"))]
impl ControlState {
    /// The word for it that others see.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Running => "running",
            Self::Stopped => "stopped",
            Self::Silent => "silent",
            Self::Ended => "ended",
        }
    }

    /// Whether the values are those of a control that does its work.
    #[cfg(feature = "mqtt")]
    pub(crate) fn is_alive(self) -> bool {
        matches!(self, Self::Running | Self::Stopped)
    }
}

impl Hub {
    /// Claims all points that are given from outside, if there is a writer: the control has left otherwise.
    ///
    /// # Errors
    /// Why one can't be claimed.
    pub(crate) fn new(
        reader: ImageReader,
        mut writer: Option<InputWriter>,
        points: Vec<Point>,
        symbols: Vec<Symbol>,
        silence: Duration,
    ) -> Result<Self, String> {
        let mut claimed = vec![];
        for point in points {
            let input = match &mut writer {
                Some(writer) if point.is_input => {
                    Some(writer.claim(&point.symbol.name).map_err(|why| why.to_string())?)
                }
                _ => None,
            };
            claimed.push((point, input));
        }
        Ok(Self {
            reader,
            writer,
            points: claimed,
            symbols,
            silence,
            tick: None,
            safe: false,
            ending: false,
        })
    }

    /// The point with this index.
    pub(crate) fn point(&self, index: usize) -> Option<&Point> {
        self.points.get(index).map(|(point, _)| point)
    }

    /// The indices of the points of a driver.
    pub(crate) fn points_of(&self, driver: &str) -> Vec<usize> {
        let is_own = |(_, (point, _)): &(usize, &(Point, Option<Input>))| {
            point.entry.driver.name() == driver
        };
        self.points.iter().enumerate().filter(is_own).map(|(index, _)| index).collect()
    }

    /// The safe value that a point outside gets of an output; of what is not an output the present one.
    pub(crate) fn safe_value(&self, index: usize) -> Option<f64> {
        let (point, _) = self.points.get(index)?;
        let mut tick = self.reader.read()?;
        self.reader.make_safe(&mut tick);
        tick.output(&point.symbol).map(|value| point.outside(value))
    }

    /// Whether the value of a point is the safe value of an output, since the program does not run.
    pub(crate) fn is_made_safe(&self, index: usize) -> bool {
        let is_output = |point: &Point| point.symbol.direction == Direction::Output;
        let runs = [State::Prepared, State::Running, State::Replaced].map(Some);
        let are_safe = self.tick.as_ref().is_some_and(|tick| !runs.contains(&tick.state));
        (self.safe || are_safe) && self.point(index).is_some_and(is_output)
    }

    /// Whether the outputs have their safe values since the control has left, ends no ticks, or `plcio` ends.
    pub(crate) fn is_safe(&self) -> bool {
        self.safe
    }

    /// All variables of the program.
    #[cfg(feature = "opcua")]
    pub(crate) fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// The tick that was read last, with safe outputs where the control is silent; `None` before the first.
    #[cfg(any(feature = "opcua", feature = "zenoh"))]
    pub(crate) fn tick(&self) -> Option<&Snapshot> {
        self.tick.as_ref()
    }

    /// What the control is doing, as far as it can be seen.
    pub(crate) fn control_state(&self) -> ControlState {
        match self.tick.as_ref().map(|tick| tick.state) {
            None => ControlState::Waiting,
            Some(_) if self.writer.is_none() => ControlState::Ended,
            Some(_) if self.safe => ControlState::Silent,
            Some(Some(State::Prepared)) => ControlState::Waiting,
            Some(Some(State::Running)) => ControlState::Running,
            Some(Some(State::Stopped)) => ControlState::Stopped,
            Some(_) => ControlState::Ended,
        }
    }

    /// Sets the variable of an input point to a value of the point outside, converted as the entry says. The control
    /// gets it with [`publish`](Self::publish). Returns whether the variable can have the value; if it can't, the
    /// control gets that, writes an event, and gives the variable its safe value after its timeout.
    pub(crate) fn set_input(&mut self, index: usize, outside: f64) -> bool {
        let Some((point, Some(input))) = self.points.get(index) else { return false };
        let inside = point.inside(outside);
        let Some(writer) = self.writer.as_mut() else { return false };
        let is_set = inside.is_some_and(|inside| writer.set(*input, inside).is_ok());
        if !is_set {
            // A writer that has lost its mailbox ends with the session.
            let _ = writer.refuse(*input);
        }
        is_set
    }

    /// The same for a value that somebody has written who is told whether it was taken: one that the variable can't
    /// have changes nothing.
    #[cfg(any(feature = "opcua", feature = "mqtt", feature = "zenoh"))]
    pub(crate) fn set_input_if_it_fits(&mut self, index: usize, outside: f64) -> bool {
        let fits = self.point(index).is_some_and(|point| point.inside(outside).is_some());
        fits && self.set_input(index, outside)
    }

    /// Hands all values that were taken over to the control.
    pub(crate) fn publish(&mut self) {
        // A writer that has lost its mailbox ends with the session.
        let _ = self.writer.as_mut().map(InputWriter::publish);
    }

    /// Reads the newest tick. Returns whether outputs have become safe (`true`) or are the program's again
    /// (`false`), where that has changed.
    pub(crate) fn refresh(&mut self) -> Option<bool> {
        // A tick whose outputs were made safe is read again, since they may be the program's again.
        let is_old = |tick: &Snapshot| !self.safe && !self.reader.is_newer_than(tick);
        let tick = match self.tick.take() {
            Some(tick) if is_old(&tick) => Some(tick),
            before => {
                let now = self.reader.read();
                self.tick = before;
                now
            }
        };
        let is_silent = |tick: &Snapshot| {
            let since = u128::from(plcc_image::monotonic_ns().saturating_sub(tick.time));
            since > self.silence.as_nanos().max(u128::from(self.reader.tick_ns()) * 10)
        };
        let is_safe = |tick: &Snapshot| match (tick.state, self.writer.is_some()) {
            // After an online change the outputs stay as they are until the next file is served.
            (Some(State::Replaced), _) | (Some(State::Running), true) => is_silent(tick),
            (_, has_control) => !has_control,
        };
        let safe = self.ending || tick.as_ref().is_none_or(is_safe);
        if let Some(tick) = tick {
            self.tick = Some(tick);
        }
        if let Some(tick) = &mut self.tick
            && (safe || matches!(tick.state, Some(State::Ended | State::Dead)))
        {
            self.reader.make_safe(tick);
        }
        (std::mem::replace(&mut self.safe, safe) != safe).then_some(safe)
    }

    /// Whether an online change has made another image file: the control goes on, and this file says no more of it.
    pub(crate) fn is_replaced(&self) -> bool {
        self.tick.as_ref().is_some_and(|tick| tick.state == Some(State::Replaced))
    }

    /// Gives the outputs their safe values, since the control has left, and releases its inputs. Only after an online
    /// change the outputs stay as they are, until that was longer ago than a control may be silent.
    pub(crate) fn leave(&mut self) {
        self.writer = None;
        self.refresh();
    }

    /// Gives the outputs their safe values from now on, since `plcio` ends.
    pub(crate) fn end(&mut self) {
        self.ending = true;
        self.refresh();
    }

    /// Whether `plcio` ends.
    #[cfg(feature = "opcua")]
    pub(crate) fn is_ending(&self) -> bool {
        self.ending
    }

    /// The value that the point outside has to have for the present value of its variable, converted as the entry
    /// says; of an output it is the value of its physical lines. `None` before the first tick.
    pub(crate) fn value_outside(&self, index: usize) -> Option<f64> {
        let (point, _) = self.points.get(index)?;
        let value = self.tick.as_ref()?.output(&point.symbol)?;
        Some(point.outside(value))
    }

    /// Whether the control still works with this image file.
    pub(crate) fn is_current(&self) -> bool {
        self.writer.as_ref().is_some_and(InputWriter::is_current)
    }
}
