//! The lines of a chip, as the kernel gives them: requests of at most 64 lines each, by the crate `gpiocdev`.

use gpiocdev::Request;
use gpiocdev::line::{Bias, Drive, Value, Values};
use plcc_configuration::drivers::gpio::Circuit;

/// The most lines that a request may have, by the kernel (GPIO_V2_LINES_MAX).
const MAX_LINES: usize = 64;

/// The points of a chip: the index of each in the hub, its line, and what is switched on at the line.
#[derive(Default)]
pub(super) struct ChipLines {
    pub(super) inputs: Vec<(usize, u32, Circuit)>,
    pub(super) outputs: Vec<(usize, u32, Circuit)>,
}

/// An output line, and the level that it has to have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Output {
    pub(super) line: u32,
    pub(super) circuit: Circuit,
    pub(super) value: bool,
}

/// The lines of a chip that belong to `plcio`, until this is dropped.
pub(super) struct Requested {
    /// The line of each input point, in the order of the points.
    inputs: Vec<u32>,
    reads: Vec<Request>,
    /// The requests of outputs, each with its lines.
    writes: Vec<(Request, Vec<u32>)>,
}

/// A level as the kernel names it. Lines are not inverted there.
fn level(value: bool) -> Value {
    if value { Value::Active } else { Value::Inactive }
}

fn bias(circuit: Circuit) -> Option<Bias> {
    match circuit {
        Circuit::PullUp => Some(Bias::PullUp),
        Circuit::PullDown => Some(Bias::PullDown),
        Circuit::Plain | Circuit::OpenDrain | Circuit::OpenSource => None,
    }
}

fn drive(circuit: Circuit) -> Drive {
    match circuit {
        Circuit::OpenDrain => Drive::OpenDrain,
        Circuit::OpenSource => Drive::OpenSource,
        Circuit::Plain | Circuit::PullUp | Circuit::PullDown => Drive::PushPull,
    }
}

impl Requested {
    /// Asks the kernel for lines of the chip with this name in `/dev`. Outputs get their levels at once.
    ///
    /// # Errors
    /// Why the chip can't be opened, or does not give a line: it may belong to another program.
    pub(super) fn open(
        chip: &str,
        inputs: &[(usize, u32, Circuit)],
        outputs: &[Output],
    ) -> Result<Self, String> {
        let path = format!("/dev/{chip}");
        let mut requested = Self {
            inputs: inputs.iter().map(|input| input.1).collect(),
            reads: vec![],
            writes: vec![],
        };
        // Several points may read a line, which is asked for once.
        let mut lines: Vec<(u32, Circuit)> =
            inputs.iter().map(|input| (input.1, input.2)).collect();
        lines.sort_by_key(|&(line, circuit)| (line, circuit == Circuit::Plain));
        lines.dedup_by_key(|&mut (line, _)| line);
        for some in lines.chunks(MAX_LINES) {
            let mut builder = Request::builder();
            builder.on_chip(&path).with_consumer("plcio");
            for &(line, circuit) in some {
                builder.with_line(line).as_input().with_bias(bias(circuit));
            }
            let request = builder.request().map_err(|error| error.to_string())?;
            requested.reads.push(request);
        }
        for some in outputs.chunks(MAX_LINES) {
            let mut builder = Request::builder();
            builder.on_chip(&path).with_consumer("plcio");
            for output in some {
                builder.with_line(output.line).as_output(level(output.value));
                builder.with_drive(drive(output.circuit));
            }
            let request = builder.request().map_err(|error| error.to_string())?;
            requested.writes.push((request, some.iter().map(|output| output.line).collect()));
        }
        Ok(requested)
    }

    /// Writes the levels of all outputs.
    ///
    /// # Errors
    /// Why the chip does not take them.
    pub(super) fn write(&self, outputs: &[Output]) -> Result<(), String> {
        for (request, lines) in &self.writes {
            let mut values = Values::default();
            for output in outputs.iter().filter(|output| lines.contains(&output.line)) {
                values.set(output.line, level(output.value));
            }
            request.set_values(&values).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// Reads the levels of all inputs, in the order of the points.
    ///
    /// # Errors
    /// Why the chip does not give them.
    pub(super) fn read(&self) -> Result<Vec<bool>, String> {
        let mut values = Values::default();
        for request in &self.reads {
            let mut some = Values::default();
            request.values(&mut some).map_err(|error| error.to_string())?;
            for value in some.iter() {
                values.set(value.offset, value.value);
            }
        }
        let value = |line: &u32| values.get(*line) == Some(Value::Active);
        Ok(self.inputs.iter().map(value).collect())
    }
}
