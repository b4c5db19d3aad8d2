//! The parts of the specification section and the directives that begin them (PMI 3.1).

use crate::pmi::read::{cursor::Cursor, token::Kind};

/// A directive's part of the section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Section {
    Input,
    Output,
    Logical,
    Integer,
    Long,
    Fault,
    Message,
    Key,
    MCode,
    GCode,
    Timer,
    FlipFlop,
    AuxAxis,
    End,
}

impl Section {
    /// A help that says how its statements are written.
    pub(crate) fn form(self) -> &'static str {
        match self {
            Self::Input | Self::Output => {
                "write NAME = port/bit, or NAME = port/bit-bit/type for a group: TOOLN = 2/0-7/BCD"
            }
            Self::Logical | Self::Integer | Self::Long => {
                "write NAME, NAME[n], NAME = constant or NAME[n] = [constant, constant…], with \
                 commas between them"
            }
            Self::Fault | Self::Message => "write NAME = \"text\", VARIABLE, \"text\"…",
            Self::Key => "write NAME = \"text\"",
            Self::MCode => "write @M03/P or @M03/D, with commas between them",
            Self::GCode => "write @G84/P or @G84/D, with commas between them",
            Self::Timer => "write E/CONTROL/DELAYED = units of 20 ms, or D/CONTROL/DELAYED",
            Self::FlipFlop => "write five names: Q/D/CK/PR/CL",
            Self::AuxAxis => "write NAME = number, number…",
            Self::End => "put declarations in front of $END",
        }
    }
}

/// The directives, except `$INCLUDE`, which `split` follows.
pub(crate) const DIRECTIVES: [(&str, Section); 14] = [
    ("$INPUT", Section::Input),
    ("$OUTPUT", Section::Output),
    ("$LOGICAL", Section::Logical),
    ("$INTEGER", Section::Integer),
    ("$LONG", Section::Long),
    ("$FAULT", Section::Fault),
    ("$MESSAGE", Section::Message),
    ("$KEY", Section::Key),
    ("$MCODE", Section::MCode),
    ("$GCODE", Section::GCode),
    ("$TIMER", Section::Timer),
    ("$FLIPFLOP", Section::FlipFlop),
    ("$AUXAXIS", Section::AuxAxis),
    ("$END", Section::End),
];

/// The directive that a statement with an error was meant to be: one in small letters, or one with
/// something in front of it. The statements that follow are read as its own.
pub(crate) fn directive_meant(cursor: &Cursor<'_>) -> Option<Section> {
    let statement = cursor.statement_span();
    let first = cursor.text.get(statement.range()).filter(|text| text.starts_with('$'));
    let directive = cursor.tokens.iter().find(|token| token.kind == Kind::Directive);
    let text = first.or_else(|| directive.map(|token| cursor.slice(*token)))?;
    let end = text.bytes().skip(1).take_while(u8::is_ascii_alphanumeric).count() + 1;
    let word = text.get(..end)?.to_ascii_uppercase();
    DIRECTIVES.iter().find(|(name, _)| *name == word).map(|&(_, section)| section)
}
