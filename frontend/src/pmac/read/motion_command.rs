//! On-line commands for motors and coordinate systems (guide, appendix C): what they do where motion is simulated.

use plcc_abi::pmac::motion::{
    Axis, AxisGroup, AxisSet, Destination, Jog, JogGoal, MotionAction, MotionCommand, Query,
};

use super::cursor::Parsed;
use super::expr::Reader;
use super::online::OnlineCommand;
use super::words::Word;
use crate::pmac::ast::Action;
use crate::pmac::origin::TextRange;

impl Reader<'_> {
    /// The command whose text reaches from the offset `start` to the cursor.
    pub(crate) fn motion(&self, start: usize, action: MotionAction) -> OnlineCommand {
        let text = self.cur.text_at(TextRange::new(start, self.cur.pos)).to_owned();
        OnlineCommand::one(Action::Motion(MotionCommand { text, action }))
    }

    /// `J` and where to, at the cursor.
    pub(crate) fn jog(&mut self) -> Parsed<OnlineCommand> {
        let start = self.cur.pos;
        self.cur.pos += 1;
        let sign = self.cur.byte();
        self.cur.pos += usize::from(matches!(sign, b'+' | b'-' | b'/' | b'!' | b'=' | b':' | b'^'));
        let keeps = sign == b'=' && self.cur.byte() == b'=';
        self.cur.pos += usize::from(keeps);
        let goal = match sign {
            b'+' => JogGoal::Positive,
            b'-' => JogGoal::Negative,
            b'/' => JogGoal::Stop,
            b'!' => JogGoal::Whole,
            b'=' | b':' | b'^' => {
                let variable = self.cur.byte() == b'*';
                self.cur.pos += usize::from(variable);
                let distance = if variable { None } else { self.distance()? };
                match (sign, variable, distance) {
                    (b'=', true, _) => JogGoal::ToVariable,
                    (b'=', _, Some(c)) if keeps => JogGoal::ToAndKeep(c),
                    (b'=', _, Some(c)) => JogGoal::To(c),
                    (b'=', _, None) => JogGoal::PreJog,
                    (b':', true, _) => JogGoal::ByVariable,
                    (b':', _, c) => JogGoal::By(c.unwrap_or(0.0)),
                    (_, true, _) => JogGoal::FromActualVariable,
                    (_, _, c) => JogGoal::FromActual(c.unwrap_or(0.0)),
                }
            }
            _ => JogGoal::PreJog,
        };
        let trigger = match goal {
            JogGoal::Positive | JogGoal::Negative | JogGoal::Stop | JogGoal::Whole => None,
            _ if self.cur.byte() == b'^' => {
                self.cur.pos += 1;
                Some(self.distance()?.unwrap_or(0.0))
            }
            _ => None,
        };
        // Further signs mean nothing, but the control takes them.
        while matches!(self.cur.byte(), b'+' | b'-' | b'/' | b'=' | b':' | b'^' | b'*' | b'!') {
            self.cur.pos += 1;
        }
        Ok(self.motion(start, MotionAction::Jog(Jog { goal, trigger })))
    }

    /// A number with a sign or none, if one begins directly at the cursor.
    fn distance(&mut self) -> Parsed<Option<f64>> {
        let digits = |byte: u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'$');
        let begins = digits(self.cur.byte())
            || matches!(self.cur.byte(), b'-' | b'+') && digits(self.cur.byte_at(1));
        if begins { self.signed().map(Some) } else { Ok(None) }
    }

    /// `%`, and perhaps a percentage.
    pub(crate) fn percentage(&mut self) -> Parsed<OnlineCommand> {
        let start = self.cur.pos;
        self.cur.pos += 1;
        let action = match self.distance()? {
            Some(percent) => MotionAction::TimeBase(percent),
            None => MotionAction::Query(Query::TimeBase),
        };
        Ok(self.motion(start, action))
    }

    /// `#`, perhaps with a motor's number, and perhaps with the definition of its axes.
    pub(crate) fn motor(&mut self) -> Parsed<OnlineCommand> {
        let start = self.cur.pos;
        self.cur.pos += 1;
        if !self.cur.peek().is_ascii_digit() {
            return Ok(self.motion(start, MotionAction::Query(Query::Motor)));
        }
        let motor = self.addressed("motor", 8, 32)?;
        if self.cur.peek() != b'-' || self.cur.byte_at(1) != b'>' {
            let action =
                if motor == 0 { MotionAction::Nothing } else { MotionAction::Motor(motor) };
            return Ok(self.motion(start, action));
        }
        self.cur.pos += 2;
        let from = self.cur.pos;
        let definition = self.axis_definition(motor);
        if definition.is_none() {
            self.cur.pos = from;
            let rest = self.cur.rest();
            self.cur.pos += rest.find(['#', '&', '\n']).unwrap_or(rest.len());
        }
        // To ask for a definition, and what this control can't do, has no effect.
        let mut actions = match definition.map(|define| self.motion(start, define)) {
            Some(OnlineCommand::Do(actions)) => actions,
            _ => Vec::new(),
        };
        if motor != 0 {
            let text = format!("#{motor}");
            let action = MotionAction::Motor(motor);
            actions.insert(0, Action::Motion(MotionCommand { text, action }));
        }
        Ok(OnlineCommand::Do(actions))
    }

    /// The axes of a motor with their scale factors and an offset: `2000X-500Y+100`.
    fn axis_definition(&mut self, motor: u8) -> Option<MotionAction> {
        let (mut group, mut scales, mut offset) = (None, [0.0; 3], None);
        if self.cur.peek().eq_ignore_ascii_case(&b'I') && !self.cur.byte_at(1).is_ascii_digit() {
            self.cur.pos += 1;
            let group = Some(AxisGroup::Kinematics);
            return Some(MotionAction::Define { motor, group, scales, offset });
        }
        loop {
            let sign = self.cur.peek();
            let negative = sign == b'-';
            let signed = matches!(sign, b'-' | b'+');
            if (group.is_some() || offset.is_some()) && !signed {
                break;
            }
            self.cur.pos += usize::from(signed);
            let number = self.cur.number();
            let value = number.unwrap_or(1.0);
            let value = if negative { -value } else { value };
            match Axis::from_letter(self.cur.peek()) {
                Some(axis) => {
                    self.cur.pos += 1;
                    let own = group_of(axis);
                    if group.is_some_and(|group| group != own) {
                        return Some(MotionAction::Refused("ERR003".to_owned()));
                    }
                    group = Some(own);
                    *scales.get_mut(axis.slot())? = value;
                }
                None => {
                    number?;
                    offset = Some(value);
                    break;
                }
            }
        }
        match (group, offset) {
            (Some(_), _) => Some(MotionAction::Define { motor, group, scales, offset }),
            (None, Some(0.0)) => {
                Some(MotionAction::Define { motor, group: None, scales, offset: None })
            }
            (None, _) => None,
        }
    }

    /// The axes in parentheses behind ABS, INC and FRAX, R among them; `None` without parentheses.
    pub(crate) fn axis_list(&mut self) -> Option<AxisSet> {
        if self.cur.peek() != b'(' {
            return None;
        }
        self.cur.pos += 1;
        let mut set = AxisSet::NONE;
        loop {
            let byte = self.cur.peek();
            match Axis::from_letter(byte) {
                Some(axis) => set = set.with(axis),
                None if byte.eq_ignore_ascii_case(&b'R') => set = set.and(AxisSet::R),
                None if byte == b',' => {}
                None => break,
            }
            self.cur.pos += 1;
        }
        if !self.cur.eat(b')') {
            let rest = self.cur.rest();
            let line = rest.find('\n').unwrap_or(rest.len());
            self.cur.pos += rest.find(')').map_or(line, |end| (end + 1).min(line));
        }
        Some(set)
    }

    /// What the word of a command does to motion, with what follows it; `None` for a word that does nothing to it.
    /// The cursor is behind the word.
    pub(crate) fn motion_word(&mut self, word: &Word) -> Option<MotionAction> {
        // Without axes the vectors of arcs stay as they are (guide, Circular Interpolation).
        let all = AxisSet::AXES;
        Some(match word.spelling {
            "A" => MotionAction::Abort,
            "B" => {
                let to = Destination::of_number(self.cur.number().unwrap_or(0.0));
                MotionAction::Begin { program: to.program as u32, label: to.label as u32 }
            }
            "F" => MotionAction::Query(Query::FollowingError),
            "H" => MotionAction::Hold,
            "K" => MotionAction::Kill,
            "O" => {
                let negative = self.cur.byte() == b'-' && self.cur.byte_at(1).is_ascii_digit();
                self.cur.pos += usize::from(negative);
                let percent = self.cur.number().unwrap_or(0.0);
                MotionAction::OpenLoop(if negative { -percent } else { percent })
            }
            "P" => MotionAction::Query(Query::Position),
            "Q" => MotionAction::Quit,
            "R" => MotionAction::Run,
            "S" => MotionAction::Step,
            "V" => MotionAction::Query(Query::Velocity),
            "Z" => MotionAction::ZeroAxes,
            "HOME" | "HM" => {
                self.numbers();
                MotionAction::Home
            }
            "HOMEZ" | "HMZ" => {
                self.numbers();
                MotionAction::HomeZero
            }
            "ABS" => MotionAction::Incremental(false, self.axis_list().unwrap_or(all)),
            "INC" => MotionAction::Incremental(true, self.axis_list().unwrap_or(all)),
            "FRAX" => {
                let set = self.axis_list().unwrap_or(AxisSet::AXES);
                MotionAction::FeedrateAxes(set.without(AxisSet::R))
            }
            "NOFRAX" => MotionAction::FeedrateAxes(AxisSet::NONE),
            "PMATCH" => MotionAction::Match,
            "MFLUSH" => MotionAction::Flush,
            "UNDEFINE" => MotionAction::Undefine { all: self.cur.eat_word("ALL") },
            "LEARN" | "LRN" => {
                let _ = self.axis_list();
                MotionAction::Refused("PMAC-X9".to_owned())
            }
            _ => return None,
        })
    }
}

/// What a control character does to motion.
pub(crate) fn control_character_motion(letter: u8) -> Option<MotionAction> {
    Some(match letter.to_ascii_uppercase() {
        b'A' => MotionAction::AbortAll,
        b'B' => MotionAction::Query(Query::MotorStatuses),
        b'C' => MotionAction::Query(Query::SystemStatuses),
        b'F' => MotionAction::Query(Query::FollowingErrors),
        b'G' => MotionAction::Query(Query::GlobalStatuses),
        b'K' => MotionAction::KillAll,
        b'O' => MotionAction::HoldAll,
        b'P' => MotionAction::Query(Query::Positions),
        b'Q' => MotionAction::QuitAll,
        b'R' => MotionAction::RunAll,
        b'S' => MotionAction::StepAll,
        b'V' => MotionAction::Query(Query::Velocities),
        _ => return None,
    })
}

/// The axes to which a motor can belong together with this one.
fn group_of(axis: Axis) -> AxisGroup {
    match axis {
        Axis::X | Axis::Y | Axis::Z => AxisGroup::Xyz,
        Axis::U | Axis::V | Axis::W => AxisGroup::Uvw,
        Axis::A | Axis::B | Axis::C => AxisGroup::Single(axis),
    }
}
