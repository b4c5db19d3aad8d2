//! On-line commands from outside of the program, as names that can be set: `#1J+`, `#1J=200`, `&1B10`, `^A` (guide,
//! appendix C). To set such a name to a number other than 0 gives the command.

use alloc::format;
use alloc::string::String;
use core::fmt;

use serde::{Deserialize, Serialize};

use super::command::{Jog, JogGoal, MotionAction};
use super::destination::Destination;

/// What a command says, without its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum OnlineWord {
    /// `J+`.
    JogPositive,
    /// `J-`.
    JogNegative,
    /// `J/`.
    JogStop,
    /// `J=`.
    PreJog,
    /// `J=` and a position.
    JogTo,
    /// `J==` and a position.
    JogToAndKeep,
    /// `J:` and a distance.
    JogBy,
    /// `J^` and a distance.
    JogFromActual,
    /// `HM`.
    Home,
    /// `HMZ`.
    HomeZero,
    /// `K`.
    Kill,
    /// `O` and a percentage.
    OpenLoop,
    /// `B` and a program, with a label behind the point.
    Begin,
    /// `R`.
    Run,
    /// `S`.
    Step,
    /// `A`.
    Abort,
    /// `H`.
    Hold,
    /// `Q`.
    Quit,
    /// `/`.
    Halt,
    /// `\`.
    ProgramHold,
    /// `%` and a percentage.
    TimeBase,
    /// `^A`.
    AbortAll,
    /// `^K`.
    KillAll,
    /// `^O`.
    HoldAll,
    /// `^Q`.
    QuitAll,
    /// `^R`.
    RunAll,
    /// `^S`.
    StepAll,
}

/// A row of [`WORDS`]: the word, the sign of whoever takes it, its spelling, and whether a number follows.
type Row = (OnlineWord, char, &'static str, bool);

/// All words, each with the sign in front of the number of the motor or coordinate system that takes it, or `^`.
const WORDS: [Row; 27] = [
    (OnlineWord::JogPositive, '#', "J+", false),
    (OnlineWord::JogNegative, '#', "J-", false),
    (OnlineWord::JogStop, '#', "J/", false),
    (OnlineWord::PreJog, '#', "J=", false),
    (OnlineWord::JogTo, '#', "J=", true),
    (OnlineWord::JogToAndKeep, '#', "J==", true),
    (OnlineWord::JogBy, '#', "J:", true),
    (OnlineWord::JogFromActual, '#', "J^", true),
    (OnlineWord::Home, '#', "HM", false),
    (OnlineWord::HomeZero, '#', "HMZ", false),
    (OnlineWord::Kill, '#', "K", false),
    (OnlineWord::OpenLoop, '#', "O", true),
    (OnlineWord::Begin, '&', "B", true),
    (OnlineWord::Run, '&', "R", false),
    (OnlineWord::Step, '&', "S", false),
    (OnlineWord::Abort, '&', "A", false),
    (OnlineWord::Hold, '&', "H", false),
    (OnlineWord::Quit, '&', "Q", false),
    (OnlineWord::Halt, '&', "/", false),
    (OnlineWord::ProgramHold, '&', "\\", false),
    (OnlineWord::TimeBase, '&', "%", true),
    (OnlineWord::AbortAll, '^', "A", false),
    (OnlineWord::KillAll, '^', "K", false),
    (OnlineWord::HoldAll, '^', "O", false),
    (OnlineWord::QuitAll, '^', "Q", false),
    (OnlineWord::RunAll, '^', "R", false),
    (OnlineWord::StepAll, '^', "S", false),
];

/// A command with the motor or coordinate system that takes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Online {
    /// The number of the motor or coordinate system, from 1; 0 of a command for all.
    pub number: u8,
    word: OnlineWord,
    /// The bits of the number behind the word; those of 0 where none follows.
    operand: u64,
}

/// A number behind a word: of signs, digits, a point and an exponent.
fn operand(text: &str) -> Option<f64> {
    let is_plain =
        text.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+' | b'E'));
    text.parse::<f64>().ok().filter(|number| is_plain && number.is_finite())
}

impl Online {
    fn new(number: u8, word: OnlineWord, operand: f64) -> Self {
        // 0 and -0 are the same command.
        Self { number, word, operand: (operand + 0.0).to_bits() }
    }

    fn row(word: OnlineWord) -> Option<&'static Row> {
        WORDS.iter().find(|row| row.0 == word)
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
        let command = WORDS.iter().filter(|row| row.1 == sign).find_map(|row| {
            let behind = rest.strip_prefix(row.2)?;
            let value = if row.3 { operand(behind)? } else { behind.is_empty().then_some(0.0)? };
            Some(Self::new(u8::try_from(number).unwrap_or(0), row.0, value))
        })?;
        Some((sign, number, command))
    }

    /// The command that does something to a motor or coordinate system; `None` for what can't be given from outside.
    pub fn of(action: &MotionAction, motor: u8, system: u8) -> Option<Self> {
        use OnlineWord as Word;
        let (word, operand) = match *action {
            MotionAction::Jog(Jog { goal, trigger: None }) => match goal {
                JogGoal::Positive => (Word::JogPositive, 0.0),
                JogGoal::Negative => (Word::JogNegative, 0.0),
                JogGoal::Stop => (Word::JogStop, 0.0),
                JogGoal::PreJog => (Word::PreJog, 0.0),
                JogGoal::To(position) => (Word::JogTo, position),
                JogGoal::ToAndKeep(position) => (Word::JogToAndKeep, position),
                JogGoal::By(distance) => (Word::JogBy, distance),
                JogGoal::FromActual(distance) => (Word::JogFromActual, distance),
                JogGoal::ToVariable
                | JogGoal::ByVariable
                | JogGoal::FromActualVariable
                | JogGoal::Whole => return None,
            },
            MotionAction::Home => (Word::Home, 0.0),
            MotionAction::HomeZero => (Word::HomeZero, 0.0),
            MotionAction::Kill => (Word::Kill, 0.0),
            MotionAction::OpenLoop(percent) => (Word::OpenLoop, percent),
            MotionAction::Begin { program, label } => {
                (Word::Begin, Destination::number(program, label))
            }
            MotionAction::Run => (Word::Run, 0.0),
            MotionAction::Step => (Word::Step, 0.0),
            MotionAction::Abort => (Word::Abort, 0.0),
            MotionAction::Hold => (Word::Hold, 0.0),
            MotionAction::Quit => (Word::Quit, 0.0),
            MotionAction::Halt => (Word::Halt, 0.0),
            MotionAction::ProgramHold => (Word::ProgramHold, 0.0),
            MotionAction::TimeBase(percent) => (Word::TimeBase, percent),
            MotionAction::AbortAll => (Word::AbortAll, 0.0),
            MotionAction::KillAll => (Word::KillAll, 0.0),
            MotionAction::HoldAll => (Word::HoldAll, 0.0),
            MotionAction::QuitAll => (Word::QuitAll, 0.0),
            MotionAction::RunAll => (Word::RunAll, 0.0),
            MotionAction::StepAll => (Word::StepAll, 0.0),
            _ => return None,
        };
        let number = match Self::row(word)?.1 {
            '#' => motor,
            '&' => system,
            _ => 0,
        };
        Some(Self::new(number, word, operand))
    }

    /// What it does.
    pub fn action(self) -> MotionAction {
        use OnlineWord as Word;
        let operand = f64::from_bits(self.operand);
        let jog = |goal| MotionAction::Jog(Jog { goal, trigger: None });
        match self.word {
            Word::JogPositive => jog(JogGoal::Positive),
            Word::JogNegative => jog(JogGoal::Negative),
            Word::JogStop => jog(JogGoal::Stop),
            Word::PreJog => jog(JogGoal::PreJog),
            Word::JogTo => jog(JogGoal::To(operand)),
            Word::JogToAndKeep => jog(JogGoal::ToAndKeep(operand)),
            Word::JogBy => jog(JogGoal::By(operand)),
            Word::JogFromActual => jog(JogGoal::FromActual(operand)),
            Word::Home => MotionAction::Home,
            Word::HomeZero => MotionAction::HomeZero,
            Word::Kill => MotionAction::Kill,
            Word::OpenLoop => MotionAction::OpenLoop(operand),
            Word::Begin => {
                // A conversion to an integer keeps within its range.
                let Destination { program, label } = Destination::of_number(operand);
                MotionAction::Begin { program: program as u32, label: label as u32 }
            }
            Word::Run => MotionAction::Run,
            Word::Step => MotionAction::Step,
            Word::Abort => MotionAction::Abort,
            Word::Hold => MotionAction::Hold,
            Word::Quit => MotionAction::Quit,
            Word::Halt => MotionAction::Halt,
            Word::ProgramHold => MotionAction::ProgramHold,
            Word::TimeBase => MotionAction::TimeBase(operand),
            Word::AbortAll => MotionAction::AbortAll,
            Word::KillAll => MotionAction::KillAll,
            Word::HoldAll => MotionAction::HoldAll,
            Word::QuitAll => MotionAction::QuitAll,
            Word::RunAll => MotionAction::RunAll,
            Word::StepAll => MotionAction::StepAll,
        }
    }

    /// The command without the number of its motor or coordinate system, as events have it: `J=200`, `^A`.
    pub fn text(self) -> String {
        let Some(&(_, sign, spelling, has_operand)) = Self::row(self.word) else {
            return String::new();
        };
        let sign = if sign == '^' { "^" } else { "" };
        match has_operand {
            true => format!("{sign}{spelling}{}", crate::number(f64::from_bits(self.operand))),
            false => format!("{sign}{spelling}"),
        }
    }
}

impl fmt::Display for Online {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Self::row(self.word).map(|row| row.1) {
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
        for (word, ..) in WORDS {
            let row = Online::row(word).unwrap();
            let operand = if row.3 { 12.5 } else { 0.0 };
            let number = if row.1 == '^' { 0 } else { 3 };
            let command = Online::new(number, word, operand);
            let read = Online::parse(&command.to_string());
            assert_eq!(read, Some((row.1, u32::from(number), command)), "{command}");
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
