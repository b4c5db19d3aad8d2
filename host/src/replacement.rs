//! A prepared online change, as the thread that runs the ticks carries it out.

use plcc_abi::Engine;

use crate::image_file::Publisher;
use crate::run::Player;
use plcc_control::Watch;
use plcc_record::RecorderProgram;
use plcc_record::ReplaceableExecutive;
use plcc_runtime::online_change::{Plan, TakeOver};
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
    /// How far it has come.
    pub(crate) progress: Progress,
}

/// How far a replacement has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// It is to be carried out.
    Prepared,
    /// It can't be carried out yet, and this is why, as the beginning of a sentence. Nothing has changed.
    Waits(&'static str),
    /// It is carried out.
    Done,
    /// It can't be carried out, and this is why. Nothing has changed.
    Failed(&'static str),
}

impl std::fmt::Debug for Replacement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Replacement").field("plan", &self.plan).finish_non_exhaustive()
    }
}

impl Replacement {
    /// Exchanges this program with the one that `running` runs, whose state, image file, stimulus and trace it takes
    /// over, if that can be done now.
    pub(crate) fn carry_out(
        &mut self,
        running: &mut ReplaceableExecutive,
        publisher: &mut Option<Publisher>,
        player: &mut Player,
        watch: &mut Watch,
    ) {
        let Self { executive, engine, recorder_program, .. } = self;
        self.progress =
            match running.change_program(executive, engine, recorder_program, &self.plan) {
                TakeOver::Done => Progress::Done,
                TakeOver::Later(why) => Progress::Waits(why),
                TakeOver::Impossible => Progress::Failed("the programs are for different controls"),
            };
        if self.progress != Progress::Done {
            return;
        }
        std::mem::swap(publisher, &mut self.publisher);
        player.exchange_keys(&mut self.set);
        watch.exchange_keys(&mut self.watched);
    }
}
