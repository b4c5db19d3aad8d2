//! Whether conditions hold in every scan of a program, for all inputs.
//!
//! A tick of a control, with its program, is written as an and-inverter graph ([`control`], [`scan`]) over the bits that the
//! control keeps from tick to tick and those that come from outside ([`system`]). A solver looks for a run that comes to a tick
//! which must not be, or for a proof that there is none ([`solve`]). A run is shown only after the interpreter has run it.
//!
//! ```
//! use std::collections::BTreeSet;
//! use plcc_abi::Dialect;
//! use plcc_diag::SourceMap;
//! use plcc_frontend::common::{MemoryLoader, Options};
//! use plcc_frontend::language;
//! use plcc_prove::control::{Settings, Source};
//! use plcc_prove::solve::{Deadline, Found, search};
//! use plcc_prove::system::Time;
//!
//! let mut sources = SourceMap::new();
//! let text = b"$INPUT\nA = 0/0\n$OUTPUT\nX = 1/0\nY = 1/1\n$END\nX = A\nY = /A\n";
//! let file = sources.add("valves.pmi", text);
//! let pmi = language(Dialect::Pmi);
//! let (checked, _) = pmi.check(&mut sources, &[file], &MemoryLoader::new(), &Options::default());
//! let lowered = checked.ok_or("it has errors")?.lower().map_err(|error| error.to_string())?;
//! let settings = Settings {
//!     period_ns: 20_000_000,
//!     level2_ms: 1,
//!     boards: 4,
//!     level0_safepoints: 10_000,
//!     background_steps: 1,
//!     as_declared: false,
//! };
//! let image = vec![0; lowered.program.image_size as usize];
//! let source =
//!     Source { program: &lowered.program, module: &lowered.module, returns: None, image: &image, settings };
//! let mut system = source.system(Time::Exact, &BTreeSet::new())?;
//! let place = |name: &str| {
//!     let names = plcc_runtime::names_of(&lowered.program);
//!     let key = names.find(name, plcc_runtime::Purpose::Watch).map_err(|error| error.to_string())?;
//!     names.properties(key).value.map(|it| it.offset as usize).ok_or("it has no place".to_string())
//! };
//! let (x, y) = (system.memory.bit(place("X")?, 0), system.memory.bit(place("Y")?, 0));
//! let both = system.graph().and(x, y);
//! assert!(matches!(search(&system, both, 10, true, Deadline::default()), Found::Never(_)));
//! # Ok::<(), String>(())
//! ```

pub mod aiger;
mod claim;
mod condition;
pub mod contrary;
pub mod control;
mod inquiry;
pub mod logic;
pub mod product;
pub mod question;
pub mod scan;
pub mod solve;
pub mod stimulus;
pub mod system;
pub mod validate;

pub use inquiry::Inquiry;
pub use question::{Answer, Question, Subject};
pub use scan::Reason;
pub use stimulus::Station;
