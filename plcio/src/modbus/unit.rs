//! A unit of a device: what it is told and asked in a poll.

use std::ops::Range;
use std::time::Duration;

use plcc_configuration::drivers::modbus::{Manner, Table};
use tokio::time::Instant;
use tokio_modbus::{ExceptionCode, Request, Response};

use super::blocks::{Block, Member};
use super::link::{Failure, Link, exception};
use super::registers::nearest;
use super::reports::Reports;
use crate::driver::{Stage, Stages};
use crate::session::Shared;

/// How long points are written one by one, after a device has refused them together, before they are tried together again.
const ONE_BY_ONE: Duration = Duration::from_secs(5);

/// Points that are written.
struct Outputs {
    block: Block,
    /// Until when they are written by a request for each, since the device has refused them together: a point that it
    /// refuses must not keep its neighbours from being written.
    one_by_one: Option<Instant>,
    /// Whether coils and registers are written singly, by the functions 5 and 6.
    is_single: bool,
}

/// A unit.
pub(super) struct Unit {
    pub(super) number: u8,
    pub(super) manner: Manner,
    reads: Vec<Block>,
    writes: Vec<Outputs>,
    reports: Reports,
}

fn malformed() -> Failure {
    Failure::Lost("its answer does not fit the request".into())
}

/// Whether a device may take some of the points that it refuses together, where that is its reason.
fn may_be_some(refused: Option<ExceptionCode>) -> bool {
    matches!(
        refused,
        Some(
            ExceptionCode::IllegalDataAddress
                | ExceptionCode::IllegalDataValue
                | ExceptionCode::ServerDeviceFailure
                | ExceptionCode::Custom(_)
        )
    )
}

impl Unit {
    /// A unit with what is read and written.
    pub(super) fn new(
        number: u8,
        manner: Manner,
        reads: Vec<Block>,
        writes: Vec<Block>,
        reports: Reports,
    ) -> Self {
        let is_single = manner.is_single;
        let outputs = |block| Outputs { block, one_by_one: None, is_single };
        let writes = writes.into_iter().map(outputs).collect();
        Self { number, manner, reads, writes, reports }
    }

    /// Whether something is written to it.
    pub(super) fn has_outputs(&self) -> bool {
        !self.writes.is_empty()
    }

    /// Writes all outputs, and reads all inputs while the control is there. What is refused is reported, and no error.
    ///
    /// # Errors
    /// Why the unit is lost.
    pub(super) async fn exchange(
        &mut self,
        link: &mut Link,
        shared: &Shared,
        stages: &Stages,
    ) -> Result<(), Failure> {
        let Self { number, manner, reads, writes, reports } = self;
        if *stages.borrow() == Stage::Works {
            shared.refresh();
        }
        let mut asked = Asked { link, unit: *number, answer: manner.answer, reports, shared };
        for outputs in writes {
            asked.write(outputs).await?;
        }
        for block in reads {
            // When the control has left, its outputs have to become safe at once.
            if *stages.borrow() != Stage::Works {
                break;
            }
            asked.read(block).await?;
        }
        shared.hub().publish();
        Ok(())
    }
}

/// A unit while it is asked.
struct Asked<'a> {
    link: &'a mut Link,
    unit: u8,
    answer: Duration,
    reports: &'a mut Reports,
    shared: &'a Shared,
}

impl Asked<'_> {
    async fn ask(&mut self, request: &Request<'static>) -> Result<Response, Failure> {
        self.link.ask(self.unit, self.answer, request).await
    }

    /// Reads a block and hands its values to the hub.
    async fn read(&mut self, block: &Block) -> Result<(), Failure> {
        let &Block { table, start, count, .. } = block;
        let request = match table {
            Table::Coil => Request::ReadCoils(start, count),
            Table::Discrete => Request::ReadDiscreteInputs(start, count),
            Table::Input => Request::ReadInputRegisters(start, count),
            Table::Holding => Request::ReadHoldingRegisters(start, count),
        };
        let registers: Vec<u16> = match self.ask(&request).await {
            Ok(Response::ReadCoils(bits) | Response::ReadDiscreteInputs(bits)) => {
                // The bits that fill the last byte are not ours.
                let length = usize::from(count);
                if bits.len() != length && bits.len() != length.next_multiple_of(8) {
                    return Err(malformed());
                }
                bits.into_iter().map(u16::from).collect()
            }
            Ok(Response::ReadInputRegisters(words) | Response::ReadHoldingRegisters(words))
                if words.len() == usize::from(count) =>
            {
                words
            }
            Ok(_) => return Err(malformed()),
            Err(Failure::Refused(code)) => {
                self.reports.request((table, start, false), Some(exception(code)));
                return Ok(());
            }
            Err(lost) => return Err(lost),
        };
        self.reports.request((table, start, false), None);
        for member in &block.members {
            let value = block.value(member, &registers);
            // A value that the variable can't have is not a new value; the input becomes late.
            let fits = value.is_some_and(|value| self.shared.hub().set_input(member.index, value));
            let why = || match value {
                Some(value) => format!("the device says {value}, which the variable can't have"),
                None => "the registers hold what is not a decimal digit".into(),
            };
            self.reports.value(self.shared, member, (!fits).then_some(why));
        }
        Ok(())
    }

    /// Writes the present values of points. One that its registers can't hold is left out; where it is the safe value of
    /// an output, the nearest one is written.
    async fn write(&mut self, outputs: &mut Outputs) -> Result<(), Failure> {
        let block = &outputs.block;
        let mut words = vec![0; usize::from(block.count)];
        let mut members: Vec<&Member> = vec![];
        for member in &block.members {
            let hub = self.shared.hub();
            let value = hub.value_outside(member.index).or_else(|| hub.safe_value(member.index));
            // There is none while the image can't be read.
            let Some(value) = value else { return Ok(()) };
            let is_safe = hub.is_made_safe(member.index);
            drop(hub);
            let fits = block.put(member, value, &mut words);
            let instead = nearest(member.address.format, value);
            let is_put = fits || is_safe && block.put(member, instead, &mut words);
            members.extend(is_put.then_some(member));
            let why = || match is_put {
                true => format!(
                    "its safe value {value} does not fit its registers; {instead} is written"
                ),
                false => format!("{value} does not fit its registers"),
            };
            self.reports.value(self.shared, member, (!fits).then_some(why));
        }
        let together = block.pieces(members.iter().copied(), false);
        let single = block.pieces(members.iter().copied(), true);
        let is_due = outputs.one_by_one.is_none_or(|until| until <= Instant::now());
        if is_due && !outputs.is_single {
            outputs.one_by_one = None;
            let refused = self.send(outputs, &words, &together).await?;
            let is_divided =
                single.len() > together.len() && refused.iter().any(|&r| may_be_some(r));
            if !is_divided {
                self.report(&outputs.block, &together, &refused);
                return Ok(());
            }
            outputs.one_by_one = Some(Instant::now() + ONE_BY_ONE);
        }
        let refused = self.send(outputs, &words, &single).await?;
        self.report(&outputs.block, &single, &refused);
        Ok(())
    }

    /// Reports which pieces of a block the device takes.
    fn report(
        &mut self,
        block: &Block,
        pieces: &[Range<usize>],
        refused: &[Option<ExceptionCode>],
    ) {
        for (piece, &code) in pieces.iter().zip(refused) {
            let request = |at: usize| (block.table, block.start.saturating_add(at as u16), true);
            match code {
                Some(code) => self.reports.request(request(piece.start), Some(exception(code))),
                None => piece.clone().for_each(|at| self.reports.request(request(at), None)),
            }
        }
    }

    /// Writes pieces of a block, all of them in any case. Returns for each why the device refuses it, if it does.
    async fn send(
        &mut self,
        outputs: &mut Outputs,
        words: &[u16],
        pieces: &[Range<usize>],
    ) -> Result<Vec<Option<ExceptionCode>>, Failure> {
        let mut refused = vec![];
        for piece in pieces {
            refused.push(match self.send_piece(outputs, words, piece.clone()).await {
                Ok(()) => None,
                Err(Failure::Refused(code)) => Some(code),
                Err(lost) => return Err(lost),
            });
        }
        Ok(refused)
    }

    /// Writes a piece of a block: by one request, or where the device does not know its function by one for each number.
    async fn send_piece(
        &mut self,
        outputs: &mut Outputs,
        words: &[u16],
        piece: Range<usize>,
    ) -> Result<(), Failure> {
        let block = &outputs.block;
        let (is_coil, number) =
            (block.table == Table::Coil, |at| block.start.saturating_add(at as u16));
        let piece_words = words.get(piece.clone()).unwrap_or_default();
        if !outputs.is_single {
            let (start, count) = (number(piece.start), piece_words.len() as u16);
            let request = match is_coil {
                true => {
                    let bits: Vec<bool> = piece_words.iter().map(|&bit| bit != 0).collect();
                    Request::WriteMultipleCoils(start, bits.into())
                }
                false => Request::WriteMultipleRegisters(start, piece_words.to_vec().into()),
            };
            match self.ask(&request).await {
                Err(Failure::Refused(ExceptionCode::IllegalFunction)) => {}
                Err(why) => return Err(why),
                Ok(
                    Response::WriteMultipleCoils(from, written)
                    | Response::WriteMultipleRegisters(from, written),
                ) if (from, written) == (start, count) => return Ok(()),
                Ok(_) => return Err(malformed()),
            }
            self.reports.single_writes(block.table, start);
            outputs.is_single = true;
        }
        for (at, &word) in piece.zip(piece_words) {
            let (number, bit) = (number(at), word != 0);
            let request = match is_coil {
                true => Request::WriteSingleCoil(number, bit),
                false => Request::WriteSingleRegister(number, word),
            };
            let is_done = match self.ask(&request).await? {
                Response::WriteSingleCoil(to, written) => (to, written) == (number, bit),
                Response::WriteSingleRegister(to, written) => (to, written) == (number, word),
                _ => false,
            };
            if !is_done {
                return Err(malformed());
            }
        }
        Ok(())
    }
}
