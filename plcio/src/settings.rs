//! What the configuration of a control says to `plcio`: the entries `[[io]]`, the image file, and the table
//! `[plcio]`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use plcc_abi::closest;
use plcc_image::configuration::{self, Entry, Mistake};
use toml::de::{DeTable, DeValue};

/// The settings.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// The image file.
    pub(crate) image: PathBuf,
    /// What is connected with what.
    pub(crate) entries: Vec<Entry>,
    /// The time from one poll of a device to the next.
    pub(crate) poll: Duration,
    /// How long a device has for its answer.
    pub(crate) answer: Duration,
    /// How long the control may end no tick before its outputs are made safe.
    pub(crate) silence: Duration,
    /// Where the Modbus server listens.
    pub(crate) modbus_server: Option<String>,
    /// The log.
    pub(crate) log: Option<PathBuf>,
}

const KEYS: [&str; 5] = ["poll_ms", "answer_ms", "silence_ms", "modbus-server", "log"];

impl Settings {
    /// Reads a configuration. Mistakes in keys that are not for `plcio` are left to `plcrt --check-config`.
    ///
    /// # Errors
    /// All mistakes, for people.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let shown = path.display();
        let text = std::fs::read_to_string(path).map_err(|error| format!("{shown}: {error}"))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::read(&text, folder).map_err(|mistakes| {
            let line = |Mistake { line, message }: &Mistake| format!("{shown}:{line}: {message}");
            mistakes.iter().map(line).collect::<Vec<_>>().join("\nerror: ")
        })
    }

    fn read(text: &str, folder: &Path) -> Result<Self, Vec<Mistake>> {
        let (table, errors) = DeTable::parse_recoverable(text);
        let line_of = |at: usize| {
            let before = text.as_bytes().get(..at).unwrap_or_default();
            before.iter().filter(|&&byte| byte == b'\n').count() + 1
        };
        let no_toml = |error: &toml::de::Error| Mistake {
            line: line_of(error.span().map_or(0, |span| span.start)),
            message: format!("this is not valid TOML: {}", error.message()),
        };
        let mut mistakes: Vec<Mistake> = errors.iter().map(no_toml).collect();
        let table = table.get_ref();
        let mut settings = Self {
            image: PathBuf::new(),
            entries: vec![],
            poll: Duration::from_millis(20),
            answer: Duration::from_millis(500),
            silence: Duration::from_millis(1000),
            modbus_server: None,
            log: None,
        };
        match table.get("image").and_then(|image| image.get_ref().as_str()) {
            Some(image) => settings.image = folder.join(image),
            None => {
                let message =
                    "the key `image` is missing: drivers need the image file of the control";
                mistakes.push(Mistake { line: 1, message: message.into() });
            }
        }
        if let Some(io) = table.get("io") {
            settings.entries = configuration::entries(io.get_ref(), &line_of, &mut mistakes);
        }
        let own = table.get("plcio").and_then(|own| own.get_ref().as_table());
        for (key, value) in own.into_iter().flatten() {
            let line = line_of(key.span().start);
            let key = key.get_ref().as_ref();
            let milliseconds = || match value.get_ref() {
                DeValue::Integer(number) => {
                    let number =
                        number.as_str().parse().ok().filter(|ms| (1..=3_600_000).contains(ms));
                    number.map(Duration::from_millis).ok_or("a number of milliseconds is expected")
                }
                _ => Err("a number of milliseconds is expected"),
            };
            let text = || value.get_ref().as_str().ok_or("a text in quotes is expected");
            let done = match key {
                "poll_ms" => milliseconds().map(|time| settings.poll = time),
                "answer_ms" => milliseconds().map(|time| settings.answer = time),
                "silence_ms" => milliseconds().map(|time| settings.silence = time),
                "modbus-server" => text().map(|at| settings.modbus_server = Some(at.into())),
                "log" => text().map(|path| settings.log = Some(folder.join(path))),
                _ => {
                    let near = closest(key, KEYS).map(|near| format!("; did you mean `{near}`?"));
                    let message =
                        format!("there is no key `{key}` in [plcio]{}", near.unwrap_or_default());
                    mistakes.push(Mistake { line, message });
                    continue;
                }
            };
            if let Err(expected) = done {
                mistakes.push(Mistake { line, message: format!("`{key}`: {expected}") });
            }
        }
        mistakes.sort();
        if mistakes.is_empty() { Ok(settings) } else { Err(mistakes) }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn settings_have_defaults_and_mistakes_have_lines() {
        let good = "artifact = \"a\"\nimage = \"i\"\n[plcio]\npoll_ms = 5\nlog = \"l\"\n[[io]]\n\
                    name = \"A\"\ndriver = \"other\"\n";
        let settings = Settings::read(good, Path::new("etc")).unwrap();
        assert_eq!(settings.image, Path::new("etc/i"));
        assert_eq!(
            (settings.poll, settings.answer),
            (Duration::from_millis(5), Duration::from_millis(500))
        );
        assert_eq!((settings.entries.len(), settings.log.unwrap()), (1, "etc/l".into()));
        let bad = "[plcio]\npol_ms = 5\nanswer_ms = 0\nlog = 1\n[[io]]\nname = \"A\"\n";
        let lines: Vec<usize> = Settings::read(bad, Path::new(""))
            .unwrap_err()
            .iter()
            .map(|mistake| mistake.line)
            .collect();
        assert_eq!(lines, [1, 2, 3, 4, 5]);
    }
}
