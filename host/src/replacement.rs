//! A prepared online change, as the thread that runs the ticks carries it out.

use plcc_abi::Engine;

use crate::image_file::Publisher;
use crate::run::Player;
use plcc_control::Watch;
use plcc_record::RecorderProgram;
use plcc_record::ReplaceableExecutive;
use plcc_runtime::online_change::Plan;
use plcc_runtime::{Executive, VariableKey};

/// A program that is to take the place of the one that runs. When that is done, this holds the former program,
/// for a rollback.
pub(crate) struct Replacement {
    pub(crate) executive: Box<dyn Executive + Send>,
    /// The engine of its program; `None` for the engine with which the run began.
    pub(crate) engine: Option<Box<dyn Engine + Send>>,
    pub(crate) plan: Plan,
    /// The keys of the stimulus's variables in its program, and those of the trace's.
    pub(crate) set: Vec<VariableKey>,
    pub(crate) watched: Vec<VariableKey>,
    /// What a recorder keeps for its program.
    pub(crate) recorder_program: RecorderProgram,
    /// Its image file.
    pub(crate) publisher: Option<Publisher>,
    /// Why the replacement could not be carried out, if so; nothing has changed then.
    pub(crate) failure: Option<&'static str>,
}

impl std::fmt::Debug for Replacement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Replacement").field("plan", &self.plan).finish_non_exhaustive()
    }
}

impl Replacement {
    /// Exchanges this program with the one that `running` runs, whose state, image file, stimulus and trace it takes
    /// over.
    pub(crate) fn carry_out(
        &mut self,
        running: &mut ReplaceableExecutive,
        publisher: &mut Option<Publisher>,
        player: &mut Player,
        watch: &mut Watch,
    ) {
        let Self { executive, engine, recorder_program, .. } = self;
        if !running.change_program(executive, engine, recorder_program, &self.plan) {
            return self.fail(
                "the programs are for different controls, or a motion program runs that the new one changes",
            );
        }
        std::mem::swap(publisher, &mut self.publisher);
        player.exchange_keys(&mut self.set);
        watch.exchange_keys(&mut self.watched);
    }

    /// Notes why it could not be carried out.
    pub(crate) fn fail(&mut self, why: &'static str) {
        self.failure = Some(why);
    }
}
