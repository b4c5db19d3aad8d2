//! Prints kernels in the controls' languages.

mod nct;
mod pmac;
mod pmi;

use super::{Kernel, Language, Stmt};

/// The first byte of F that holds a kernel's bits in NCT; those before have a meaning for the
/// control.
pub(super) const NCT_FIRST_FLAG: usize = 100;
/// The byte of F of the first word in NCT.
pub(super) const NCT_FIRST_WORD: usize = 500;
/// The address in Y of the first word of bits of a PMAC.
pub(super) const PMAC_BITS: u32 = 0x07C0;
/// How many bits a word of a PMAC has.
pub(super) const PMAC_WORD_BITS: usize = 24;
/// The address in X of the first word that is an L-variable.
pub(super) const PMAC_WORDS: u32 = 0x0900;
/// The number of the P-variable that is the first word.
pub(super) const PMAC_FIRST_P: usize = 900;
/// The number of the P-variable that is the first element.
pub(super) const PMAC_FIRST_ELEMENT: usize = 800;
/// The number of the P-variable that is the first double.
pub(super) const PMAC_FIRST_REAL: usize = 700;

/// The text of a kernel in its language.
pub(super) fn print(kernel: &Kernel) -> String {
    let mut out = Printer { kernel, out: String::new() };
    match kernel.language {
        Language::Pmi => out.pmi(),
        Language::Nct => out.nct(),
        Language::PmacMixed | Language::Pmac | Language::Plcc => out.pmac(),
    }
    out.out
}

/// The text of a kernel so far.
struct Printer<'a> {
    kernel: &'a Kernel,
    out: String,
}

impl Printer<'_> {
    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn pmi(&mut self) {
        let kernel = self.kernel;
        self.line("$INPUT");
        for bit in 0..kernel.inputs {
            self.line(&format!("I{bit} = {}/{}", bit / 8, bit % 8));
        }
        self.line("$INTEGER");
        for word in 0..kernel.words {
            self.line(&format!("W{word}"));
        }
        if kernel.elements > 0 {
            self.line(&format!("A[{}]", kernel.elements));
        }
        self.line("$END");
        self.stmts(&kernel.stmts);
    }

    fn nct(&mut self) {
        self.line(":001");
        self.stmts(&self.kernel.stmts);
        self.line("J1\n:000J0");
    }

    fn pmac(&mut self) {
        let kernel = self.kernel;
        let (letter, open) = match kernel.language {
            Language::Plcc => ('L', "OPEN PLCC 1 CLEAR"),
            _ => ('M', "OPEN PLC 1 CLEAR"),
        };
        self.line("I5=3");
        for bit in 0..kernel.bits {
            if self.bit(bit).starts_with(letter) {
                let (word, bit_of_word) = (bit / PMAC_WORD_BITS, bit % PMAC_WORD_BITS);
                let address = PMAC_BITS + word as u32;
                self.line(&format!("{letter}{bit}->Y:${address:X},{bit_of_word},1"));
            }
        }
        if kernel.language == Language::Plcc {
            for word in 0..kernel.words {
                let address = PMAC_WORDS + word as u32;
                let name = self.word(word);
                self.line(&format!("{name}->X:${address:X},0,24,S"));
            }
        }
        self.line(open);
        self.stmts(&kernel.stmts);
        self.line("CLOSE");
    }

    /// The name of a bit.
    fn bit(&self, bit: usize) -> String {
        let relay = bit.checked_sub(self.kernel.inputs);
        match (self.kernel.language, relay) {
            (Language::Pmi, None) => format!("I{bit}"),
            (Language::Pmi, Some(relay)) => format!("R{relay}"),
            (Language::Nct, None) => format!("I{:02}{}", bit / 8, bit % 8),
            (Language::Nct, Some(relay)) => {
                format!("F{:03}{}", NCT_FIRST_FLAG + relay / 8, relay % 8)
            }
            (Language::PmacMixed, Some(relay)) if relay % 2 == 1 => format!("P{}", relay / 2),
            (Language::Plcc, _) => format!("L{bit}"),
            (Language::PmacMixed | Language::Pmac, _) => format!("M{bit}"),
        }
    }

    /// The name of a word.
    fn word(&self, word: usize) -> String {
        match self.kernel.language {
            Language::Pmi => format!("W{word}"),
            Language::Nct => format!("F{:03}", NCT_FIRST_WORD + 2 * word),
            Language::Plcc => format!("L{}", self.kernel.bits + word),
            Language::PmacMixed | Language::Pmac => format!("P{}", PMAC_FIRST_P + word),
        }
    }

    fn stmts(&mut self, stmts: &[Stmt]) {
        match self.kernel.language {
            Language::Pmi => stmts.iter().for_each(|stmt| self.pmi_stmt(stmt)),
            Language::Nct => self.nct_stmts(stmts),
            _ => stmts.iter().for_each(|stmt| self.pmac_stmt(stmt)),
        }
    }
}
