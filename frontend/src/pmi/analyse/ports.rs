//! Declarations of digital inputs and outputs, and which lines of which port they use (PMI 3.1.2).

use std::collections::HashMap;

use plcc_abi::pmi::{Format, Lines, Type};
use plcc_diag::{Diagnostic, Span};

use crate::pmi::{
    analyse::specification_section::SpecificationSection,
    ast::Meaning,
    read::{
        cursor::Cursor,
        diagnostic::{self, Result, error},
        syntax::PortLines,
    },
};

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
    /// An output, or else an input.
    pub(crate) fn port_lines(
        &mut self,
        cursor: &Cursor<'_>,
        found: &PortLines,
        output: bool,
        form: Result,
    ) -> Result {
        let Some(name) = found.name else { return form };
        self.check_new(cursor, name)?;
        let Some((port, port_span)) = found.port else { return form };
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
        let Some(lines) = found.lines else { return form };
        form?;
        let span = cursor.span_of(name);
        let shared = self.claim_bits(lines, output, span);
        let meaning = if output { Meaning::Output(lines) } else { Meaning::Input(lines) };
        let ty = if lines.format == Format::Bit { Type::Logical } else { Type::Integer };
        self.declare(cursor, name, ty, None, meaning)?;
        match shared {
            Some((bit, other)) => Err(Diagnostic::error(
                diagnostic::SHARED_OUTPUT,
                span,
                format!("port {port} bit {bit} is an output already"),
            )
            .label(other, "it is declared here")
            .help("give the output a line of its own")
            .into()),
            None => Ok(()),
        }
    }

    /// Notes that a declaration at `at` uses these lines. Returns the first bit that another output
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
