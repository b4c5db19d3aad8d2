//! What the configuration of a control says to `plcio`: the entries `[[io]]`, the image file, and the table
//! `[plcio]`.

use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use plcc_abi::closest;
use plcc_image::configuration::{self, Driver, Entry, LineNumbers, Medium, Mistake};
use toml::de::DeTable;

use crate::input_file;
use crate::modbus::settings::{self as modbus, milliseconds};
use crate::modbus::{DeviceSettings, Manner};

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
    /// How long a client of the Modbus server may ask nothing.
    pub(crate) idle: Duration,
    /// How long the control may end no tick before its outputs are made safe.
    pub(crate) silence: Duration,
    /// The Modbus devices that are asked in another manner.
    pub(crate) devices: Vec<DeviceSettings>,
    /// Where the Modbus server listens.
    pub(crate) modbus_server: Option<String>,
    /// The server for OPC UA.
    #[cfg(feature = "opcua")]
    pub(crate) opcua: crate::opcua::Settings,
    /// The publisher for MQTT.
    #[cfg(feature = "mqtt")]
    pub(crate) mqtt: crate::mqtt::Settings,
    /// The keys of zenoh.
    #[cfg(feature = "zenoh")]
    pub(crate) zenoh: crate::plant::Settings,
    /// The name of the component of LinuxCNC's HAL.
    pub(crate) hal_component: String,
    /// The Python that has LinuxCNC's modules.
    pub(crate) hal_python: PathBuf,
    /// The terminals that are expected behind the network interface; none if it does not matter.
    #[cfg(feature = "ethercat")]
    pub(crate) ethercat_terminals: Vec<crate::ethercat::Expected>,
    /// The log.
    pub(crate) log: Option<PathBuf>,
    /// Files of the control, which the log must not be, with their keys.
    other_files: Vec<(&'static str, PathBuf)>,
}

const KEYS: [&str; 25] = [
    "device",
    "poll_ms",
    "answer_ms",
    "silence_ms",
    "modbus-server",
    "idle_ms",
    "opcua-server",
    "opcua-certificates",
    "opcua-users",
    "opcua-anonymous",
    "mqtt-broker",
    "mqtt-group",
    "mqtt-node",
    "mqtt-user",
    "mqtt-password",
    "mqtt-ca",
    "zenoh-connect",
    "zenoh-listen",
    "zenoh-prefix",
    "zenoh-name",
    "zenoh-history",
    "hal-component",
    "hal-python",
    "ethercat-terminals",
    "log",
];

/// The keys of the control's own files, and how a message names them.
const FILES: [(&str, &str); 4] = [
    ("artifact", "`artifact`"),
    ("log", "the control's own log"),
    ("record", "`record`"),
    ("retain", "`retain`"),
];

/// The features of `plcio` that drivers need, with which it was built or not.
const FEATURES: [(Driver, &str, bool); 5] = [
    (Driver::OpcUa, "opcua", cfg!(feature = "opcua")),
    (Driver::Mqtt, "mqtt", cfg!(feature = "mqtt")),
    (Driver::Zenoh, "zenoh", cfg!(feature = "zenoh")),
    (Driver::Gpio, "gpio", cfg!(feature = "gpio")),
    (Driver::Ethercat, "ethercat", cfg!(feature = "ethercat")),
];

/// The names of the drivers that this `plcio` was built with, each in a line of its own.
pub(crate) fn drivers() -> String {
    let is_missing = |driver| FEATURES.iter().any(|(other, _, built)| *other == driver && !built);
    let drivers = Driver::ALL.iter().filter(|&&(_, driver)| !is_missing(driver));
    let names = drivers.filter(|(_, driver)| *driver != Driver::Other);
    names.map(|(name, _)| format!("{name}\n")).collect()
}

/// That a feature is missing with which `plcio` would have to be built.
fn built_without(feature: &str) -> String {
    format!(
        "this plcio was built without the feature `{feature}`: cargo install --locked --path plcio --features {feature}"
    )
}

/// Why a configuration can't be read, as the end of a sentence about it.
fn why_not_read(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".into(),
        ErrorKind::PermissionDenied => "it may not be read".into(),
        ErrorKind::IsADirectory => "it is a folder".into(),
        ErrorKind::InvalidData => {
            "it is no text; the configuration of the control is expected".into()
        }
        _ => error.to_string(),
    }
}

impl Settings {
    /// Reads a configuration. Mistakes in keys that are not for `plcio` are left to `plcrt --check-config`.
    ///
    /// # Errors
    /// All mistakes, for people.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let shown = path.display();
        let text = input_file::read_text(path);
        let text = text.map_err(|error| format!("{shown}: {}", why_not_read(&error)))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let settings = Self::read(&text, folder);
        let settings = settings.and_then(|settings| match settings.log_that_overwrites(path) {
            Some(message) => Err(vec![Mistake { line: 1, message }]),
            None => Ok(settings),
        });
        let settings = settings.map_err(|mistakes| {
            let line = |Mistake { line, message }: &Mistake| format!("{shown}:{line}: {message}");
            mistakes.iter().map(line).collect::<Vec<_>>().join("\nerror: ")
        });
        #[cfg(feature = "zenoh")]
        let settings = settings.map(|mut settings: Self| {
            if settings.zenoh.record.as_os_str().is_empty() {
                settings.zenoh.record = path.with_extension("plcrec");
            }
            settings
        });
        settings
    }

    /// Why the log can't be written where it is to be, if it is a file that is something else already.
    fn log_that_overwrites(&self, configuration: &Path) -> Option<String> {
        let log = self.log.as_ref()?;
        let identity =
            |path: &Path| std::fs::metadata(path).ok().map(|about| (about.dev(), about.ino()));
        let own = identity(log);
        let is_log = |path: &Path| path == log || own.is_some() && identity(path) == own;
        let mut others = vec![("the configuration", configuration), ("`image`", &self.image)];
        others.extend(self.other_files.iter().map(|(key, path)| (*key, path.as_path())));
        let (name, _) = others.into_iter().find(|(_, path)| is_log(path))?;
        Some(format!("`log` in [plcio]: {} is {name}", log.display()))
    }

    /// The manner in which a unit of a Modbus device is asked.
    pub(crate) fn manner(&self, medium: &Medium, unit: u8) -> Manner {
        let usual = Manner { poll: self.poll, answer: self.answer, is_single: false };
        modbus::manner(&self.devices, medium, unit, usual)
    }

    /// A name for the control: that of its image file.
    pub(crate) fn name(&self) -> String {
        let name = self.image.file_stem().map(|name| name.to_string_lossy().into_owned());
        name.unwrap_or_else(|| "control".into())
    }

    pub(crate) fn read(text: &str, folder: &Path) -> Result<Self, Vec<Mistake>> {
        let (table, errors) = DeTable::parse_recoverable(text);
        let lines = LineNumbers::new(text);
        let line_of = |at: usize| lines.line(at);
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
            idle: Duration::from_secs(60),
            silence: Duration::from_millis(1000),
            devices: vec![],
            modbus_server: None,
            #[cfg(feature = "opcua")]
            opcua: crate::opcua::Settings {
                address: None,
                certificates: folder.join("opcua"),
                users: None,
                anonymous: false,
            },
            #[cfg(feature = "mqtt")]
            mqtt: crate::mqtt::Settings {
                broker: None,
                group: "plcc".into(),
                node: String::new(),
                user: None,
                password: None,
                authority: None,
            },
            #[cfg(feature = "zenoh")]
            zenoh: crate::plant::Settings {
                connect: None,
                listen: None,
                prefix: "plcc".into(),
                name: String::new(),
                history: None,
                control_log: None,
                record: PathBuf::new(),
            },
            hal_component: String::new(),
            hal_python: "/usr/bin/python3".into(),
            #[cfg(feature = "ethercat")]
            ethercat_terminals: vec![],
            log: None,
            other_files: vec![],
        };
        for (key, shown) in FILES {
            if let Some(file) = table.get(key).and_then(|path| path.get_ref().as_str()) {
                settings.other_files.push((shown, folder.join(file)));
            }
        }
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
        for entry in &settings.entries {
            let missing =
                FEATURES.iter().find(|(driver, _, built)| *driver == entry.driver && !built);
            if let Some((_, feature, _)) = missing {
                mistakes.push(Mistake { line: entry.line, message: built_without(feature) });
            }
        }
        let own = table.get("plcio").and_then(|own| own.get_ref().as_table());
        for (key, value) in own.into_iter().flatten() {
            let line = line_of(key.span().start);
            let key = key.get_ref().as_ref();
            let milliseconds = || {
                milliseconds(value.get_ref()).map_err(|_| "a number of milliseconds is expected")
            };
            let text = || value.get_ref().as_str().ok_or("a text in quotes is expected");
            let done = match key {
                "device" => {
                    let entries = &settings.entries;
                    settings.devices = modbus::read(value, entries, &line_of, &mut mistakes);
                    Ok(())
                }
                "poll_ms" => milliseconds().map(|time| settings.poll = time),
                "answer_ms" => milliseconds().map(|time| settings.answer = time),
                "idle_ms" => milliseconds().map(|time| settings.idle = time),
                "silence_ms" => milliseconds().map(|time| settings.silence = time),
                "modbus-server" => text().map(|at| settings.modbus_server = Some(at.into())),
                #[cfg(feature = "opcua")]
                "opcua-server" => text().map(|at| settings.opcua.address = Some(at.into())),
                #[cfg(feature = "opcua")]
                "opcua-certificates" => {
                    text().map(|path| settings.opcua.certificates = folder.join(path))
                }
                #[cfg(feature = "opcua")]
                "opcua-users" => text().map(|path| settings.opcua.users = Some(folder.join(path))),
                #[cfg(feature = "opcua")]
                "opcua-anonymous" => value
                    .get_ref()
                    .as_bool()
                    .map(|on| settings.opcua.anonymous = on)
                    .ok_or("true or false is expected"),
                #[cfg(feature = "mqtt")]
                "mqtt-broker" => text().and_then(|at| {
                    let is_broker = crate::mqtt::Settings::address(at).is_ok();
                    settings.mqtt.broker = Some(at.into());
                    is_broker.then_some(()).ok_or("a broker such as mqtt://192.168.1.5 is expected")
                }),
                #[cfg(feature = "mqtt")]
                "mqtt-group" | "mqtt-node" => text().and_then(|name| {
                    let own = &mut settings.mqtt;
                    *(if key == "mqtt-node" { &mut own.node } else { &mut own.group }) =
                        name.into();
                    crate::mqtt::is_name(name)
                        .then_some(())
                        .ok_or("a name without / + # is expected")
                }),
                #[cfg(feature = "mqtt")]
                "mqtt-user" => text().map(|user| settings.mqtt.user = Some(user.into())),
                #[cfg(feature = "mqtt")]
                "mqtt-password" => {
                    text().map(|path| settings.mqtt.password = Some(folder.join(path)))
                }
                #[cfg(feature = "mqtt")]
                "mqtt-ca" => text().map(|path| settings.mqtt.authority = Some(folder.join(path))),
                #[cfg(feature = "zenoh")]
                "zenoh-connect" => text().map(|at| settings.zenoh.connect = Some(at.into())),
                #[cfg(feature = "zenoh")]
                "zenoh-listen" => text().map(|at| settings.zenoh.listen = Some(at.into())),
                #[cfg(feature = "zenoh")]
                "zenoh-prefix" | "zenoh-name" => text().and_then(|name| {
                    let own = &mut settings.zenoh;
                    let is_prefix = key == "zenoh-prefix";
                    *(if is_prefix { &mut own.prefix } else { &mut own.name }) = name.into();
                    let fits = crate::plant::is_prefix(name) && (is_prefix || !name.contains('/'));
                    fits.then_some(()).ok_or("a name without * $ ? # is expected")
                }),
                #[cfg(feature = "zenoh")]
                "zenoh-history" => text().map(|path| settings.zenoh.history = Some(path.into())),
                "hal-component" => text().and_then(|name| {
                    settings.hal_component = name.into();
                    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
                    let is_name = !name.is_empty() && name.len() <= 32 && name.chars().all(fits);
                    is_name.then_some(()).ok_or("a name of letters, digits and - is expected")
                }),
                "hal-python" => text().map(|path| settings.hal_python = path.into()),
                #[cfg(feature = "ethercat")]
                "ethercat-terminals" => {
                    let one = |value: &toml::Spanned<toml::de::DeValue<'_>>| {
                        value.get_ref().as_str().and_then(crate::ethercat::Expected::parse)
                    };
                    let list = value.get_ref().as_array();
                    let all = list.and_then(|list| list.iter().map(one).collect());
                    all.map(|all| settings.ethercat_terminals = all).ok_or(
                        "a list of names or of \"VENDOR:PRODUCT\" is expected, as in [\"EK1100\", \"EL1008\"]",
                    )
                }
                "log" => text().map(|path| settings.log = Some(folder.join(path))),
                _ if KEYS.contains(&key) => {
                    let feature = key.split('-').next().unwrap_or_default();
                    mistakes.push(Mistake { line, message: built_without(feature) });
                    continue;
                }
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
        #[cfg(feature = "mqtt")]
        if settings.mqtt.node.is_empty() {
            settings.mqtt.node = settings.name().replace(['+', '#'], "-");
        }
        #[cfg(feature = "zenoh")]
        if settings.zenoh.name.is_empty() {
            settings.zenoh.name = settings.name().replace(['*', '$', '?', '#'], "-");
        }
        #[cfg(feature = "zenoh")]
        {
            let path = |key: &str| Some(folder.join(table.get(key)?.get_ref().as_str()?));
            settings.zenoh.control_log = path("log");
            // As plcrt chooses it.
            let beside = || path("retain").map(|path| path.with_extension("plcrec"));
            settings.zenoh.record = path("record").or_else(beside).unwrap_or_default();
        }
        if settings.hal_component.is_empty() {
            settings.hal_component = plcc_image::hal_pin_name(&settings.name());
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
    fn the_log_is_no_other_file() {
        let folder = std::env::temp_dir().join(format!("plcio-settings-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("c.toml");
        std::fs::write(folder.join("i"), "").unwrap();
        std::fs::hard_link(folder.join("i"), folder.join("j")).unwrap();
        for (log, expected) in [
            ("c.toml", "is the configuration"),
            ("i", "is `image`"),
            ("j", "is `image`"),
            ("p.plcx", "is `artifact`"),
            ("own.jsonl", "is the control's own log"),
            ("l", ""),
        ] {
            let text = "artifact = \"p.plcx\"\nimage = \"i\"\nlog = \"own.jsonl\"\n[plcio]\n";
            std::fs::write(&path, format!("{text}log = \"{log}\"\n")).unwrap();
            let why = Settings::open(&path).err().unwrap_or_default();
            assert!(why.ends_with(expected) && why.is_empty() == expected.is_empty(), "{why}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

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

    #[test]
    fn a_file_that_can_not_be_read_is_said_in_words() {
        let missing = Settings::open(Path::new("/nowhere/a.toml")).unwrap_err();
        assert_eq!(missing, "/nowhere/a.toml: there is no such file");
        let program = Path::new("/proc/self/exe");
        let binary = Settings::open(program).unwrap_err();
        assert!(binary.contains("it is no text"), "{binary}");
    }
}
