//! The parts of a block: ways, or the time of G4, one behind the other (cnc-side 3.7, 3.9).

use serde::{Deserialize, Serialize};

use super::state::{AXES, State};
use crate::arc::Circle;
use crate::modal::Modal;
use crate::part_program::{Block, Cycle, Feed, Motion};
use crate::setup::Setup;

/// How many parts a block has at most.
const MOST: usize = 4;

/// A position of all axes.
type Point = [i128; AXES];

/// What kind of a block it is, as flags show it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Kind {
    #[default]
    Plain,
    /// G28 (I545).
    Home,
    /// G33 (I552, I554).
    Thread,
    /// G74, G84 (I552).
    Tap,
}

/// How fast a part is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
enum Pace {
    #[default]
    Rapid,
    Feed(Feed),
    /// G4: how many ticks.
    Dwell(u64),
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Part {
    pace: Pace,
    /// The axes that it names, a bit each, and where they go.
    named: u8,
    to: Point,
}

/// All parts of a block, and which one it is at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Parts {
    pub(super) kind: Kind,
    list: [Part; MOST],
    count: u8,
    at: u8,
    /// Where the present part ends, once it was begun.
    end: Option<Point>,
    /// How many ticks of G4 are left.
    left: u64,
    /// The circle of an arc.
    circle: Option<Circle>,
}

impl Parts {
    /// The parts of a block that begins with the axes at `commands`.
    pub(super) fn of(
        block: &Block,
        modal: &Modal,
        setup: &Setup,
        commands: &[i128],
        tick_ns: u64,
    ) -> Self {
        let mut parts = Self::default();
        let feed = modal.feed.unwrap_or(setup.feed_max);
        let of_words = |wanted: &dyn Fn(usize) -> bool, pace| {
            let mut part = Part { pace, ..Part::default() };
            for &(axis, word) in block.axes.iter().filter(|(axis, _)| wanted(*axis)) {
                let from = commands.get(axis).copied().unwrap_or(0);
                part.go(axis, if modal.absolute { word } else { from.saturating_add(word) });
            }
            part
        };
        let z = setup.rules.letters.iter().position(|name| *name == Some('Z'));
        match (block.dwell, block.cycle) {
            (Some(time), _) => {
                let pace = Pace::Dwell(time.div_ceil(tick_ns.max(1)));
                parts.push(Part { pace, ..Part::default() });
            }
            (None, Some(Cycle::Home)) if !block.axes.is_empty() => {
                parts.kind = Kind::Home;
                let point = of_words(&|_| true, Pace::Rapid);
                let mut home = point;
                for (axis, entry) in
                    setup.axes.iter().enumerate().filter(|(at, _)| point.names(*at))
                {
                    home.go(axis, entry.home);
                }
                parts.push(point);
                parts.push(home);
            }
            (None, Some(Cycle::Home)) => {}
            (None, Some(Cycle::Tap)) => {
                parts.kind = Kind::Tap;
                let before = of_words(&|axis| Some(axis) != z, Pace::Rapid);
                if before.named != 0 {
                    parts.push(before);
                }
                let Some(z) = z else { return parts };
                let from = commands.get(z).copied().unwrap_or(0);
                let word = |base: i128, word: i128| {
                    if modal.absolute { word } else { base.saturating_add(word) }
                };
                let at = |pace, position| {
                    let mut part = Part { pace, ..Part::default() };
                    part.go(z, position);
                    part
                };
                let reference = block.radius.map_or(from, |radius| word(from, radius));
                if block.radius.is_some() {
                    parts.push(at(Pace::Rapid, reference));
                }
                let depth = block.axes.iter().find(|(axis, _)| *axis == z);
                // As in every drilling cycle, Z of G91 counts from the point R.
                let depth = depth.map_or(reference, |(_, depth)| word(reference, *depth));
                parts.push(at(Pace::Feed(feed), depth));
                parts.push(at(Pace::Feed(feed), reference));
            }
            (None, None) if block.moves() => {
                if modal.motion == Motion::Thread {
                    parts.kind = Kind::Thread;
                }
                let pace = modal.speed(setup).map_or(Pace::Rapid, Pace::Feed);
                let part = of_words(&|_| true, pace);
                parts.push(part);
                let end = part.end(commands);
                parts.circle = modal.circle(block, &setup.rules.letters, commands, &end);
            }
            (None, None) => {}
        }
        parts.restart();
        parts
    }

    fn push(&mut self, part: Part) {
        if let Some(slot) = self.list.get_mut(usize::from(self.count)) {
            *slot = part;
            self.count += 1;
        }
    }

    fn part(&self) -> Part {
        self.list.get(usize::from(self.at)).copied().unwrap_or_default()
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Stands at the first part again.
    pub(super) fn restart(&mut self) {
        if self.at != 0 {
            (self.at, self.end) = (0, None);
        }
        self.left = self.part().ticks();
    }

    /// Goes to the next part. Returns whether there is one.
    pub(super) fn next(&mut self) -> bool {
        if self.at.saturating_add(1) >= self.count {
            return false;
        }
        (self.at, self.end) = (self.at + 1, None);
        self.left = self.part().ticks();
        true
    }

    /// Whether the present part is a way, and not G4.
    pub(super) fn is_way(&self) -> bool {
        !matches!(self.part().pace, Pace::Dwell(_))
    }

    /// Counts a tick of G4.
    pub(super) fn dwell(&mut self) {
        self.left = self.left.saturating_sub(1);
    }

    /// Whether the time of G4 is over.
    pub(super) fn has_dwelt(&self) -> bool {
        self.left == 0
    }

    /// The axes that its parts name, a bit each.
    pub(super) fn named(&self) -> u8 {
        self.list.iter().fold(0, |all, part| all | part.named)
    }
}

impl Part {
    fn go(&mut self, axis: usize, position: i128) {
        if let Some(slot) = self.to.get_mut(axis) {
            *slot = position;
            self.named |= 1 << axis;
        }
    }

    fn names(&self, axis: usize) -> bool {
        axis < AXES && self.named >> axis & 1 != 0
    }

    fn ticks(&self) -> u64 {
        if let Pace::Dwell(ticks) = self.pace { ticks } else { 0 }
    }

    /// Where it ends: axes that it does not name stay.
    fn end(&self, commands: &[i128]) -> Point {
        let mut end = Point::default();
        for (axis, slot) in end.iter_mut().enumerate() {
            let stays = commands.get(axis).copied().unwrap_or(0);
            *slot = if self.names(axis) { self.to.get(axis).copied().unwrap_or(0) } else { stays };
        }
        end
    }
}

impl State {
    /// Begins the present part of the block, or goes on with the rest of it, from where the axes stand; with the flags
    /// that show it.
    pub(super) fn begin_part(&mut self, setup: &Setup) {
        let oriented = self.spindles.iter().any(|spindle| spindle.is_oriented);
        let Self { block: Some(executed), positions, way, .. } = self else { return };
        let parts = &mut executed.parts;
        let (part, commands) = (parts.part(), positions.commands());
        let feed = match part.pace {
            Pace::Feed(feed) => Some(feed),
            Pace::Rapid | Pace::Dwell(_) => None,
        };
        if parts.is_way() {
            let mut end = *parts.end.get_or_insert_with(|| part.end(commands));
            // An axis that the part does not move stays, also where it was moved during an interruption.
            let bends = |axis| parts.circle.is_some_and(|circle| circle.axes.contains(&axis));
            for (axis, (slot, stands)) in end.iter_mut().zip(commands).enumerate() {
                if !part.names(axis) && !bends(axis) {
                    *slot = *stands;
                }
            }
            way.begin_for(commands, &end, feed, setup);
            if let Some(circle) = parts.circle {
                way.bend(circle);
            }
        }
        let kind = parts.kind;
        (self.stopped, self.interpolation_done) = (false, false);
        self.is_feed = feed.is_some() && !oriented;
        self.ignores_stop = matches!(kind, Kind::Thread | Kind::Tap);
        (self.is_thread, self.home_block) = (kind == Kind::Thread, kind == Kind::Home);
        self.request_axes();
    }
}
