//! Takes the values of the watched variables while a program runs.

use plcc_control::Watch;
use plcc_host::run::{AfterTick, BeforeTick, Hook};
use plcc_runtime::{Value, VariableKey};

use super::{Picture, TimeUnit};

/// Makes a picture of a run.
pub(crate) struct PlotRecorder {
    picture: Picture,
    watch: Watch,
    /// The values that were seen last, by the order of the watched variables.
    last: Vec<Value>,
    /// How long the tick that runs takes, and when it began, in nanoseconds.
    tick_ns: u64,
    time_ns: u64,
}

impl PlotRecorder {
    /// A picture without values.
    pub(crate) fn new() -> Self {
        let picture = Picture::new(TimeUnit::Milliseconds);
        Self { picture, watch: Watch::default(), last: vec![], tick_ns: 0, time_ns: 0 }
    }

    /// What was seen.
    pub(crate) fn picture(&self) -> &Picture {
        &self.picture
    }

    fn see(&mut self, tick: u64, name: &str, value: &Value) {
        let time = self.time_ns as f64 / 1e6;
        match value {
            Value::Int(number) => {
                let series = self.picture.add(name);
                self.picture.sample(series, tick, time, *number as f64);
            }
            Value::Float(number) => {
                let series = self.picture.add(name);
                self.picture.sample(series, tick, time, *number);
            }
            Value::Array(elements) => {
                for (index, element) in elements.iter().enumerate() {
                    self.see(tick, &format!("{name}[{index}]"), element);
                }
            }
        }
    }
}

impl Hook for PlotRecorder {
    fn before_tick(&mut self, now: &mut BeforeTick<'_>) {
        if self.watch != *now.watch {
            self.watch = now.watch.clone();
            self.last = vec![];
        }
        self.tick_ns = now.executive.tick_ns();
    }

    fn after_tick(&mut self, now: &mut AfterTick<'_>) {
        let tick = now.ticks.saturating_sub(1);
        let watched: Vec<(String, VariableKey)> =
            if self.last.is_empty() { self.watch.names().to_vec() } else { vec![] };
        // The first time all values are taken.
        for (name, key) in watched {
            let value = now.executive.read(key);
            self.see(tick, &name, &value);
            self.last.push(value);
        }
        for index in 0..self.last.len() {
            let Some((name, key)) = self.watch.names().get(index) else { break };
            let value = now.executive.read(*key);
            if self.last.get(index) != Some(&value) {
                let name = name.clone();
                self.see(tick, &name, &value);
                if let Some(last) = self.last.get_mut(index) {
                    *last = value;
                }
            }
        }
        self.picture.ends(tick, self.time_ns as f64 / 1e6);
        self.time_ns = self.time_ns.saturating_add(self.tick_ns);
    }
}
