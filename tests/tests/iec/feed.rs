//! Random inputs. Their numbers come from a linear congruential generator, which a program in Structured Text can compute as well as
//! this one.

use std::fmt::Write as _;

use plcc_iec::Type;

/// An input that is given at random.
#[derive(Clone, Debug)]
pub(crate) struct Given {
    /// The variable of the exported program.
    pub(crate) name: String,
    pub(crate) ty: Type,
    /// Whether it is given 0 and 1 alone.
    pub(crate) is_bit: bool,
}

/// The generator.
pub(crate) struct Feed(u64);

/// What the state is reduced by.
const MODULUS: u64 = 1 << 32;

impl Feed {
    pub(crate) fn new(seed: u64) -> Self {
        Self(first(seed))
    }

    /// 16 bits.
    fn draw(&mut self) -> i64 {
        self.0 = (self.0 * 69_069 + 1) % MODULUS;
        (self.0 / 65_536) as i64
    }

    /// The new value of an input: a few change in each scan, mostly to a small number, sometimes to any of the type.
    pub(crate) fn value(&mut self, given: &Given) -> Option<i64> {
        if self.draw() % 100 >= 15 {
            return None;
        }
        let is_small = self.draw() % 100 < 60;
        let high = self.draw();
        let low = self.draw();
        Some(match given.ty {
            _ if given.is_bit => low % 2,
            Type::Bool => low % 2,
            Type::Usint => low % 256,
            _ if is_small => low % 12,
            Type::Uint => low,
            Type::Int | Type::Lreal => low - 32_768,
            Type::Dint | Type::Lint => high * 65_536 + low - (1 << 31),
        })
    }
}

/// The state of the generator before the first number.
fn first(seed: u64) -> u64 {
    (seed + 1) * 2_654_435_761 % MODULUS
}

/// The functions that the statements of [`statements`] call.
pub(crate) const FUNCTIONS: &str = "\
FUNCTION FEED_NEXT : LINT
  VAR_INPUT
    STATE : LINT;
  END_VAR
  FEED_NEXT := (STATE * LINT#69069 + LINT#1) MOD LINT#4294967296;
END_FUNCTION

";

/// The variables of these statements.
pub(crate) fn declarations(seed: u64) -> String {
    format!(
        "  VAR\n    FEED_STATE : LINT := {};\n    FEED_SMALL : BOOL;\n    FEED_HIGH : LINT;\n    FEED_LOW : LINT;\n  END_VAR\n",
        first(seed)
    )
}

/// Gives the inputs what [`Feed`] gives.
pub(crate) fn statements(inputs: &[Given]) -> String {
    const NEXT: &str = "FEED_STATE := FEED_NEXT(FEED_STATE);";
    let mut out = String::new();
    for Given { name, ty, is_bit } in inputs {
        let value = match ty {
            Type::Bool => format!("{name} := FEED_LOW MOD LINT#2 = LINT#1;"),
            Type::Lreal => format!("{name} := LINT_TO_LREAL(FEED_LOW);"),
            Type::Lint => format!("{name} := FEED_LOW;"),
            ty => format!("{name} := LINT_TO_{}(FEED_LOW);", ty.name()),
        };
        let any = match ty {
            _ if *is_bit => "FEED_LOW := FEED_LOW MOD LINT#2;",
            Type::Usint => "FEED_LOW := FEED_LOW MOD LINT#256;",
            Type::Bool => "",
            _ => {
                let rest = match ty {
                    Type::Int | Type::Lreal => "FEED_LOW := FEED_LOW - LINT#32768;",
                    Type::Dint | Type::Lint => {
                        "FEED_LOW := FEED_HIGH * LINT#65536 + FEED_LOW - LINT#2147483648;"
                    }
                    _ => "FEED_LOW := FEED_LOW + LINT#0;",
                };
                &format!(
                    "IF FEED_SMALL THEN\n      FEED_LOW := FEED_LOW MOD LINT#12;\n    ELSE\n      {rest}\n    END_IF;"
                )
            }
        };
        let _ = writeln!(
            out,
            "  {NEXT}\n  IF (FEED_STATE / LINT#65536) MOD LINT#100 < LINT#15 THEN\n    {NEXT}\n    \
             FEED_SMALL := (FEED_STATE / LINT#65536) MOD LINT#100 < LINT#60;\n    {NEXT}\n    \
             FEED_HIGH := FEED_STATE / LINT#65536;\n    {NEXT}\n    FEED_LOW := FEED_STATE / LINT#65536;\n    \
             {any}\n    {value}\n  END_IF;"
        );
    }
    out
}
