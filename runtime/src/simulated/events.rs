//! Events of the simulator. Their texts are made before the run begins, since a tick allocates nothing.

use std::sync::Arc;

use plcc_simulator::{Awaited, Requested, Simulator, Told};

use crate::event::SimulatorEvent;

/// The texts of a run's events.
#[derive(Debug)]
pub(super) struct EventTexts {
    cycle_start: Arc<str>,
    /// A jog of each axis, and the axis.
    jogs: Vec<(Arc<str>, Arc<str>)>,
    codes: Vec<Arc<str>>,
    spindle_speed: Arc<str>,
    finished: Arc<str>,
    feed: Arc<str>,
    /// Y610 to Y617.
    releases: Vec<Arc<str>>,
    /// Refusals are told by words of their own.
    refusals: Vec<Arc<str>>,
}

/// How many axes have a text.
const AXES: u8 = 32;

impl EventTexts {
    pub(super) fn new(simulator: &Simulator) -> Self {
        let text = |text: String| Arc::<str>::from(text);
        let jog = |axis| {
            let jog = simulator.request_name(Requested::Jog(axis));
            (text(jog), text(simulator.axis_name(axis)))
        };
        let codes = (0..simulator.code_count()).filter_map(|code| u16::try_from(code).ok());
        let awaited = |awaited| text(simulator.awaited_name(awaited));
        let refusals = plcc_simulator::Refusal::ALL.iter();
        Self {
            cycle_start: text(simulator.request_name(Requested::CycleStart)),
            jogs: (0..AXES).map(jog).collect(),
            codes: codes.map(|code| awaited(Awaited::Code(code))).collect(),
            spindle_speed: awaited(Awaited::SpindleSpeed),
            finished: awaited(Awaited::Finished),
            feed: awaited(Awaited::Feed),
            releases: (0..8).map(|axis| awaited(Awaited::Axis(axis))).collect(),
            refusals: refusals.map(|refusal| refusal.name().into()).collect(),
        }
    }

    /// The event of what was told. `sent` has what the serial line has sent, in its order.
    pub(super) fn event(
        &self,
        told: Told,
        sent: &mut impl Iterator<Item = Vec<u8>>,
    ) -> SimulatorEvent {
        let shared = |text: Option<&Arc<str>>| text.unwrap_or(&self.cycle_start).clone();
        match told {
            Told::Block(line) => SimulatorEvent::Block { line: Some(line), entry: None },
            Told::Entry(entry) => SimulatorEvent::Block { line: None, entry: Some(entry) },
            Told::End => SimulatorEvent::End,
            Told::Serial => {
                let bytes = sent.next().unwrap_or_default();
                let data: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
                SimulatorEvent::Serial { data: data.into() }
            }
            Told::Refused(requested, refusal) => SimulatorEvent::Refused {
                requested: match requested {
                    Requested::CycleStart => self.cycle_start.clone(),
                    Requested::Jog(axis) => {
                        shared(self.jogs.get(usize::from(axis)).map(|(jog, _)| jog))
                    }
                },
                why: shared(self.refusals.get(refusal as usize)),
            },
            Told::Limit(axis, positive) => SimulatorEvent::Limit {
                axis: shared(self.jogs.get(usize::from(axis)).map(|(_, axis)| axis)),
                direction: if positive { "+" } else { "-" },
            },
            Told::Waits(awaited) => SimulatorEvent::Waits {
                awaited: match awaited {
                    Awaited::Code(code) => shared(self.codes.get(usize::from(code))),
                    Awaited::SpindleSpeed => self.spindle_speed.clone(),
                    Awaited::Finished => self.finished.clone(),
                    Awaited::Feed => self.feed.clone(),
                    Awaited::Axis(axis) => shared(self.releases.get(usize::from(axis))),
                },
            },
        }
    }
}
