//! Buffers that are not read: those of motion programs, and those whose OPEN is refused.

use plcc_diag::Diagnostic;

use super::cursor::Cursor;
use super::download::DownloadReader;
use super::words::{self, Keyword, ONLINE, OPENED};
use crate::pmac::origin::TextRange;

/// Where a buffer that is skipped ends.
enum End {
    /// At a CLOSE: the offset after it.
    Close(usize),
    /// At the OPEN of another buffer: the offset of that OPEN.
    Open(usize),
    /// At the end of the text.
    Text,
}

impl DownloadReader<'_> {
    /// Skips the buffer of a motion program, which was opened at `at`, with one note.
    pub(crate) fn skip_motion(&mut self, at: TextRange) {
        let text = self.reader.cur.text_at(at).to_ascii_uppercase();
        let kinematics = ["FOR", "INV", "FWD"].iter().any(|word| text.contains(word));
        let refused = self.simulates && !kinematics;
        self.tell(at, |span| match refused {
            true => Diagnostic::error("PMAC-X9", span, "this buffer is not simulated")
                .help("leave it out, or run without --simulate"),
            false => Diagnostic::standalone_note("PMAC-N1", span, "this buffer is skipped")
                .note("PLCs and motion programs are compiled, and no other buffers"),
        });
        match end_of_buffer(self.reader.cur) {
            End::Close(after) => self.reader.cur.pos = after,
            End::Open(open) => {
                self.reader.cur.pos = open;
                let at = self.reader.cur.next_word();
                self.report_still_open(at);
            }
            End::Text => {
                self.reader.cur.pos = self.preprocessed.text.len();
                self.warn_unclosed();
            }
        }
    }

    /// Skips the buffer whose OPEN was refused, without further errors.
    pub(crate) fn skip_refused(&mut self) {
        self.reader.cur.pos = match end_of_buffer(self.reader.cur) {
            End::Close(after) => after,
            End::Open(open) => open,
            End::Text => self.preprocessed.text.len(),
        };
    }
}

/// Where the buffer that is open at `cur` ends: at a CLOSE or OPEN that is a word of its own
/// outside of quotes. An OPEN only counts with the name of a buffer after it.
fn end_of_buffer(cur: Cursor<'_>) -> End {
    let mut quoted = false;
    let mut before = b'\n';
    for (offset, byte) in cur.rest().bytes().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'\n' => quoted = false,
            b'C' | b'c' | b'O' | b'o' if !quoted && before != b'_' => {
                let mut at = cur;
                at.pos += offset;
                match words::find(at, ONLINE) {
                    Some((word, after)) if word.keyword == Keyword::Close => {
                        let next = after.byte();
                        if !next.is_ascii_alphanumeric() && next != b'_' {
                            return End::Close(after.pos);
                        }
                    }
                    Some((word, after)) if word.keyword == Keyword::Open && names_buffer(after) => {
                        return End::Open(at.pos);
                    }
                    _ => {}
                }
            }
            _ => {}
        }
        before = byte;
    }
    End::Text
}

/// Whether the name of a buffer that OPEN can open is at `cur`.
pub(super) fn names_buffer(mut cur: Cursor<'_>) -> bool {
    cur.eat_word("PLC") || words::find(cur, OPENED).is_some()
}
