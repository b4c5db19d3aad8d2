//! What kind of a quantity a variable is, which decides the panel that it is drawn in.

use super::Series;

/// The kinds, each with a panel of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Where an axis or a motor is.
    Position,
    /// How fast one moves.
    Velocity,
    /// Any other number.
    Number,
    /// 0 and 1 only.
    Bit,
}

/// The letters of axes.
const AXES: &str = "ABCUVWXYZ";

impl Quantity {
    /// The kind of a variable. Motors, axes and machines that are simulated have variables `WHO.WHAT`, in which WHAT is
    /// one of a few words; of others the values decide.
    pub(super) fn of(series: &Series) -> Self {
        let what = series.name.rsplit_once('.').map_or("", |(_, what)| what);
        let axis = |text: &str| text.len() == 1 && AXES.contains(text);
        match what {
            "CMD" | "ACT" => Self::Position,
            "VEL" | "SPEED" => Self::Velocity,
            what if axis(what) => Self::Position,
            what if what.strip_prefix('V').is_some_and(axis) => Self::Velocity,
            _ if series.is_bit() => Self::Bit,
            _ => Self::Number,
        }
    }
}
