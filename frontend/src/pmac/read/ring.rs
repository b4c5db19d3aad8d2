//! Statements for the MACRO ring, the bus between controllers and drives: reads and writes of
//! another station's variables.

use plcc_abi::pmac::Text;

use super::cursor::{Parsed, syntax};
use super::download::DownloadReader;
use crate::pmac::ast::StmtKind;

impl DownloadReader<'_> {
    /// MACROSLVREAD, MACROSLVWRITE, MACROAUXREAD or MACROAUXWRITE: the node, the station's
    /// variable, the program's variable, such as `MSR4,MI910,P1`. A `read` sets the program's
    /// variable to 0, since no station answers. A write is an event.
    pub(crate) fn macro_ring(&mut self, read: bool, start: usize) -> Parsed<()> {
        let rest = self.reader.cur.rest();
        let line = rest.find('\n').map_or(rest, |end| rest.get(..end).unwrap_or("")).trim_end();
        let letters = line.bytes().take_while(u8::is_ascii_alphabetic).count();
        if self.in_plc0() {
            return syntax(self.reader.cur.next_word(), "the MACRO ring is for PLCs 1 to 31");
        }
        let known = self.reader.cur;
        if !self.macro_ring_operands(letters) {
            // The statement has another form. The program's variable is after the last comma.
            self.reader.cur = known;
            self.reader.cur.pos += line.len();
            if !read {
                self.text(Text::Macro { text: line.to_owned() }, None, start);
                return Ok(());
            }
            let tail = line.rfind(',').map_or(0, |comma| comma + 1);
            self.reader.cur.pos = known.pos + tail;
        }
        if read {
            let target = self.plain_variable()?;
            let expr = self.reader.constant(0.0);
            self.push(StmtKind::Assign(target, expr), start);
            return Ok(());
        }
        let expr = self.variable_value()?;
        let at = self.reader.cur.since(start);
        let text = self.reader.cur.text_at(at).to_owned();
        self.text(Text::Macro { text }, Some(expr), start);
        Ok(())
    }

    /// Takes the statement's word, which has `word` letters, the node, and the station's variable
    /// or parameter; false if no variable of the program follows.
    fn macro_ring_operands(&mut self, word: usize) -> bool {
        let cur = &mut self.reader.cur;
        cur.pos += word;
        if cur.integer().is_none() {
            return false;
        }
        let _ = cur.eat(b',');
        cur.blanks();
        while cur.byte().is_ascii_alphabetic() {
            cur.pos += 1;
        }
        if cur.integer().is_none() {
            return false;
        }
        let _ = cur.eat(b',');
        cur.blanks();
        self.reader.variable_kind().is_some()
    }
}
