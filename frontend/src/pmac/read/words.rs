//! The table of PMAC's words: how each is spelled, how far it may be shortened, what it means, and
//! where it has that meaning (in a PLC, on-line, …).
//!
//! The parsers of statements and of on-line commands, the search for the next statement after an
//! error, and the suggestions for misspelt words all take their words from here.
//!
//! The controller has no tokens: a word may be glued to whatever follows it (`DISPLC5`,
//! `ENDIFENDIF`, `CMD"…"`). So a word is looked for at a place, and takes as many of its letters as
//! come there.

use std::sync::OnceLock;

use plcc_abi::pmac::PlcOp;

use super::cursor::Cursor;

/// A set of the kinds of text in which a word has its meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Contexts(u8);

/// A statement of a PLC begins with the word.
pub(crate) const PLC: Contexts = Contexts(1);
/// An on-line command begins with the word. The text of a COMMAND holds on-line commands.
pub(crate) const ONLINE: Contexts = Contexts(1 << 1);
/// A statement of a motion program begins with the word.
pub(crate) const MOTION: Contexts = Contexts(1 << 2);
/// A single letter that is an on-line command.
pub(crate) const LETTER: Contexts = Contexts(1 << 3);
/// A buffer that DEFINE makes and DELETE erases.
pub(crate) const BUFFER: Contexts = Contexts(1 << 4);
/// A buffer for something else than PLCs, after OPEN.
pub(crate) const OPENED: Contexts = Contexts(1 << 5);
/// The word is suggested for a misspelt one.
const SUGGESTED: Contexts = Contexts(1 << 6);

impl Contexts {
    /// The kinds of text that are in either set.
    pub(crate) const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether a kind of text is in both sets.
    pub(crate) const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// What follows the word of an on-line command that this controller has nothing to do for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Tail {
    /// Nothing.
    Nothing,
    /// `ALL`, or nothing.
    All,
    /// A number, or nothing.
    Number,
    /// A list in parentheses, or nothing.
    List,
    /// Numbers with `,` and `..` between, or nothing.
    Numbers,
    /// Anything up to the line's end.
    Line,
}

/// What a word means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Keyword {
    If,
    While,
    Else,
    EndIf,
    EndWhile,
    And,
    Or,
    Address,
    Command,
    Send,
    Display,
    Open,
    Close,
    Clear,
    /// ENABLE, DISABLE, PAUSE and RESUME, which have `PLC` after them.
    Switch(PlcOp),
    /// A read over the MACRO ring.
    RingRead,
    /// A write, or another command, over the MACRO ring.
    Ring,
    Lock,
    Unlock,
    SetPhase,
    Define,
    Delete,
    Undefine,
    Save,
    Return,
    /// An on-line command for motors, coordinate systems or the card: it is only accepted.
    Accepted(Tail),
    /// A statement of motion programs.
    Move,
    /// The name of a buffer.
    Buffer,
}

/// A word of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Word {
    /// The word in full, in capitals.
    pub(crate) spelling: &'static str,
    /// How many of its first letters are enough.
    min_letters: usize,
    /// How many of its first letters blanks may separate from the rest: 3 for `END IF`, 0 if the
    /// word can't be split.
    split: usize,
    /// What it means.
    pub(crate) keyword: Keyword,
    contexts: Contexts,
}

impl Word {
    /// Whether the word has a meaning in one of `contexts`.
    pub(crate) fn is_in(&self, contexts: Contexts) -> bool {
        self.contexts.intersects(contexts)
    }

    /// Takes the word if it is at `cur`, after blanks.
    fn take(&self, cur: &mut Cursor<'_>, contexts: Contexts) -> bool {
        let (head, rest) = self.spelling.split_at(self.split);
        if self.split > 0 {
            let lines = cur.crosses_lines;
            let found = cur.eat_word(head) && {
                // Both halves are on one line.
                cur.crosses_lines = false;
                cur.eat_abbreviated(rest, self.min_letters - self.split)
            };
            cur.crosses_lines = lines;
            return found;
        }
        cur.eat_abbreviated(rest, self.min_letters) && self.fits_what_follows(*cur, contexts)
    }

    /// Whether the text after the word fits the word's meaning.
    fn fits_what_follows(&self, mut after: Cursor<'_>, contexts: Contexts) -> bool {
        match self.keyword {
            Keyword::Switch(_) => {
                after.blanks();
                after.starts_with("PLC")
            }
            // In MX->Y:$FFC2,8 and MX=1 the MX is not a command of the ring but a name whose #define
            // is missing.
            Keyword::Ring | Keyword::RingRead
                if contexts.intersects(PLC) && !contexts.intersects(ONLINE) =>
            {
                while after.byte().is_ascii_alphabetic() {
                    after.pos += 1;
                }
                after.integer().is_some()
            }
            Keyword::Ring if self.spelling.len() == 2 => {
                !matches!(after.byte(), b'-' | b'=' | b'(' | b'.' | b',')
            }
            _ => true,
        }
    }
}

const fn word(
    spelling: &'static str,
    min_letters: usize,
    keyword: Keyword,
    contexts: Contexts,
) -> Word {
    Word { spelling, min_letters, split: 0, keyword, contexts }
}

/// A word that may be written as two: `END IF`.
const fn splittable(
    spelling: &'static str,
    min_letters: usize,
    keyword: Keyword,
    contexts: Contexts,
) -> Word {
    Word { split: 3, ..word(spelling, min_letters, keyword, contexts) }
}

const fn accepted(spelling: &'static str, min_letters: usize, tail: Tail) -> Word {
    word(spelling, min_letters, Keyword::Accepted(tail), ONLINE)
}

/// An on-line command that motion programs have as a statement too.
const fn accepted_move(spelling: &'static str, min_letters: usize, tail: Tail) -> Word {
    word(spelling, min_letters, Keyword::Accepted(tail), ONLINE.or(MOTION))
}

const fn letter(spelling: &'static str, tail: Tail) -> Word {
    word(spelling, 1, Keyword::Accepted(tail), LETTER)
}

const fn motion(spelling: &'static str, min_letters: usize) -> Word {
    word(spelling, min_letters, Keyword::Move, MOTION)
}

const fn buffer(spelling: &'static str, min_letters: usize) -> Word {
    word(spelling, min_letters, Keyword::Buffer, BUFFER)
}

const fn opened(spelling: &'static str, min_letters: usize) -> Word {
    word(spelling, min_letters, Keyword::Buffer, OPENED)
}

/// Programs of both sorts.
const PROGRAM: Contexts = PLC.or(MOTION);
const PLC_ONLINE: Contexts = PLC.or(ONLINE);

/// Every word. Of two words with the same beginning, the one that needs more letters comes first;
/// of two suggestions that are equally near, the first is made.
const WORDS: &[Word] = &[
    // Buffers, and statements (guide, appendix D), some of them on-line commands too.
    word("OPEN", 4, Keyword::Open, PLC_ONLINE.or(SUGGESTED)),
    // In a buffer these two are written in full: a misspelt one must not empty or end it.
    word("CLOSE", 5, Keyword::Close, PROGRAM.or(ONLINE).or(SUGGESTED)),
    word("CLOSE", 4, Keyword::Close, ONLINE),
    word("CLS", 3, Keyword::Close, PROGRAM.or(ONLINE)),
    word("CLRF", 4, Keyword::Accepted(Tail::Nothing), ONLINE),
    word("CLEAR", 5, Keyword::Clear, PROGRAM.or(ONLINE).or(SUGGESTED)),
    word("CLEAR", 3, Keyword::Clear, ONLINE),
    word("CLR", 3, Keyword::Clear, PROGRAM.or(ONLINE)),
    word("ENABLE", 3, Keyword::Switch(PlcOp::Enable), PROGRAM.or(ONLINE).or(SUGGESTED)),
    word("DISABLE", 3, Keyword::Switch(PlcOp::Disable), PROGRAM.or(ONLINE).or(SUGGESTED)),
    word("PAUSE", 3, Keyword::Switch(PlcOp::Pause), PROGRAM.or(ONLINE).or(SUGGESTED)),
    word("RESUME", 3, Keyword::Switch(PlcOp::Resume), PROGRAM.or(ONLINE).or(SUGGESTED)),
    word("ADDRESS", 4, Keyword::Address, PLC.or(SUGGESTED)),
    word("ADR", 3, Keyword::Address, PLC),
    word("COMMAND", 4, Keyword::Command, PROGRAM.or(SUGGESTED)),
    word("CMD", 3, Keyword::Command, PROGRAM),
    word("SEND", 4, Keyword::Send, PROGRAM.or(SUGGESTED)),
    word("DISPLAY", 4, Keyword::Display, PROGRAM.or(SUGGESTED)),
    // The structure of programs.
    word("IF", 2, Keyword::If, PROGRAM),
    word("WHILE", 3, Keyword::While, PROGRAM.or(SUGGESTED)),
    word("ELSE", 4, Keyword::Else, PROGRAM.or(SUGGESTED)),
    splittable("ENDIF", 4, Keyword::EndIf, PROGRAM.or(SUGGESTED)),
    splittable("ENDWHILE", 4, Keyword::EndWhile, PROGRAM.or(SUGGESTED)),
    word("AND", 3, Keyword::And, PLC),
    word("OR", 2, Keyword::Or, PLC),
    // The MACRO ring and the rest.
    word("MACROSLVREAD", 12, Keyword::RingRead, PLC_ONLINE),
    word("MACROSLAVEREAD", 14, Keyword::RingRead, PLC_ONLINE),
    word("MACROAUXREAD", 12, Keyword::RingRead, PLC_ONLINE),
    word("MSR", 3, Keyword::RingRead, PLC_ONLINE),
    word("MXR", 3, Keyword::RingRead, PLC_ONLINE),
    word("MACRO", 5, Keyword::Ring, PLC_ONLINE),
    word("MS", 2, Keyword::Ring, PLC_ONLINE),
    word("MX", 2, Keyword::Ring, PLC_ONLINE),
    word("LOCK", 4, Keyword::Lock, PLC_ONLINE),
    word("UNLOCK", 3, Keyword::Unlock, PLC_ONLINE),
    word("SETPHASE", 4, Keyword::SetPhase, PLC_ONLINE),
    word("SAVE", 4, Keyword::Save, ONLINE.or(SUGGESTED)),
    // Statements of motion programs. RETURN may end a PLC too.
    word("RETURN", 3, Keyword::Return, MOTION),
    motion("LINEAR", 3),
    motion("RAPID", 5),
    motion("RPD", 3),
    motion("DWELL", 3),
    motion("DELAY", 4),
    motion("DLY", 3),
    motion("CIRCLE", 3),
    motion("SPLINE", 6),
    motion("PVT", 3),
    motion("GOTO", 4),
    motion("GOSUB", 5),
    motion("CALL", 4),
    motion("READ", 4),
    motion("WAIT", 4),
    accepted("STOPINVERSE", 5, Tail::Nothing),
    motion("STOP", 4),
    motion("PSET", 4),
    motion("PRELUDE", 7),
    motion("CC0", 3),
    motion("CC1", 3),
    motion("CC2", 3),
    motion("CC3", 3),
    motion("CCR", 3),
    motion("BLOCKSTOP", 9),
    motion("BLOCKSTART", 7),
    motion("BSTART", 6),
    motion("BSTOP", 5),
    motion("TSELECT", 4),
    motion("TINIT", 5),
    motion("TA", 2),
    motion("TM", 2),
    motion("TS", 2),
    motion("ADIS", 4),
    motion("IDIS", 4),
    motion("AROT", 4),
    motion("IROT", 4),
    motion("DTOGREAD", 8),
    accepted_move("ABS", 3, Tail::List),
    accepted_move("INC", 3, Tail::List),
    accepted_move("FRAX2", 5, Tail::List),
    accepted_move("FRAX", 4, Tail::List),
    accepted_move("HOMEZ", 5, Tail::Numbers),
    accepted_move("HMZ", 3, Tail::Numbers),
    word("HOME", 4, Keyword::Accepted(Tail::Numbers), ONLINE.or(MOTION).or(SUGGESTED)),
    accepted_move("HM", 2, Tail::Numbers),
    // On-line commands (guide, appendix C).
    word("DEFINE", 3, Keyword::Define, PLC_ONLINE.or(SUGGESTED)),
    word("DELETE", 3, Keyword::Delete, PLC_ONLINE.or(SUGGESTED)),
    word("UNDEFINE", 5, Keyword::Undefine, PLC_ONLINE.or(SUGGESTED)),
    accepted("ABR", 3, Tail::Number),
    accepted("CID", 3, Tail::Nothing),
    accepted("CPU", 3, Tail::Nothing),
    accepted("DATE", 3, Tail::Nothing),
    accepted("DKILL", 5, Tail::Nothing),
    accepted("EAVERSION", 3, Tail::Nothing),
    splittable("ENDGATHER", 4, Keyword::Accepted(Tail::Nothing), ONLINE.or(SUGGESTED)),
    splittable("ENDTRACE", 4, Keyword::Accepted(Tail::Nothing), ONLINE),
    word("GATHER", 3, Keyword::Accepted(Tail::Number), ONLINE.or(BUFFER).or(SUGGESTED)),
    accepted("IDC", 3, Tail::Line),
    accepted("IDNUMBER", 3, Tail::Line),
    accepted_move("LEARN", 3, Tail::List),
    accepted_move("LRN", 3, Tail::List),
    word("LIST", 3, Keyword::Accepted(Tail::Line), ONLINE.or(SUGGESTED)),
    accepted("LMOVERLAY", 3, Tail::Line),
    accepted("MACSTA", 6, Tail::Line),
    accepted("MOVETIME", 8, Tail::Nothing),
    accepted("MFLUSH", 3, Tail::Nothing),
    accepted_move("NOFRAX", 3, Tail::Nothing),
    accepted_move("NORMAL", 4, Tail::Line),
    accepted_move("NRM", 3, Tail::Line),
    word("PASSWORD", 4, Keyword::Accepted(Tail::Line), ONLINE.or(SUGGESTED)),
    accepted("PMATCH", 3, Tail::Nothing),
    accepted("PC", 2, Tail::Nothing),
    accepted("PE", 2, Tail::Nothing),
    accepted("PR", 2, Tail::Nothing),
    accepted("SID", 3, Tail::Nothing),
    accepted("SIZE", 3, Tail::Nothing),
    accepted("STN", 3, Tail::Line),
    accepted("TIME", 4, Tail::Line),
    accepted("TODAY", 4, Tail::Line),
    word("TRACE", 4, Keyword::Accepted(Tail::Nothing), ONLINE.or(BUFFER)),
    accepted("TRIGGER", 4, Tail::Nothing),
    accepted("TYPE", 3, Tail::Nothing),
    accepted("UPDATE", 3, Tail::Nothing),
    accepted("VERSION", 3, Tail::Nothing),
    accepted("VID", 3, Tail::Nothing),
    letter("A", Tail::Nothing),
    letter("B", Tail::Number),
    letter("D", Tail::Nothing),
    letter("E", Tail::Nothing),
    letter("F", Tail::Nothing),
    letter("H", Tail::Nothing),
    letter("K", Tail::Nothing),
    letter("O", Tail::Number),
    letter("P", Tail::Nothing),
    letter("Q", Tail::Nothing),
    letter("R", Tail::Nothing),
    letter("S", Tail::Nothing),
    letter("V", Tail::Nothing),
    letter("Z", Tail::Nothing),
    // Buffers after DEFINE, DELETE and OPEN.
    word("ROTARY", 3, Keyword::Buffer, BUFFER.or(OPENED)),
    buffer("TBUF", 2),
    buffer("TCOMP", 2),
    buffer("BLCOMP", 2),
    buffer("COMP", 4),
    buffer("UBUFFER", 2),
    buffer("LOOKAHEAD", 4),
    buffer("CCUBUF", 3),
    buffer("CCBUF", 3),
    buffer("TEMPS", 4),
    buffer("ALL", 3),
    opened("PROGRAM", 3),
    opened("FORWARD", 3),
    opened("INVERSE", 3),
    opened("SERVO", 3),
    opened("BINARY", 3),
    opened("FWD", 3),
    opened("SUBPROG", 3),
];

/// The word that is at `cur`, after blanks, and has a meaning in one of `contexts`; with a
/// cursor after it.
pub(crate) fn find(mut cur: Cursor<'_>, contexts: Contexts) -> Option<(&'static Word, Cursor<'_>)> {
    words_with(cur.peek()).iter().find_map(|word| {
        let mut after = cur;
        (word.is_in(contexts) && word.take(&mut after, contexts)).then_some((*word, after))
    })
}

/// The words that begin with a letter, small or capital, in the order of the table.
fn words_with(letter: u8) -> &'static [&'static Word] {
    static BY_LETTER: OnceLock<[Vec<&Word>; 26]> = OnceLock::new();
    let by_letter = BY_LETTER.get_or_init(|| {
        std::array::from_fn(|index| {
            let begins = |word: &&Word| {
                let first = word.spelling.as_bytes().first();
                first.is_some_and(|first| usize::from(first.wrapping_sub(b'A')) == index)
            };
            WORDS.iter().filter(begins).collect()
        })
    });
    let index = usize::from(letter.to_ascii_uppercase().wrapping_sub(b'A'));
    by_letter.get(index).map_or(&[], Vec::as_slice)
}

/// Takes the letter directly after SEND or COMMAND that names a port, if there is one: the S of
/// `SENDS`, the R of `CMDR`.
pub(crate) fn port(cur: &mut Cursor<'_>) -> Option<char> {
    let letter = cur.byte().to_ascii_uppercase();
    let found = matches!(letter, b'S' | b'P' | b'R' | b'A');
    cur.pos += usize::from(found);
    found.then_some(char::from(letter))
}

/// The words that are suggested for misspelt ones.
pub(crate) fn suggested() -> impl Iterator<Item = &'static str> {
    WORDS.iter().filter(|word| word.is_in(SUGGESTED)).map(|word| word.spelling)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str, contexts: Contexts) -> Option<(&'static str, &str)> {
        let (word, after) = find(Cursor::new(text), contexts)?;
        Some((word.spelling, after.rest()))
    }

    #[test]
    fn words_may_be_shortened_and_written_without_blanks() {
        for (text, word, rest) in [
            ("ENAPLC3", "ENABLE", "PLC3"),
            ("displc5", "DISABLE", "plc5"),
            ("DISP5", "DISPLAY", "5"),
            ("ENDIFENDIF", "ENDIF", "ENDIF"),
            ("END IF", "ENDIF", ""),
            ("ENDWP1=1", "ENDWHILE", "P1=1"),
            (" whil(P1=1)", "WHILE", "(P1=1)"),
            ("CMD\"K\"", "CMD", "\"K\""),
            ("MSR4,910,P1", "MSR", "4,910,P1"),
        ] {
            assert_eq!(found(text, PLC), Some((word, rest)), "{text}");
        }
        for text in ["END\nIF", "ENABLE", "DIS 5", "MX=1", "CLO", "ENDG", "HOME"] {
            assert_eq!(found(text, PLC), None, "{text}");
        }
    }

    #[test]
    fn a_word_has_its_meaning_only_where_it_belongs() {
        assert_eq!(found("STOPINV", ONLINE.or(MOTION)), Some(("STOPINVERSE", "")));
        assert_eq!(found("STOP", ONLINE.or(MOTION)), Some(("STOP", "")));
        assert_eq!(found("DELAY100", PLC.or(MOTION)), Some(("DELAY", "100")));
        assert_eq!(found("DEL GAT", PLC.or(MOTION)), Some(("DELETE", " GAT")));
        assert_eq!(found("GAT", BUFFER), Some(("GATHER", "")));
        assert_eq!(found("GAT", PLC), None);
        assert_eq!(found("K", ONLINE), None);
        assert_eq!(found("K", LETTER), Some(("K", "")));
        assert_eq!(found("MX->Y:$FFC2,8", ONLINE), None);
        assert_eq!(found("MX0,I910=7", ONLINE), Some(("MX", "0,I910=7")));
    }

    #[test]
    fn every_word_of_the_table_is_found_by_its_spelling_and_its_shortest_form() {
        for word in WORDS {
            assert!((1..=word.spelling.len()).contains(&word.min_letters), "{}", word.spelling);
            assert!(word.split < word.min_letters, "{}", word.spelling);
            for written in [word.spelling, &word.spelling[..word.min_letters]] {
                let after = match word.keyword {
                    Keyword::Switch(_) => "PLC1",
                    Keyword::Ring | Keyword::RingRead => "1",
                    _ => "",
                };
                for context in [PLC, ONLINE, MOTION, LETTER, BUFFER, OPENED] {
                    if word.is_in(context) {
                        let text = format!("{written}{after}");
                        let spelling = found(&text, context).map(|(spelling, _)| spelling);
                        assert_eq!(spelling, Some(word.spelling), "{text}");
                    }
                }
            }
        }
    }
}
