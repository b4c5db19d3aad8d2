//! On-line commands from outside of the program, as names that can be set: `#1J+`, `#1J=200`, `&1B10`, `^A` (guide,
//! appendix C). To set such a name to a number other than 0 gives the command.

use alloc::format;
use alloc::string::String;
use core::fmt;

use serde::{Deserialize, Serialize};

use super::command::{Jog, JogGoal, MotionAction};
use super::destination::Destination;

/// How a word's action is made.
enum Make {
    /// The word alone.
    Word(MotionAction),
    /// With the number after it.
    Number(fn(f64) -> MotionAction),
}

/// A row of [`WORDS`]: the sign of whoever takes the word, its spelling, and what it does.
type Row = (char, &'static str, Make);

const fn jog(goal: JogGoal) -> MotionAction {
    MotionAction::Jog(Jog { goal, trigger: None })
}

/// A conversion to an integer keeps within its range.
fn begin(number: f64) -> MotionAction {
    let Destination { program, label } = Destination::of_number(number);
    MotionAction::Begin { program: program as u32, label: label as u32 }
}

/// All words, each with the sign in front of the number of the motor or coordinate system that takes it, or `^`.
static WORDS: [Row; 27] = [
    ('#', "J+", Make::Word(jog(JogGoal::Positive))),
    ('#', "J-", Make::Word(jog(JogGoal::Negative))),
    ('#', "J/", Make::Word(jog(JogGoal::Stop))),
    ('#', "J=", Make::Word(jog(JogGoal::PreJog))),
    ('#', "J=", Make::Number(|position| jog(JogGoal::To(position)))),
    ('#', "J==", Make::Number(|position| jog(JogGoal::ToAndKeep(position)))),
    ('#', "J:", Make::Number(|distance| jog(JogGoal::By(distance)))),
    ('#', "J^", Make::Number(|distance| jog(JogGoal::FromActual(distance)))),
    ('#', "HM", Make::Word(MotionAction::Home)),
    ('#', "HMZ", Make::Word(MotionAction::HomeZero)),
    ('#', "K", Make::Word(MotionAction::Kill)),
    ('#', "O", Make::Number(MotionAction::OpenLoop)),
    ('&', "B", Make::Number(begin)),
    ('&', "R", Make::Word(MotionAction::Run)),
    ('&', "S", Make::Word(MotionAction::Step)),
    ('&', "A", Make::Word(MotionAction::Abort)),
    ('&', "H", Make::Word(MotionAction::Hold)),
    ('&', "Q", Make::Word(MotionAction::Quit)),
    ('&', "/", Make::Word(MotionAction::Halt)),
    ('&', "\\", Make::Word(MotionAction::ProgramHold)),
    ('&', "%", Make::Number(MotionAction::TimeBase)),
    ('^', "A", Make::Word(MotionAction::AbortAll)),
    ('^', "K", Make::Word(MotionAction::KillAll)),
    ('^', "O", Make::Word(MotionAction::HoldAll)),
    ('^', "Q", Make::Word(MotionAction::QuitAll)),
    ('^', "R", Make::Word(MotionAction::RunAll)),
    ('^', "S", Make::Word(MotionAction::StepAll)),
];

/// A command with the motor or coordinate system that takes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Online {
    /// The number of the motor or coordinate system, from 1; 0 of a command for all.
    pub number: u8,
    /// The index of the word in [`WORDS`].
    word: u8,
    /// The bits of the number after the word; those of 0 where none follows.
    operand: u64,
}

/// A number after a word: of signs, digits, a point and an exponent.
fn operand(text: &str) -> Option<f64> {
    let is_plain =
        text.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'E'));
    text.parse::<f64>().ok().filter(|number| is_plain && number.is_finite())
}

/// The number after the word that gives an action; 0 where there is none.
fn operand_of(action: &MotionAction) -> f64 {
    use JogGoal::{By, FromActual, To, ToAndKeep};
    match *action {
        MotionAction::Jog(Jog {
            goal: To(number) | ToAndKeep(number) | By(number) | FromActual(number),
            ..
        }) => number,
        MotionAction::OpenLoop(percent) | MotionAction::TimeBase(percent) => percent,
        MotionAction::Begin { program, label } => Destination::number(program, label),
        _ => 0.0,
    }
}

impl Make {
    fn action(&self, operand: f64) -> MotionAction {
        match self {
            Self::Word(action) => action.clone(),
            Self::Number(make) => make(operand),
        }
    }
}

impl Online {
    fn new(number: u8, word: usize, operand: f64) -> Self {
        // 0 and -0 are the same command; there are fewer words than 256.
        Self { number, word: word as u8, operand: (operand + 0.0).to_bits() }
    }

    fn row(self) -> Option<&'static Row> {
        WORDS.get(usize::from(self.word))
    }

    /// Reads a command in a text of capitals without blanks: its sign, its motor or coordinate system, which may be beyond the
    /// controller's last, and the command.
    pub(crate) fn parse(text: &str) -> Option<(char, u32, Self)> {
        let sign = text.chars().next()?;
        let rest = text.get(1..)?;
        let (number, rest) = match sign {
            '^' => (0, rest),
            _ => {
                let end = rest.find(|c: char| !c.is_ascii_digit())?;
                let (digits, rest) = rest.split_at_checked(end)?;
                (digits.parse().ok()?, rest)
            }
        };
        let of_sign = WORDS.iter().enumerate().filter(|(_, row)| row.0 == sign);
        let command = of_sign.into_iter().find_map(|(word, (_, spelling, make))| {
            let behind = rest.strip_prefix(spelling)?;
            let value = match make {
                Make::Word(_) => behind.is_empty().then_some(0.0)?,
                Make::Number(_) => operand(behind)?,
            };
            Some(Self::new(u8::try_from(number).unwrap_or(0), word, value))
        })?;
        Some((sign, number, command))
    }

    /// The command that does something to a motor or coordinate system; `None` for what can't be given from outside.
    pub fn of(action: &MotionAction, motor: u8, system: u8) -> Option<Self> {
        let operand = operand_of(action);
        let word = WORDS.iter().position(|(_, _, make)| make.action(operand) == *action)?;
        let number = match WORDS.get(word)?.0 {
            '#' => motor,
            '&' => system,
            _ => 0,
        };
        Some(Self::new(number, word, operand))
    }

    /// What it does.
    pub fn action(self) -> MotionAction {
        let action = self.row().map(|(_, _, make)| make.action(f64::from_bits(self.operand)));
        action.unwrap_or(MotionAction::Nothing)
    }

    /// The command without the number of its motor or coordinate system, as events have it: `J=200`, `^A`.
    pub fn text(self) -> String {
        let Some((sign, spelling, make)) = self.row() else { return String::new() };
        let sign = if *sign == '^' { "^" } else { "" };
        match make {
            Make::Number(_) => {
                format!("{sign}{spelling}{}", crate::number(f64::from_bits(self.operand)))
            }
            Make::Word(_) => format!("{sign}{spelling}"),
        }
    }
}

impl fmt::Display for Online {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.row().map(|row| row.0) {
            Some(sign @ ('#' | '&')) => write!(f, "{sign}{}{}", self.number, self.text()),
            _ => f.write_str(&self.text()),
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::*;

    #[test]
    fn every_command_reads_back_and_does_what_it_says() {
        for (word, (sign, _, make)) in WORDS.iter().enumerate() {
            let operand = if matches!(make, Make::Number(_)) { 12.5 } else { 0.0 };
            let number = if *sign == '^' { 0 } else { 3 };
            let command = Online::new(number, word, operand);
            let read = Online::parse(&command.to_string());
            assert_eq!(read, Some((*sign, u32::from(number), command)), "{command}");
            assert_eq!(Online::of(&command.action(), 3, 3), Some(command), "{command}");
        }
        let (_, number, far) = Online::parse("#300J+").unwrap();
        assert_eq!((number, far.number), (300, 0));
    }

    #[test]
    fn numbers_are_those_of_the_command() {
        let action = |text: &str| Online::parse(text).unwrap().2.action();
        assert_eq!(action("&1B10.25"), MotionAction::Begin { program: 10, label: 25_000 });
        assert_eq!(
            action("#2J:-5"),
            MotionAction::Jog(Jog { goal: JogGoal::By(-5.0), trigger: None })
        );
        assert_eq!(Online::parse("#1J=-0"), Online::parse("#1J=0"));
        for text in [
            "#1", "#J+", "#1J", "#1J+5", "#1J:", "&1Q5", "&1J+", "^B", "1J+", "#1J=NAN", "#1J=1X",
            "", "#1HMX",
        ] {
            assert_eq!(Online::parse(text), None, "{text}");
        }
    }
}
