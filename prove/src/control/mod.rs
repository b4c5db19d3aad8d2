//! What the executives do in a tick, written once more as logic.

mod nct;
mod pmac;
mod pmi;
mod writes;

use std::collections::BTreeSet;

use plcc_abi::{Program, Tables};
use plcc_frontend::common::ReturnStack;
use plcc_ir::Module;

use crate::scan::Code;
use crate::system::{System, Time};

pub(crate) use pmac::Pmac;

/// How many background steps of a PMAC are followed in a tick.
const MOST_STEPS: u32 = 32;

/// What a system is made of.
#[derive(Clone, Copy, Debug)]
pub struct Source<'p> {
    /// The program.
    pub program: &'p Program,
    /// Its code as the front end makes it.
    pub module: &'p Module,
    /// Where its subroutines find out where to return to.
    pub returns: Option<ReturnStack>,
    /// The process image at power-up.
    pub image: &'p [u8],
    /// The settings of the control.
    pub settings: Settings,
}

/// The settings of a control that decide what it does in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// PMI: the time between two scans in nanoseconds.
    pub period_ns: u64,
    /// NCT: how often `:002` runs, in milliseconds.
    pub level2_ms: u64,
    /// NCT: how many interface boards the machine has.
    pub boards: u8,
    /// NCT: the safepoints after which `:000` is suspended.
    pub level0_safepoints: u32,
    /// PMAC: background steps in each servo cycle.
    pub background_steps: u32,
    /// Whether what survives power-off is as after a first start, rather than anything.
    pub as_declared: bool,
}

impl Source<'_> {
    /// The control with its program. Variables `named` come from outside also where the program does not name them.
    ///
    /// # Errors
    /// When a control with these settings can't be taken.
    pub fn system(&self, time: Time, named: &BTreeSet<String>) -> Result<System, String> {
        let code = Code::new(self.module, self.returns);
        match &self.program.tables {
            Tables::Pmi(tables) => Ok(pmi::system(self, tables, &code, time, named)),
            Tables::Nct(tables) => Ok(nct::system(self, tables, &code)),
            Tables::Pmac(_) if self.settings.background_steps > MOST_STEPS => {
                Err(format!("more than {MOST_STEPS} background steps in a tick are not followed"))
            }
            Tables::Pmac(tables) => Ok(pmac::system(self, tables, &code, named)),
        }
    }
}
