//! The exchange of values with the terminals, poll for poll.

use std::collections::HashSet;
use std::time::Duration;

use ethercrab::subdevice_group::Op;
use ethercrab::{MainDevice, SubDeviceState};
use serde_json::Value;
use tokio::time::{Instant, sleep_until};

use super::bring_up::{Group, Terminal, bring_down, switch_off, text, who_is_not, working_counter};
use super::{STATE_CHANGE, Segment, process_data};
use crate::driver::{Stage, Stages, is_over};
use crate::session::Shared;

/// The longest time from one exchange to the next. Terminals switch outputs off that are not written for 100 ms.
const LONGEST_PERIOD: Duration = Duration::from_millis(50);

/// The connection while values are exchanged.
struct Exchange<'a> {
    segment: &'a Segment,
    main_device: &'a MainDevice<'a>,
    shared: &'a Shared,
    group: Group<Op>,
    terminals: Vec<Terminal>,
    /// The outputs that were reported as refused, by their indices in the hub.
    refused: HashSet<usize>,
}

impl Segment {
    /// Brings the terminals up and exchanges values with them until the session ends; then brings them down.
    ///
    /// # Errors
    /// Why the connection was lost.
    pub(super) async fn work(
        &self,
        main_device: &MainDevice<'_>,
        shared: &Shared,
        mut stages: Stages,
        was_connected: &mut bool,
    ) -> Result<(), String> {
        let mut until_end = stages.clone();
        let up = tokio::select! {
            up = self.start(main_device, shared) => up.map(Some),
            () = is_over(&mut until_end) => Ok(None),
        };
        let done = match up {
            Ok(Some(mut exchange)) => {
                let done = exchange.run(&mut stages, was_connected).await;
                done.map(|()| Some(exchange.group))
            }
            Ok(None) => Ok(None),
            Err(why) => Err(why),
        };
        match done {
            Ok(Some(group)) => {
                bring_down(group, main_device).await;
                Ok(())
            }
            Ok(None) => {
                switch_off(main_device).await;
                Ok(())
            }
            Err(why) => {
                switch_off(main_device).await;
                Err(why)
            }
        }
    }

    /// Brings the terminals up, and asks them to enter the state OP.
    ///
    /// # Errors
    /// Why that is not possible.
    async fn start<'a>(
        &'a self,
        main_device: &'a MainDevice<'a>,
        shared: &'a Shared,
    ) -> Result<Exchange<'a>, String> {
        let expected = &shared.settings.drivers.ethercat.terminals;
        let (group, terminals) = self.bring_up(main_device, expected).await?;
        let group = group.request_into_op(main_device).await.map_err(text)?;
        let refused = HashSet::new();
        Ok(Exchange { segment: self, main_device, shared, group, terminals, refused })
    }
}

impl Exchange<'_> {
    /// Exchanges values until the session ends. The last exchange writes the outputs that it has left.
    ///
    /// # Errors
    /// Why the connection was lost.
    async fn run(&mut self, stages: &mut Stages, was_connected: &mut bool) -> Result<(), String> {
        let answer = self.shared.settings.answer;
        let period = self.shared.settings.poll.min(LONGEST_PERIOD);
        // Until when there must be a good exchange.
        let mut limit = Instant::now() + STATE_CHANGE;
        let mut next = Instant::now();
        loop {
            let stage = *stages.borrow_and_update();
            let is_last = stage == Stage::Ends;
            if stage == Stage::Works {
                self.shared.refresh();
            }
            self.set_outputs();
            let done = self.poll(*was_connected).await;
            if is_last {
                return Ok(());
            }
            match done {
                Ok(()) => {
                    limit = Instant::now() + answer;
                    if !std::mem::replace(was_connected, true) {
                        self.report_connected();
                    }
                    self.take_inputs();
                }
                Err((why, is_lost)) if is_lost || Instant::now() > limit => return Err(why),
                Err(_) => {}
            }
            next = (next + period).max(Instant::now());
            tokio::select! {
                () = sleep_until(next) => {}
                changed = stages.changed() => if changed.is_err() { return Ok(()) },
            }
        }
    }

    /// Exchanges process data once.
    ///
    /// # Errors
    /// Why the inputs can't be taken, and whether the connection is lost for that reason at once, rather than when it
    /// lasts. A terminal that has been in OP and is no more in it does not come back by itself.
    async fn poll(&self, was_connected: bool) -> Result<(), (String, bool)> {
        let response = self.group.tx_rx(self.main_device).await;
        let response = response.map_err(|error| (text(error), false))?;
        let states = &response.subdevice_states;
        let are_all = states.len() == self.terminals.len();
        if !are_all || states.iter().any(|&state| state != SubDeviceState::Op) {
            let who = who_is_not(self.main_device, &self.terminals, SubDeviceState::Op).await;
            // It may have entered the state meanwhile.
            let is_lost = was_connected && who.is_some();
            return Err((who.unwrap_or_else(|| "a terminal was not in OP".into()), is_lost));
        }
        let wanted = working_counter(&self.terminals);
        match response.working_counter {
            counter if counter == wanted => Ok(()),
            counter => Err((format!("the working counter is {counter}, not {wanted}"), false)),
        }
    }

    /// Puts the values that outputs have to have into the process data. Before the first tick they are safe.
    fn set_outputs(&mut self) {
        let device = || ("device", Value::from(self.segment.interface.as_str()));
        let hub = self.shared.hub();
        for (index, point) in &self.segment.outputs {
            let value = hub.value_outside(*index).or_else(|| hub.safe_value(*index));
            let terminal = self.group.subdevice(self.main_device, point.terminal.into());
            let (Some(value), Ok(terminal)) = (value, terminal) else { continue };
            let mut data = terminal.outputs_raw_mut();
            let fits = process_data::write(&mut data, point, value);
            let (low, high) = point.value.range();
            let instead = if value.is_nan() { 0.0 } else { value }.clamp(low, high);
            // What is made safe is written in any case, as the nearest value.
            let is_put =
                !fits && hub.is_made_safe(*index) && process_data::write(&mut data, point, instead);
            let is_new = match fits {
                true => self.refused.remove(index),
                false => self.refused.insert(*index),
            };
            if is_new {
                let name = hub.point(*index).map(|point| point.symbol.name.clone());
                let name = name.unwrap_or_default();
                let why = match is_put {
                    true => {
                        format!("the safe value of {name} is {value}, and {instead} is written")
                    }
                    false => format!("{name} is {value}, which its point can't hold"),
                };
                let about = [device(), ("name", name.into()), ("why", why.into())];
                match fits {
                    true => self.shared.events.write("accepted", about.get(..2).unwrap_or(&[])),
                    false => self.shared.events.write("refused", &about),
                }
            }
        }
    }

    /// Hands the inputs to the control.
    fn take_inputs(&self) {
        let mut hub = self.shared.hub();
        for (index, point) in &self.segment.inputs {
            let terminal = self.group.subdevice(self.main_device, point.terminal.into());
            let value = terminal.ok().and_then(|one| process_data::read(&one.inputs_raw(), point));
            if let Some(value) = value {
                hub.set_input(*index, value);
            }
        }
        hub.publish();
    }

    fn report_connected(&self) {
        let names: Vec<&str> = self.terminals.iter().map(|one| one.name.as_str()).collect();
        let about = [
            ("device", Value::from(self.segment.interface.as_str())),
            ("terminals", names.join(", ").into()),
        ];
        self.shared.events.write("connected", &about);
    }
}
