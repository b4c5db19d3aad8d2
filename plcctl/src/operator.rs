//! The operator's screen of a control: what is announced, the overrides, the keys and lamps that the program uses.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plcc_protocol::{Client, ClientError, Done, OperatorScreen, Request};
use plcc_screen::{Asked, Display, KEYS, Operator, bar, fitted, word_rows};
use ratatui::Frame;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use crate::show::harmless;

/// How often the control is asked for the screen.
const PERIOD: Duration = Duration::from_millis(200);
/// How long a reply is waited for, and a control left alone that does not answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// How many rows a message may take.
const MAX_MESSAGE_ROWS: usize = 3;

/// A connection to a control that comes back by itself.
#[derive(Debug)]
struct Link {
    socket: PathBuf,
    client: Option<Client>,
}

impl Link {
    fn ask<T: serde::de::DeserializeOwned>(&mut self, request: &Request) -> Result<T, ClientError> {
        let client = match self.client.take() {
            Some(client) => client,
            None => Client::connect(&self.socket, PATIENCE)?,
        };
        let answer = self.client.insert(client).ask(request);
        if let Err(ClientError::Unreachable(_)) = answer {
            self.client = None;
        }
        answer
    }
}

/// The operator's screen of a control.
#[derive(Debug)]
pub(crate) struct OperatorDisplay {
    link: Link,
    /// What the control said last, or why it says nothing.
    screen: Result<OperatorScreen, String>,
    /// When it is asked again.
    next: Instant,
    operator: Operator,
    /// Why something was not done.
    message: Option<String>,
    /// Whether no key leaves the screen.
    stays: bool,
    is_left: bool,
}

impl OperatorDisplay {
    /// The screen of the control at a socket, with what that says first. One that `stays` is not left by keys, and waits for a
    /// control that is not there yet.
    ///
    /// # Errors
    /// When the control has no such screen, or is not there.
    pub(crate) fn open(socket: &Path, stays: bool) -> Result<Self, ClientError> {
        let mut this = Self {
            link: Link { socket: socket.to_owned(), client: None },
            screen: Err(String::new()),
            next: Instant::now(),
            operator: Operator::default(),
            message: None,
            stays,
            is_left: false,
        };
        match this.link.ask(&Request::Operator {}) {
            Ok(screen) => this.take(screen),
            Err(ClientError::Unreachable(why)) if stays => this.screen = Err(why),
            Err(error) => return Err(error),
        }
        Ok(this)
    }

    /// Asks the control for the screen, when it is time for that.
    fn poll(&mut self) {
        let now = Instant::now();
        if now < self.next {
            return;
        }
        self.next = now + PERIOD;
        match self.link.ask(&Request::Operator {}) {
            Ok(screen) => self.take(screen),
            Err(error) => {
                self.screen = Err(error.to_string());
                self.next = now + PATIENCE;
            }
        }
    }

    fn take(&mut self, mut screen: OperatorScreen) {
        let OperatorScreen { state, dialect, program, view, .. } = &mut screen;
        let cells = view.overrides.iter_mut().chain(&mut view.keys).map(|cell| &mut cell.label);
        let texts = view.active.iter_mut().map(|one| &mut one.text);
        for text in [state, dialect, program].into_iter().chain(cells).chain(texts) {
            *text = harmless(text);
        }
        self.screen = Ok(screen);
    }

    fn press(&mut self, name: String, value: &str) {
        let request = Request::Press { name, on: value != "0" };
        match self.link.ask::<Done>(&request) {
            // What it does is seen at once.
            Ok(_) => self.next = Instant::now(),
            Err(error) => self.message = Some(error.to_string()),
        }
    }

    /// The first line: the program, what it does, and the forces.
    fn head(&self, width: usize) -> Line<'static> {
        let strong = Style::new().add_modifier(Modifier::BOLD);
        let Ok(screen) = &self.screen else {
            return Line::styled(fitted(&self.link.socket.display().to_string(), width), strong);
        };
        let OperatorScreen { program, dialect, state, forces, .. } = screen;
        let name = Path::new(program).file_name();
        let name = name.map_or_else(|| program.clone(), |name| name.to_string_lossy().into());
        let left = format!("{name} ({}) {state}", dialect.to_uppercase());
        let right = match forces {
            0 => String::new(),
            1 => "! 1 FORCE !".to_owned(),
            count => format!("! {count} FORCES !"),
        };
        let room = width.saturating_sub(right.chars().count());
        Line::styled(format!("{}{right}", fitted(&left, room)), strong)
    }

    /// What the keys do, for the last line.
    fn keys(&self) -> &'static str {
        match &self.screen {
            Ok(screen) if !screen.may_press => {
                "the control was started without --allow operate: nothing can be pressed"
            }
            _ if self.stays => KEYS.trim_end_matches("  q: leave"),
            _ => KEYS,
        }
    }
}

impl Display for OperatorDisplay {
    fn draw(&mut self, frame: &mut Frame<'_>) {
        self.poll();
        let width = usize::from(frame.area().width);
        let mut message = word_rows(self.message.as_deref().unwrap_or_default(), width);
        message.truncate(MAX_MESSAGE_ROWS);
        let rows = Layout::vertical([
            Constraint::Length(1),
            Constraint::Length(1),
            Constraint::Min(1),
            Constraint::Length(message.len() as u16),
            Constraint::Length(1),
        ]);
        let [head, _, mut body, said, keys] = rows.areas(frame.area());
        frame.render_widget(Paragraph::new(self.head(width)), head);
        match &self.screen {
            Ok(screen) => {
                if screen.state == "stopped" {
                    let lines = bar("the program is stopped", Color::Red, width);
                    let used = (lines.len() as u16).min(body.height);
                    frame.render_widget(Paragraph::new(lines), body);
                    body.y += used;
                    body.height -= used;
                }
                self.operator.draw(&screen.view, frame, body);
            }
            Err(why) => {
                let mut lines = bar("no control", Color::Red, width);
                lines.extend(word_rows(why, width).into_iter().map(Line::raw));
                frame.render_widget(Paragraph::new(lines), body);
            }
        }
        let strong = Style::new().add_modifier(Modifier::BOLD);
        let message = message.into_iter().map(|row| Line::styled(row, strong));
        frame.render_widget(Paragraph::new(message.collect::<Vec<_>>()), said);
        frame.render_widget(Paragraph::new(self.keys()), keys);
    }

    fn key(&mut self, key: KeyEvent) {
        self.message = None;
        let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
        let ends = is_control && matches!(key.code, KeyCode::Char('c' | 'q'));
        let asked = match &self.screen {
            _ if ends => Asked::Leave,
            Ok(screen) => self.operator.key(&screen.view, key.code),
            Err(_) => self.operator.key(&Default::default(), key.code),
        };
        match asked {
            Asked::Nothing => {}
            Asked::Leave => self.is_left = !self.stays,
            Asked::Press { name, value } => self.press(name, &value),
            Asked::Refused(why) => self.message = Some(why.into()),
        }
    }

    fn is_left(&self) -> bool {
        self.is_left
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::net::UnixListener;

    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use serde_json::{Value as Json, json};

    use super::*;

    fn drawn(display: &mut OperatorDisplay) -> String {
        display.next = Instant::now();
        let mut terminal = Terminal::new(TestBackend::new(80, 20)).unwrap();
        terminal.draw(|frame| display.draw(frame)).unwrap();
        terminal.backend().to_string()
    }

    /// Answers the requests of one client, until it leaves: a program with a key, which is what was pressed last.
    fn serve(listener: &UnixListener) {
        let (stream, _) = listener.accept().unwrap();
        let mut lines = BufReader::new(stream.try_clone().unwrap()).lines();
        let (mut stream, mut on) = (stream, false);
        while let Some(Ok(line)) = lines.next() {
            let request: Json = serde_json::from_str(&line).unwrap();
            let reply = match request["request"].as_str().unwrap() {
                "press" if request["name"] == "@CP103" => {
                    on = request["on"].as_bool().unwrap();
                    json!({"result": {"ticks": 1, "count": 1}})
                }
                "operator" => json!({"result": {
                    "state": "running", "dialect": "pmi", "program": "a/lathe.plcx", "may_press": true, "forces": 2,
                    "active": [{"kind": "fault", "name": "F", "text": "COOLANT\u{1b}[2J LOW"}],
                    "overrides": [{"label": "@FRO %", "value": "80"}],
                    "keys": [
                        {"label": "coolant", "pressed": on, "light": on, "variable": "@CP103"},
                        {"label": "ready", "light": true},
                    ],
                }}),
                other => json!({"error": {"code": "denied", "message": format!("not {other}")}}),
            };
            stream.write_all(format!("{reply}\n").as_bytes()).unwrap();
        }
    }

    #[test]
    fn an_operator_presses_keys_and_sees_when_the_control_has_left() {
        let socket = std::env::temp_dir().join(format!("plcctl-operator-{}", std::process::id()));
        let _ = std::fs::remove_file(&socket);
        let listener = UnixListener::bind(&socket).unwrap();
        let server = std::thread::spawn(move || serve(&listener));
        let mut display = OperatorDisplay::open(&socket, true).unwrap();
        let text = drawn(&mut display);
        for part in
            ["lathe.plcx (PMI) running", "! 2 FORCES !", "@FRO % 80", ". coolant", "* ready"]
        {
            assert!(text.contains(part), "{part}:\n{text}");
        }
        assert!(text.contains("C O O L A N T") && !text.contains('\u{1b}'), "{text}");
        let press = |display: &mut OperatorDisplay, code| display.key(KeyEvent::from(code));
        press(&mut display, KeyCode::Enter);
        assert!(drawn(&mut display).contains("* [coolant]"));
        press(&mut display, KeyCode::Right);
        press(&mut display, KeyCode::Enter);
        assert!(drawn(&mut display).contains("this is a lamp"));
        // A screen that stays is not left.
        press(&mut display, KeyCode::Char('q'));
        assert!(!display.is_left() && !drawn(&mut display).contains("q: leave"));
        display.stays = false;
        press(&mut display, KeyCode::Char('q'));
        assert!(display.is_left());

        display.link.client = None;
        server.join().unwrap();
        let text = drawn(&mut display);
        assert!(
            text.contains("N O   C O N T R O L") && text.contains("no control listens"),
            "{text}"
        );
        assert!(matches!(OperatorDisplay::open(&socket, false), Err(ClientError::Unreachable(_))));
        std::fs::remove_file(&socket).unwrap();
    }
}
