//! Declarations of digital inputs and outputs, and which lines of which port they use (PMI 3.1.2).

use std::collections::HashMap;

use plcc_abi::pmi::{Format, Lines, Type};
use plcc_diag::{Diagnostic, Span};

use crate::pmi::{
    analyse::specification_section::{HelpIfNone, Result, Section, SpecificationSection},
    ast::Meaning,
    read::{
        cursor::Cursor,
        diagnostic::{self, error},
        token::Kind,
    },
};

/// The last port's number: there are 128 ports on each of 16 MAX boards.
const LAST_PORT: i64 = 2047;

/// What each port is used for.
#[derive(Default)]
pub(crate) struct Ports {
    used: HashMap<u16, Port>,
}

struct Port {
    /// Whether its lines are outputs; otherwise they are inputs.
    output: bool,
    /// The first declaration that uses the port.
    at: Span,
    /// For each bit of an output port the declaration of the output that drives it.
    bits: [Option<Span>; 8],
}

impl SpecificationSection<'_> {
    /// `v = port/bit` or `v = port/bit1-bit2/type`.
    pub(crate) fn port_line(&mut self, cursor: &mut Cursor<'_>, section: Section) -> Result {
        let name = self.new_name(cursor)?;
        self.check_new(name)?;
        self.expect(cursor, Kind::Eq, "=")?;
        let (port, port_span) = self.number(cursor)?;
        if !(0..=LAST_PORT).contains(&port) {
            return Err(error(13, port_span, format!("there is no port {port}"))
                .help("ports go from 0 to 2047: 128 for each of 16 MAX boards")
                .into());
        }
        let output = section == Section::Output;
        let port = port as u16;
        if let Some(used) = self.ports.used.get(&port)
            && used.output != output
        {
            let (number, was, is) =
                if output { (15, "inputs", "outputs") } else { (14, "outputs", "inputs") };
            return Err(error(
                number,
                port_span,
                format!("port {port} has {was} and cannot have {is} too"),
            )
            .label(used.at, format!("its {was} are declared here"))
            .help("all lines of a port go in one direction; use another port")
            .into());
        }
        self.expect(cursor, Kind::Slash, "/")?;
        let low = self.bit(cursor)?;
        let lines = match cursor.kind() {
            None => Lines { port, low, count: 1, format: Format::Bit },
            Some(Kind::Minus) => {
                cursor.at += 1;
                self.group(cursor, port, low)?
            }
            Some(_) => {
                let what = format!("{} stands after the line's bit", cursor.found());
                let help = "a group of bits is written port/bit-bit/type, for instance 2/0-7/BCD";
                return Err(cursor.error_here(5, what).help_if_none(help).into());
            }
        };
        self.end(cursor)?;
        let shared = self.claim_bits(lines, output, name.1);
        let meaning = if output { Meaning::Output(lines) } else { Meaning::Input(lines) };
        let ty = if lines.format == Format::Bit { Type::Logical } else { Type::Integer };
        self.declare(name, ty, None, meaning)?;
        match shared {
            Some((bit, other)) => Err(Diagnostic::error(
                diagnostic::SHARED_OUTPUT,
                name.1,
                format!("port {port} bit {bit} is an output already"),
            )
            .label(other, "it is declared here")
            .help("give the output a line of its own")
            .into()),
            None => Ok(()),
        }
    }

    /// The number of a bit, 0 to 7.
    fn bit(&self, cursor: &mut Cursor<'_>) -> Result<u8> {
        let (bit, span) = self.number(cursor)?;
        match u8::try_from(bit) {
            Ok(bit @ 0..=7) => Ok(bit),
            _ => Err(error(16, span, format!("there is no bit {bit}"))
                .help("bits go from 0 to 7")
                .into()),
        }
    }

    /// `bit2/type` of a group whose first bit is `low`.
    fn group(&self, cursor: &mut Cursor<'_>, port: u16, low: u8) -> Result<Lines> {
        let span = cursor.span();
        let high = self.bit(cursor)?;
        if high <= low {
            return Err(error(
                16,
                span,
                format!("the last bit, {high}, is not above the first, {low}"),
            )
            .help("name the lowest bit first")
            .into());
        }
        self.expect(cursor, Kind::Slash, "/")?;
        let span = cursor.span();
        let format = match cursor.name() {
            Some(("B", _)) => Format::Binary,
            Some(("BCD", _)) => Format::Bcd,
            Some(("TWOC", _)) => Format::TwosComplement,
            Some((other, _)) => {
                return Err(error(17, span, format!("`{other}` is no type of number"))
                    .help("the types are B (binary), BCD and TWOC (two's complement)")
                    .into());
            }
            None => {
                let what = format!("a type of number is expected, not {}", cursor.found());
                let help = "the types are B (binary), BCD and TWOC (two's complement)";
                return Err(cursor.error_here(17, what).help_if_none(help).into());
            }
        };
        Ok(Lines { port, low, count: high - low + 1, format })
    }

    /// Notes that a declaration at `at` uses these lines. Gives the first bit that another output
    /// drives already, and where that one is declared.
    fn claim_bits(&mut self, lines: Lines, output: bool, at: Span) -> Option<(u8, Span)> {
        let entry = self.ports.used.entry(lines.port);
        let port = entry.or_insert(Port { output, at, bits: [None; 8] });
        if !output {
            return None;
        }
        let mut shared = None;
        for bit in lines.low..lines.low + lines.count {
            if let Some(slot) = port.bits.get_mut(usize::from(bit)) {
                match *slot {
                    Some(other) => shared = shared.or(Some((bit, other))),
                    None => *slot = Some(at),
                }
            }
        }
        shared
    }
}
