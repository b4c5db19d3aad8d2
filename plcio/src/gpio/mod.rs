//! Lines of Linux's GPIO character device: inputs are read and outputs are written in every poll.
//!
//! A line belongs to `plcio` while it is connected; no other program can use it. A call of the kernel may take long, for
//! example where the chip is behind a USB or I2C bus, so calls are made on threads of their own. A chip that
//! is pulled out counts as lost, and is opened again after pauses that grow from 0.1 s to 5 s; its inputs become late meanwhile.

mod lines;

use plcc_configuration::drivers::gpio::GpioLine;
use tokio::time::{Instant, sleep_until, timeout};

use crate::driver::{Driver, Making, Stage, Stages, Start, is_over};
use crate::reconnection::Reconnection;
use crate::session::Shared;
use lines::{ChipLines, Output, Requested};

/// The driver: each chip is a task of its own.
struct Gpio;

/// Makes the driver.
pub(crate) fn driver(_: &Making<'_>) -> Box<dyn Driver> {
    Box::new(Gpio)
}

impl Driver for Gpio {
    fn start(&mut self, session: &mut Start<'_>) {
        for chip in chips(session.shared, session.points) {
            session.write(chip.run(session.shared.clone(), session.stages.clone()));
        }
    }
}

/// A chip with the lines that the configuration names.
struct Chip {
    /// Its name in `/dev`.
    name: String,
    lines: ChipLines,
}

/// The chips of some points.
fn chips(shared: &Shared, points: &[usize]) -> Vec<Chip> {
    let hub = shared.hub();
    let mut chips: Vec<Chip> = vec![];
    for &index in points {
        let Some(point) = hub.point(index) else { continue };
        let Some(line) = point.address::<GpioLine>() else { continue };
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
/// device has for its answer, the chip counts as lost until then.
///
/// # Errors
/// Why the work failed; nothing where the session ended.
async fn on_a_thread<T: Send + 'static>(
    (shared, connection): (&Shared, &mut Reconnection),
    stages: &mut Stages,
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, Option<String>> {
    let mut task = tokio::task::spawn_blocking(work);
    let done = match timeout(shared.settings.answer, &mut task).await {
        Ok(done) => done,
        Err(_) => {
            connection.lost("the chip does not answer");
            // The session waits for two seconds at its end.
            tokio::select! {
                done = &mut task => done,
                () = is_over(stages) => return Err(None),
            }
        }
    };
    done.map_err(|error| Some(error.to_string()))?.map_err(Some)
}

impl Chip {
    /// Exchanges values with the chip until the session ends; then writes the outputs once more. When the control has left, a
    /// chip with outputs still gets their safe values.
    async fn run(self, shared: Shared, mut stages: Stages) {
        let about = vec![("device", self.name.as_str().into())];
        let mut connection = Reconnection::new(shared.events.clone(), about);
        // When the control has left, its inputs are of no use.
        while *stages.borrow() == Stage::Works || !self.lines.outputs.is_empty() {
            let done = self.exchange(&shared, &mut stages, &mut connection).await;
            let Err(Some(why)) = done else { return };
            connection.lost(&why);
            if !connection.wait(is_over(&mut stages)).await {
                return;
            }
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
        connection: &mut Reconnection,
    ) -> Result<(), Option<String>> {
        let (name, inputs, outputs) =
            (self.name.clone(), self.lines.inputs.clone(), self.outputs(shared));
        let open = move || Requested::open(&name, &inputs, &outputs);
        let mut requested = on_a_thread((shared, connection), stages, open).await?;
        let mut next = Instant::now();
        loop {
            let stage = *stages.borrow_and_update();
            if stage == Stage::Works {
                shared.refresh();
            }
            let outputs = self.outputs(shared);
            let work = move || {
                requested.write(&outputs)?;
                let values = requested.read()?;
                Ok((requested, values))
            };
            let values;
            (requested, values) = on_a_thread((shared, connection), stages, work).await?;
            if stage == Stage::Ends || stage == Stage::Left && self.lines.outputs.is_empty() {
                return Ok(());
            }
            // A chip that was slow is connected again when it has answered.
            connection.connected();
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
