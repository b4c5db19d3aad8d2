//! Lines of Linux's GPIO character device: inputs are read and outputs are written in every poll.
//!
//! A line belongs to `plcio` while it is connected; no other program can use it. A call of the kernel may take long, for
//! example where the chip is behind a USB or I2C bus, so calls are made on threads of their own. A chip that
//! is pulled out counts as lost, and is opened again after pauses that grow from 0.1 s to 5 s; its inputs become late meanwhile.

mod lines;

use std::time::Duration;

use plcc_image::configuration::Address;
use serde_json::Value;
use tokio::time::{Instant, sleep_until, timeout};

use crate::session::{Shared, Stage, Stages, is_over};
use lines::{ChipLines, Output, Requested};

/// The pause before a chip is opened again for the first time. It doubles with each attempt that fails.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
/// The longest pause before a chip is opened again.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// A chip with the lines that the configuration names.
pub(crate) struct Chip {
    /// Its name in `/dev`.
    name: String,
    lines: ChipLines,
}

/// The chips of some points.
pub(crate) fn chips(shared: &Shared, points: &[usize]) -> Vec<Chip> {
    let hub = shared.hub();
    let mut chips: Vec<Chip> = vec![];
    for &index in points {
        let Some(point) = hub.point(index) else { continue };
        let Some(Address::Gpio(line)) = &point.address else { continue };
        let at = chips.iter().position(|chip| chip.name == line.chip).unwrap_or_else(|| {
            chips.push(Chip { name: line.chip.clone(), lines: ChipLines::default() });
            chips.len() - 1
        });
        if let Some(chip) = chips.get_mut(at) {
            let (line, circuit) = (line.line, line.circuit);
            match point.is_input {
                true => chip.lines.inputs.push((index, line, circuit)),
                false => chip.lines.outputs.push((index, line, circuit)),
            }
        }
    }
    chips
}

/// Does work that may have to wait for a chip on a thread of its own, and waits for its result. If that takes longer than a
/// device has for its answer, the event `lost` is written first; `lost` is the reason of the last such event, if the chip is
/// still lost.
///
/// # Errors
/// Why the work failed; nothing where the session ended.
async fn on_a_thread<T: Send + 'static>(
    (shared, chip, lost): (&Shared, &str, &mut Option<String>),
    stages: &mut Stages,
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, Option<String>> {
    let mut task = tokio::task::spawn_blocking(work);
    let done = match timeout(shared.settings.answer, &mut task).await {
        Ok(done) => done,
        Err(_) => {
            report_lost(shared, chip, lost, "the chip does not answer");
            // The session waits for two seconds at its end.
            tokio::select! {
                done = &mut task => done,
                () = is_over(stages) => return Err(None),
            }
        }
    };
    done.map_err(|error| Some(error.to_string()))?.map_err(Some)
}

/// Writes the event `lost`, unless the last one had the same reason.
fn report_lost(shared: &Shared, chip: &str, lost: &mut Option<String>, why: &str) {
    if lost.as_deref() != Some(why) {
        shared.events.write("lost", &[("device", Value::from(chip)), ("why", why.into())]);
        *lost = Some(why.to_owned());
    }
}

impl Chip {
    /// Exchanges values with the chip until the session ends; then writes the outputs once more. When the control has left, a
    /// chip with outputs still gets their safe values.
    pub(crate) async fn run(self, shared: Shared, mut stages: Stages) {
        let mut pause = FIRST_PAUSE;
        // Why the chip was lost, while it is.
        let mut lost: Option<String> = None;
        // When the control has left, its inputs are of no use.
        while *stages.borrow() == Stage::Works || !self.lines.outputs.is_empty() {
            let Err(Some(why)) = self.exchange(&shared, &mut stages, &mut lost, &mut pause).await
            else {
                return;
            };
            report_lost(&shared, &self.name, &mut lost, &why);
            tokio::select! {
                () = tokio::time::sleep(pause) => {}
                () = is_over(&mut stages) => return,
            }
            pause = (pause * 2).min(LONGEST_PAUSE);
        }
    }

    /// The values that the output lines have to have. Before the first tick they are safe.
    fn outputs(&self, shared: &Shared) -> Vec<Output> {
        let hub = shared.hub();
        let output = |&(index, line, circuit)| {
            let value = hub.value_outside(index).or_else(|| hub.safe_value(index));
            Output { line, circuit, value: value.is_some_and(|value| value != 0.0) }
        };
        self.lines.outputs.iter().map(output).collect()
    }

    /// Opens the chip, and exchanges values until the session ends.
    ///
    /// # Errors
    /// Why the chip was lost.
    async fn exchange(
        &self,
        shared: &Shared,
        stages: &mut Stages,
        lost: &mut Option<String>,
        pause: &mut Duration,
    ) -> Result<(), Option<String>> {
        let (name, inputs, outputs) =
            (self.name.clone(), self.lines.inputs.clone(), self.outputs(shared));
        let open = move || Requested::open(&name, &inputs, &outputs);
        let mut requested = on_a_thread((shared, &self.name, lost), stages, open).await?;
        let mut is_connected = false;
        let mut next = Instant::now();
        loop {
            let stage = *stages.borrow_and_update();
            let outputs = self.outputs(shared);
            let work = move || {
                requested.write(&outputs)?;
                let values = requested.read()?;
                Ok((requested, values))
            };
            let values;
            (requested, values) = on_a_thread((shared, &self.name, lost), stages, work).await?;
            if stage == Stage::Ends || stage == Stage::Left && self.lines.outputs.is_empty() {
                return Ok(());
            }
            // A chip that was slow is connected again when it has answered.
            if !std::mem::replace(&mut is_connected, true) || lost.take().is_some() {
                shared.events.write("connected", &[("device", Value::from(self.name.as_str()))]);
                (*lost, *pause) = (None, FIRST_PAUSE);
            }
            {
                let mut hub = shared.hub();
                for (&(index, ..), value) in self.lines.inputs.iter().zip(values) {
                    hub.set_input(index, f64::from(value));
                }
                hub.publish();
            }
            next = (next + shared.settings.poll).max(Instant::now());
            tokio::select! {
                () = sleep_until(next) => {}
                changed = stages.changed() => if changed.is_err() { return Ok(()) },
            }
        }
    }
}
