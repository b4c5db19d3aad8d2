//! What statements of PLCs and on-line commands share: assignments, lists of PLCs, numbers of
//! motors, and texts in quotes.

use plcc_abi::pmac::{Kind, PlcOp};

use super::cursor::{ParseError, Parsed, syntax, syntax_help};
use super::expr::Reader;
use crate::pmac::ast::{Bin, Expr, Op, PlcSet, Target};
use crate::pmac::origin::TextRange;

/// A statement or on-line command that begins with a variable.
pub(crate) enum VariableCommand {
    /// An assignment.
    Assign(Target, Expr),
    /// `I…=*`: the first variable's number, how many there are, and the difference between the
    /// numbers of two neighbours.
    Defaults(u16, u16, u16),
    /// `M…->` or `L…->`, which a definition follows: the first variable's number, and how
    /// many there are.
    Define(Kind, u16, u16),
    /// The variable alone, which asks for its value or definition.
    Query,
}

impl Reader<'_> {
    /// A statement or on-line command that begins with a variable of `kind`, at the cursor.
    pub(crate) fn variable_command(&mut self, kind: Kind) -> Parsed<VariableCommand> {
        self.double_equals = None;
        self.cur.blanks();
        let start = self.cur.pos;
        self.cur.pos += 1;
        let target = if self.cur.peek() == b'(' {
            if kind == Kind::L {
                return syntax(self.cur.since(start), "an L-variable's number is a constant");
            }
            Target::Indirect(kind, self.index()?)
        } else {
            self.numbered(kind)?
        };
        let at = self.cur.since(start);
        let (first, count, step) = match target {
            Target::Var(_, number) => (number, 1, 1),
            Target::Range { first, count, step, .. } => (first, count, step),
            Target::Indirect(..) => (0, 0, 1),
        };
        if self.cur.peek() == b'-' && self.cur.byte_at(1) == b'>' {
            if !matches!(kind, Kind::M | Kind::L) || count == 0 || step != 1 {
                return syntax(at, "only M- and L-variables are defined with `->`");
            }
            self.cur.pos += 2;
            return match self.cur.peek() {
                b'\n' | 0 => Ok(VariableCommand::Query),
                _ => Ok(VariableCommand::Define(kind, first, count)),
            };
        }
        let compound = match self.cur.peek() {
            _ if kind == Kind::L => None,
            b'&' => Some(Bin::And),
            b'|' => Some(Bin::Or),
            b'^' => Some(Bin::Xor),
            _ => None,
        };
        let from = self.ops.len();
        match compound {
            Some(_) if self.cur.byte_at(1) == b'=' => {
                self.cur.pos += 1;
                match target {
                    Target::Var(kind, number) => self.ops.push(Op::Var(kind, number)),
                    Target::Indirect(kind, index) => {
                        let range = index.start as usize..(index.start + index.len) as usize;
                        self.ops.extend_from_within(range);
                        self.ops.push(Op::Indirect(kind));
                    }
                    Target::Range { .. } => {
                        return syntax(at, "a range of variables is assigned with `=` only");
                    }
                }
            }
            _ if self.cur.byte() == b'=' => {}
            _ => return Ok(VariableCommand::Query),
        }
        let equals = self.cur.pos;
        self.cur.pos += 1;
        if self.cur.byte() == b'=' {
            let at = TextRange::new(equals, equals + 2);
            // Controllers took it in PLCs, so that their listings have it. They do not read the
            // source of PLCCs.
            if kind != Kind::M || self.l_used.is_some() {
                let help = "`==` waits for a move of a motion program; write `=` here";
                return syntax_help(at, "`==` is for motion programs", help);
            }
            self.cur.pos += 1;
            self.double_equals = Some(at);
        }
        if self.cur.peek() == b'*' {
            if kind != Kind::I || count == 0 || compound.is_some_and(|_| self.ops.len() > from) {
                return syntax(self.cur.next_word(), "only I-variables have defaults");
            }
            self.cur.pos += 1;
            return Ok(VariableCommand::Defaults(first, count, step));
        }
        if kind == Kind::L {
            self.uses_range(kind, (first, count, step), at)?;
        }
        self.expression()?;
        if self.ops.get(from..).is_some_and(|_| compound.is_some())
            && let Some(bin) = compound
        {
            self.ops.push(Op::Bin(bin));
        }
        Ok(VariableCommand::Assign(target, self.since(from)))
    }

    /// One variable by its number, or a range: `first..last` or `first,count,step`.
    fn numbered(&mut self, kind: Kind) -> Parsed<Target> {
        let first = self.variable_number()?;
        if self.cur.peek() == b'.' && self.cur.byte_at(1) == b'.' {
            self.cur.pos += 2;
            let from = self.cur.pos;
            // Both `M1..M8` and `M1..8` are found in sources.
            let _ = self.variable_kind() == Some(kind)
                && self.cur.eat(self.cur.byte().to_ascii_uppercase());
            let last = self.variable_number()?;
            if last < first {
                let at = self.cur.since(from);
                return syntax(
                    at,
                    format!("the end of the range {first}..{last} is below its beginning"),
                );
            }
            let at = self.cur.since(from);
            let count = self.range_length(last - first + 1, at)?;
            return Ok(Target::Range { kind, first, count, step: 1 });
        }
        let mut ahead = self.cur;
        if !ahead.eat(b',') {
            return Ok(Target::Var(kind, first));
        }
        let start = ahead.pos;
        let (Some(count), true, Some(step)) = (ahead.integer(), ahead.eat(b','), ahead.integer())
        else {
            self.cur = ahead;
            return self.cur.expected("a range: first,count,step");
        };
        self.cur = ahead;
        let last = u64::from(first).saturating_add(count.saturating_sub(1).saturating_mul(step));
        let at = self.cur.since(start);
        if count == 0 {
            return syntax(at, "a range has one variable at least");
        }
        if last > u64::from(self.last_variable()) {
            return Err(self.beyond_controller(at, format!("the range ends at {last}")));
        }
        let count = self.range_length(count as u16, at)?;
        Ok(Target::Range { kind, first, count, step: step as u16 })
    }

    /// How many of a range's `count` variables are read.
    fn range_length(&mut self, count: u16, at: TextRange) -> Parsed<u16> {
        self.range_budget.take(count).ok_or_else(|| ParseError {
            code: "PMAC-X4",
            at,
            message: "with this range, ranges name more than 2 097 152 variables in all".into(),
            help: Some("assign to each variable once".into()),
        })
    }

    /// `PLC` or `PLCC` and which: numbers and ranges with commas between.
    pub(crate) fn plcs(&mut self) -> Parsed<PlcSet> {
        if !self.cur.eat_word("PLC") {
            return self.cur.expected("PLC or PLCC");
        }
        let compiled = matches!(self.cur.byte(), b'C' | b'c');
        self.cur.pos += usize::from(compiled);
        let mut bits = 0;
        loop {
            let first = self.plc_number()?;
            let mut last = first;
            if self.cur.peek() == b'.' && self.cur.byte_at(1) == b'.' {
                self.cur.pos += 2;
                self.cur.blanks();
                let from = self.cur.pos;
                last = self.plc_number()?;
                if last < first {
                    let at = self.cur.since(from);
                    return syntax(
                        at,
                        format!("the end of the range {first}..{last} is below its beginning"),
                    );
                }
            }
            for number in first..=last {
                bits |= 1u32 << number;
            }
            let mut ahead = self.cur;
            if !(ahead.eat(b',') && (ahead.peek().is_ascii_digit() || ahead.byte() == b'$')) {
                return Ok(PlcSet { compiled, bits });
            }
            self.cur = ahead;
        }
    }

    /// The programs that ENABLE, DISABLE, PAUSE or RESUME is for. Compiled PLCs are never paused.
    pub(crate) fn switched(&mut self, op: PlcOp) -> Parsed<PlcSet> {
        self.cur.blanks();
        let start = self.cur.pos;
        let plcs = self.plcs()?;
        if plcs.compiled && matches!(op, PlcOp::Pause | PlcOp::Resume) {
            let help = "PLCCs are enabled and disabled only";
            return syntax_help(self.cur.since(start), "PAUSE and RESUME are for PLCs", help);
        }
        Ok(plcs)
    }

    /// A PLC's number.
    pub(crate) fn plc_number(&mut self) -> Parsed<u8> {
        self.cur.blanks();
        let start = self.cur.pos;
        match self.cur.integer() {
            Some(number @ 0..=31) => Ok(number as u8),
            Some(number) => {
                syntax(self.cur.since(start), format!("PLCs are numbered 0 to 31, not {number}"))
            }
            None => self.cur.expected("a PLC's number"),
        }
    }

    /// The number of a motor or coordinate system.
    pub(crate) fn addressed(&mut self, what: &str, pmac: u64, turbo: u64) -> Parsed<u8> {
        self.cur.blanks();
        let start = self.cur.pos;
        let last = if self.is_turbo() { turbo } else { pmac };
        match self.cur.integer() {
            Some(number) if (1..=last).contains(&number) => Ok(number as u8),
            Some(0) if what == "motor" => Ok(0),
            Some(number) => {
                let at = self.cur.since(start);
                Err(self
                    .beyond_controller(at, format!("there are {what}s 1 to {last}, not {number}")))
            }
            None => self.cur.expected(&format!("a {what}'s number")),
        }
    }

    /// A text in the curly quotes that word processors and the printed guide have.
    fn curly_quoted(&mut self) -> Option<String> {
        const CURLY: [char; 2] = ['\u{201C}', '\u{201D}'];
        let tail = self.cur.rest().strip_prefix(CURLY)?;
        let opening = self.cur.rest().len() - tail.len();
        let length = tail.find(|c| CURLY.contains(&c) || matches!(c, '"' | '\n'))?;
        let closing = tail.get(length..)?.chars().next().filter(|&c| c != '\n')?;
        self.cur.pos += opening + length + closing.len_utf8();
        Some(tail.get(..length)?.to_owned())
    }

    /// A text in quotes on one line, or `^` and a letter.
    pub(crate) fn quoted(&mut self) -> Parsed<String> {
        if self.cur.peek() == b'^' {
            self.cur.pos += 1;
            let letter = self.cur.byte().to_ascii_uppercase();
            if !(b'@'..=b'_').contains(&letter) {
                return self.cur.expected("a letter after `^`");
            }
            self.cur.pos += 1;
            return Ok(format!("^{}", letter as char));
        }
        let start = self.cur.pos;
        if let Some(text) = self.curly_quoted() {
            return Ok(text);
        }
        if self.cur.byte() != b'"' {
            return self.cur.expected("a text in quotes or `^` and a letter");
        }
        // Only what belongs to the text is searched: a line may hold very many texts.
        let tail = self.cur.rest().get(1..).unwrap_or("");
        let length = tail.find(['"', '\n']);
        let Some(length) = length.filter(|&length| tail.as_bytes().get(length) == Some(&b'"'))
        else {
            self.cur.skip_line();
            let at = self.cur.since(start);
            return syntax_help(at, "this text does not end", "close it with a quote");
        };
        self.cur.pos += length + 2;
        Ok(tail.get(..length).unwrap_or("").to_owned())
    }
}
