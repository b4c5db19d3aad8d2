//! What is done to make a program fast: passes over its IR, and techniques of code generation.

use plcc_ir::Module;
use plcc_ir::passes::{OptLevel, Pass, PassOptions, PassSet, PassTimes, optimize, thresholds};

/// The techniques of code generation that can be left out, and what else it must know of a module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CodegenOptions {
    /// `wide-bits`: truth values are computed in 32 bits.
    pub wide_bits: bool,
    /// `vectors`: rows of statements that do the same with neighbouring variables are computed at once.
    pub vectors: bool,
    /// `double-constants`: doubles that are used often are kept in registers.
    pub double_constants: bool,
    /// Whether the module is a [part](Module::split_off_rare) of a program. Then labels may be in no function of it.
    pub is_part: bool,
}

impl CodegenOptions {
    /// No technique.
    pub const NONE: Self =
        Self { wide_bits: false, vectors: false, double_constants: false, is_part: false };
    /// Every technique.
    pub const ALL: Self =
        Self { wide_bits: true, vectors: true, double_constants: true, is_part: false };

    /// The same for a part of a program.
    #[must_use]
    pub fn of_part(self) -> Self {
        Self { is_part: true, ..self }
    }
}

/// How a program is optimised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Optimization {
    /// What is done in IR.
    pub passes: PassOptions,
    /// The techniques that code generation may use.
    pub codegen: CodegenOptions,
}

/// A switch that is not a pass, in an optimisation.
type Switch = fn(&mut Optimization) -> &mut bool;

/// Something that [`Optimization::with_changes`] can leave out or put in.
#[derive(Clone, Copy)]
enum Part {
    Pass(Pass),
    /// A switch that is not a pass.
    Switch(Switch),
}

/// The switches that are not passes, by their names.
const SWITCHES: [(&str, Switch); 5] = [
    ("wide-bits", |it| &mut it.codegen.wide_bits),
    ("vectors", |it| &mut it.codegen.vectors),
    ("double-constants", |it| &mut it.codegen.double_constants),
    ("reload-bits", |it| &mut it.passes.reload_bits),
    ("by-length", |it| &mut it.passes.by_length),
];

impl Optimization {
    /// Nothing: code is made of the IR as the front end wrote it.
    pub const NONE: Self = Self {
        passes: PassOptions { passes: PassSet::NONE, reload_bits: false, by_length: false },
        codegen: CodegenOptions::NONE,
    };
    /// Everything, each where it pays.
    pub const ALL: Self = Self {
        passes: PassOptions { passes: PassSet::ALL, reload_bits: true, by_length: true },
        codegen: CodegenOptions::ALL,
    };

    /// Runs the passes over a verified module. Returns how code generation has to treat the result, and how long each
    /// pass took. If what pays is chosen by length, and the module is short, `wide-bits` is left out
    /// ([`thresholds::WIDE_BITS_FROM`]).
    pub fn run(self, module: &mut Module) -> (CodegenOptions, PassTimes) {
        let times = optimize(module, self.passes);
        let is_short = module.usual_instructions() < thresholds::WIDE_BITS_FROM;
        let wide_bits = self.codegen.wide_bits && !(self.passes.by_length && is_short);
        (CodegenOptions { wide_bits, ..self.codegen }, times)
    }

    /// The same without one pass.
    #[must_use]
    pub fn without(mut self, pass: Pass) -> Self {
        self.passes.passes = self.passes.passes.without(pass);
        self
    }

    /// The same after the changes that a text asks for: names of passes and techniques with commas between, each
    /// after a `-` (leave it out) or a `+` (put it in).
    ///
    /// # Errors
    /// When a part of the text is neither; the message has the first such part and all names.
    pub fn with_changes(mut self, text: &str) -> Result<Self, String> {
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let change = part.split_at_checked(1).and_then(|(sign, name)| {
                let is_in = match sign {
                    "-" => false,
                    "+" => true,
                    _ => return None,
                };
                Some((Part::from_name(name)?, is_in))
            });
            let Some((part, is_in)) = change else {
                let names: Vec<_> = Self::names().collect();
                return Err(format!(
                    "`{part}` is not `-` or `+` and a pass; the passes are {}",
                    names.join(", ")
                ));
            };
            match part {
                Part::Pass(pass) if is_in => self.passes.passes = self.passes.passes.with(pass),
                Part::Pass(pass) => self = self.without(pass),
                Part::Switch(switch) => *switch(&mut self) = is_in,
            }
        }
        Ok(self)
    }

    /// The names of all passes and techniques, in their order.
    pub fn names() -> impl Iterator<Item = &'static str> {
        let passes = Pass::ALL.iter().map(|pass| pass.name());
        passes.chain(SWITCHES.map(|(name, _)| name))
    }

    /// A selection that depends on `chance` alone: it says of each pass and technique whether it is in.
    pub fn some(mut chance: impl FnMut() -> bool) -> Self {
        let mut some = Self::NONE;
        for &pass in Pass::ALL {
            if chance() {
                some.passes.passes = some.passes.passes.with(pass);
            }
        }
        for (_, switch) in SWITCHES {
            *switch(&mut some) = chance();
        }
        some
    }
}

impl Part {
    fn from_name(name: &str) -> Option<Self> {
        let switch = || SWITCHES.iter().find(|(own, _)| *own == name).map(|&(_, it)| it);
        Pass::from_name(name).map(Self::Pass).or_else(|| switch().map(Self::Switch))
    }
}

impl From<OptLevel> for Optimization {
    fn from(level: OptLevel) -> Self {
        match level {
            OptLevel::None => Self::NONE,
            OptLevel::Speed => Self::ALL,
        }
    }
}
