//! Screens as they are drawn, and what keys do.

use plcc_abi::{Dialect, GivenName};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::style::Modifier;

use super::app::App;
use crate::testing::{open, open_with_names};
use crate::{Command, Session};

/// A terminal of 80 x 24 with a session.
struct Screen {
    session: Session<'static>,
    app: App,
    terminal: Terminal<TestBackend>,
}

impl Screen {
    fn new(dialect: Dialect, program: &str, stimulus: &str, tick: u64) -> Self {
        Self::of(open(dialect, program, stimulus), tick)
    }

    fn of(mut session: Session<'static>, tick: u64) -> Self {
        session.run_to(tick);
        let app = App::new(&session);
        let terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
        Self { session, app, terminal }
    }

    /// Makes the terminal wider or narrower.
    fn resize(&mut self, width: u16) {
        self.terminal = Terminal::new(TestBackend::new(width, 12)).unwrap();
    }

    fn key(&mut self, code: KeyCode) {
        self.app.key(&mut self.session, KeyEvent::new(code, KeyModifiers::NONE));
    }

    fn keys(&mut self, text: &str) {
        text.chars().for_each(|c| self.key(KeyCode::Char(c)));
    }

    /// The screen without the numbers of ticks that depend on how fast this computer is.
    fn drawn(&mut self) -> String {
        let Self { session, app, terminal } = self;
        terminal.draw(|frame| app.draw(session, frame)).unwrap();
        let text = terminal.backend().to_string();
        let lines = text.lines().enumerate().filter(|(number, _)| *number != 1);
        lines.map(|(_, line)| line.trim_matches('"').trim_end()).collect::<Vec<_>>().join("\n")
    }

    /// The text that has an attribute, of each line.
    fn with(&mut self, modifier: Modifier) -> Vec<String> {
        self.drawn();
        let buffer = self.terminal.backend().buffer();
        let row = |y: u16| -> String {
            let cells = (0..80).map(|x| &buffer[(x, y)]);
            cells
                .filter(|cell| cell.modifier.contains(modifier))
                .map(|cell| cell.symbol())
                .collect()
        };
        (0..24).map(row).filter(|text| !text.trim().is_empty()).collect()
    }
}

const PMI: &str = "\
$INPUT
A=0/0
B=0/1
$OUTPUT
SOL1=1/0
$INTEGER
N
X
$END
N=N+1
SOL1=A&/B
IF (N>2)
 X=N*10
ENDIF
IF (N>1000)
 X=0
ENDIF
";

#[test]
fn pmi_statements_have_values_above_and_true_ones_underlined() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "1,A,1\n", 12);
    insta::assert_snapshot!(screen.drawn());
    assert_eq!(screen.with(Modifier::UNDERLINED), ["SOL1A/B"]);
    assert_eq!(screen.with(Modifier::DIM).len(), 1);
    // The directory, with one statement selected.
    screen.key(KeyCode::F(1));
    screen.key(KeyCode::Down);
    screen.key(KeyCode::Enter);
    insta::assert_snapshot!(screen.drawn());
    screen.key(KeyCode::Esc);
    let text = screen.drawn();
    assert!(text.contains("SOL1=A&/B") && !text.contains("N=N+1"), "{text}");
}

#[test]
fn inputs_and_outputs_are_overridden_after_a_warning() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "", 5);
    screen.keys("3");
    screen.key(KeyCode::F(2));
    insta::assert_snapshot!(screen.drawn());
    screen.keys("n");
    assert!(screen.session.status().forces.is_empty());
    screen.key(KeyCode::F(2));
    screen.keys("y");
    let text = screen.drawn();
    assert!(text.contains("! 1 OVERRIDE !") && text.contains("!1!"), "{text}");
    screen.keys("X");
    assert!(screen.session.status().forces.is_empty());
    // The digits choose screens and never override.
    screen.keys("o");
    assert_eq!(screen.session.status().forces.len(), 1);
    screen.keys("X1");
    assert!(screen.session.status().forces.is_empty());
    assert_eq!(screen.app.page, super::app::Page::Statements);
}

#[test]
fn variables_are_watched_in_each_format() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "1,A,1\n", 19);
    screen.keys("2i");
    screen.keys("N,A");
    screen.key(KeyCode::Enter);
    screen.keys("f");
    insta::assert_snapshot!(screen.drawn());
}

#[test]
fn nct_has_values_at_the_right() {
    let program = ":001\nI000 ; a condition\n U000\nE\n D000\nZ\nLQ00 +1 SQ00\nJ1\n:000\nJ0\n";
    let mut screen = Screen::new(Dialect::Nct, program, "2,I000,1\n", 4);
    insta::assert_snapshot!(screen.drawn());
    screen.key(KeyCode::F(9));
    assert!(!screen.drawn().contains("Q00:=5"));
    screen.key(KeyCode::F(6));
    screen.keys("Q00");
    screen.key(KeyCode::Enter);
    insta::assert_snapshot!(screen.drawn());
}

#[test]
fn pmac_says_where_each_plc_waits_and_has_a_terminal() {
    let program = "I5=2\nOPEN PLC 1 CLEAR\nP1=P1+1\nCLOSE\nOPEN PLC 2 CLEAR\nWHILE (P2<100)\n  \
                   P2=P2+1\nENDWHILE\nCLOSE\nENABLE PLC 1..2\n";
    let mut screen = Screen::new(Dialect::Pmac, program, "", 6);
    insta::assert_snapshot!(screen.drawn());
    screen.keys("5");
    insta::assert_snapshot!(screen.drawn());
    screen.keys("8");
    screen.keys("P1..2");
    screen.key(KeyCode::Enter);
    let text = screen.drawn();
    assert!(text.contains("> P1..2\n4\n3"), "{text}");
    // Letters are typed there; Esc and Tab leave.
    screen.keys("q");
    assert!(!screen.app.is_left);
    screen.key(KeyCode::Tab);
    screen.keys("q");
    assert!(screen.app.is_left);
}

#[test]
fn the_scope_draws_courses_and_cursors() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "20,A,1\n25,A,0\n", 40);
    screen.keys("7i");
    screen.keys("SOL1,N");
    screen.key(KeyCode::Enter);
    screen.session.apply(crate::Command::ScopeRange { from: 10, to: 39 }).unwrap();
    screen.drawn();
    let cursors = |screen: &mut Screen| {
        let scope = crate::view::Screen::Scope { samples: 10 };
        let crate::view::Body::Scope(view) = screen.session.view(&scope).body else { panic!() };
        view.cursors
    };
    // A cursor begins in the middle, since the tick that is shown is not seen.
    screen.keys("a");
    (0..4).for_each(|_| screen.key(KeyCode::Left));
    screen.keys("b");
    screen.key(KeyCode::Right);
    assert_eq!(cursors(&mut screen), [Some(20), Some(25)]);
    // It stays within what is shown; the same key takes it away, and brings it back.
    screen.keys(">>");
    assert_eq!(cursors(&mut screen), [Some(20), Some(39)]);
    screen.keys("b");
    assert_eq!(cursors(&mut screen), [Some(20), None]);
    screen.keys("b");
    screen.key(KeyCode::Right);
    // Without a chosen cursor the arrow keys move the tick.
    screen.key(KeyCode::Esc);
    screen.key(KeyCode::Left);
    assert_eq!((cursors(&mut screen), screen.session.status().tick), ([Some(20), Some(25)], 39));
    insta::assert_snapshot!(screen.drawn());
}

#[test]
fn panels_are_pressed_and_chosen() {
    let program = "$OUTPUT\nSOL1=1/0\n$END\n@CL100=@CP100\nSOL1=@CP102\n@STVAR[1]=@STVAR[0]\n";
    let mut screen = Screen::new(Dialect::Pmi, program, "", 5);
    screen.session.apply(crate::Command::Follow).unwrap();
    screen.keys("9");
    screen.drawn();
    // The third button of the first row.
    screen.key(KeyCode::Right);
    screen.key(KeyCode::Right);
    screen.drawn();
    screen.key(KeyCode::Enter);
    let last = screen.session.status().last_tick;
    screen.session.run_to(last + 2);
    // The next key clears the message, whose tick depends on how fast this computer is.
    screen.key(KeyCode::Up);
    insta::assert_snapshot!(screen.drawn());
    // A value that can be set, on the next panel but one.
    while !screen.drawn().contains("mach stat") {
        screen.keys("w");
    }
    screen.key(KeyCode::Right);
    screen.drawn();
    screen.session.apply(crate::Command::Follow).unwrap();
    screen.keys("e");
    screen.keys("42");
    screen.key(KeyCode::Enter);
    let last = screen.session.status().last_tick;
    screen.session.run_to(last + 2);
    let text = screen.drawn();
    assert!(text.contains("value 0 42") && text.contains("value 1 42"), "{text}");
    screen.key(KeyCode::Left);
    screen.drawn();
    screen.keys("p");
    assert!(screen.drawn().contains("nothing can be set here"));
}

#[test]
fn what_people_say_has_columns_where_there_is_room() {
    let given = |name: &str, alias: &str, text: &str, device: &str, at: &str| GivenName {
        name: name.into(),
        alias: alias.into(),
        text: text.into(),
        device: device.into(),
        at: at.into(),
        drawing: String::new(),
    };
    let names = vec![
        given("A", "DOOR", "door of the chuck closed", "-S12", "X11:7"),
        given("SOL1", "", "clamp", "-K3", ""),
    ];
    let session = open_with_names(Dialect::Pmi, PMI, "1,A,1\n", names);
    let mut screen = Screen::of(session, 19);
    screen.keys("2i");
    screen.keys("A,SOL1,N");
    screen.key(KeyCode::Enter);
    screen.resize(110);
    insta::assert_snapshot!(screen.drawn());
    screen.keys("3");
    screen.resize(150);
    insta::assert_snapshot!(screen.drawn());
    // In a narrow one the values stay.
    for (width, shown, left_out) in [
        (70, "-S12", "X11:7"),
        (62, "door of", "-S12"),
        (52, "door of", "DOOR"),
        (44, "A ", "door of"),
    ] {
        screen.keys("2");
        screen.resize(width);
        let text = screen.drawn();
        assert!(text.contains(shown) && !text.contains(left_out), "{width}: {text}");
        screen.keys("3");
        let text = screen.drawn();
        assert!(text.contains("A        1/1") && text.contains("0/0"), "{width}: {text}");
    }
}

#[test]
fn y_says_why_a_text_in_the_log_was_put_out() {
    let program = "M11->Y:$FFC2,0\nI5=2\nOPEN PLC 1 CLEAR\nIF (M11=1)\nIF (P1=0)\nSEND\"DOOR OPEN\"\nP1=1\nENDIF\nELSE\nP1=0\nENDIF\n\
                   CLOSE\nENABLE PLC 1\n";
    let mut screen = Screen::new(Dialect::Pmac, program, "0,M11,0\n4,M11,1\n", 30);
    screen.keys("4");
    let text = screen.drawn();
    assert!(text.contains("SEND DOOR OPEN"), "{text}");
    screen.keys("y");
    let text = screen.drawn();
    assert!(text.contains("SEND\"DOOR OPEN\" was executed in tick 4"), "{text}");
    assert!(text.contains("because P1 is 0 and M11 is"), "{text}");
    assert!(screen.session.status().past);
}

#[test]
fn only_a_pmac_has_a_terminal_page() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "", 5);
    screen.keys("8");
    let text = screen.drawn();
    assert!(text.contains("! only a PMAC has a terminal"), "{text}");
    assert!(text.contains("7 scope 9 panels"), "{text}");
    // The keys of the page before still work.
    screen.keys("9");
    assert_eq!(screen.app.page, super::app::Page::Panels);
    screen.key(KeyCode::BackTab);
    assert_eq!(screen.app.page, super::app::Page::Scope);
}

#[test]
fn statements_that_are_too_long_go_on_in_further_rows() {
    let program = "#define A_LONG_NAME DISPLAY 60\"A TEXT AT THE END OF THE SCREEN\"\nI5=2\nOPEN PLC 1 CLEAR\n\
                   P100=P101+P102+P103+P104+P105+P106+P107+P108+P109+P110\nCLOSE\nENABLE PLC 1\n";
    let mut screen = Screen::new(Dialect::Pmac, program, "", 6);
    let text = screen.drawn();
    assert!(text.contains("THE END OF THE SCREEN"), "{text}");
    assert!(text.contains("+P110"), "{text}");
    for number in 100..=110 {
        assert!(text.contains(&format!(" P{number}=0")) || number == 100, "{number}: {text}");
    }
    assert!(text.contains(" P100:=0") && !text.contains('…'), "{text}");
}

#[test]
fn long_messages_take_more_rows_and_typed_text_shows_its_end() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "", 5);
    let message = format!("{} THE END", "words ".repeat(24).trim_end());
    screen.app.message = Some((message, true));
    let text = screen.drawn();
    assert!(text.contains("! words") && text.contains("THE END"), "{text}");
    screen.app.message = Some(("word ".repeat(200), false));
    assert!(screen.drawn().contains('…'));
    screen.keys("2i");
    screen.keys(&"A,".repeat(300));
    screen.keys("LAST");
    let text = screen.drawn();
    assert!(text.contains("LAST_"), "{text}");
    assert!(text.contains("F7/B rollback"), "{text}");
}

#[test]
fn all_keys_and_the_help_are_seen_on_80_columns() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "", 5);
    for (page, _) in super::app::PAGES {
        screen.app.page = page;
        let text = screen.drawn();
        for key in super::keys::keys(page, true) {
            assert!(text.contains(key.label), "{}: {text}", key.label);
        }
    }
    assert!(super::keys::HELP.len() <= 24 - 5);
    for line in super::keys::HELP {
        assert!(line.chars().count() <= 80, "{line}");
    }
}

#[test]
fn every_page_fits_a_small_and_a_tiny_terminal() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "", 5);
    for (width, height) in [(80, 24), (40, 10), (10, 4), (1, 1)] {
        screen.terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        for page in "123456789?".chars() {
            screen.key(KeyCode::Esc);
            screen.key(KeyCode::Tab);
            screen.keys(&page.to_string());
            let Screen { session, app, terminal } = &mut screen;
            terminal.draw(|frame| app.draw(session, frame)).unwrap();
        }
    }
}

#[test]
fn y_says_why_a_variable_has_its_value() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "2,A,1\n6,B,1\n", 9);
    // On the statements the variable is that of the cursor's line, which can be changed.
    screen.keys("y");
    assert!(screen.drawn().contains("why (a variable, or the text of a message): N_"));
    screen.key(KeyCode::Backspace);
    screen.keys("sol1");
    screen.key(KeyCode::Enter);
    let text = screen.drawn();
    assert!(text.contains("SOL1 has been 0 since tick 6 (0.12 s), because B is 1."), "{text}");
    assert!(
        text.contains(">  └─ B has been 1 since tick 6 (0.12 s)   set by the stimulus"),
        "{text}"
    );
    assert!(text.contains("The next scan would make SOL1 1 with B = 0."), "{text}");
    assert!(!screen.session.status().following);
    // Enter goes on to the selected line.
    screen.key(KeyCode::Enter);
    let text = screen.drawn();
    assert!(
        text.contains("B has been 1 since tick 6 (0.12 s): the stimulus has set it."),
        "{text}"
    );
    // Esc goes back to the screen from which was asked.
    screen.key(KeyCode::Esc);
    assert!(screen.drawn().contains("SOL1=A&/B"));
    // Among inputs and outputs the selected one is meant, at the tick that is shown.
    screen.keys("3");
    screen.key(KeyCode::Left);
    for _ in 0..3 {
        screen.key(KeyCode::Left);
    }
    let tick = screen.session.status().tick;
    screen.keys("y");
    let text = screen.drawn();
    let since =
        if tick >= 6 { "SOL1 has been 0 since tick 6" } else { "SOL1 has been 1 since tick 2" };
    assert!(text.contains(since), "{tick}: {text}");
    // An unknown name is refused, and the screen stays.
    screen.key(KeyCode::Esc);
    screen.keys("1y");
    screen.key(KeyCode::Backspace);
    screen.keys("NOBODY");
    screen.key(KeyCode::Enter);
    let text = screen.drawn();
    assert!(text.contains("no variable named `NOBODY`") && text.contains("SOL1=A&/B"), "{text}");
}

#[test]
fn an_event_is_asked_for_in_its_tick() {
    let program = "$INPUT\nA=0/0\n$FAULT\nFLT=\"A IS ON\"\n$END\nFLT=A\n";
    let stimulus = "2,A,1\n4,A,0\n";
    let mut screen = Screen::new(Dialect::Pmi, program, stimulus, 9);
    screen.keys("4");
    // The newest event is the first row, since no fault is on.
    screen.key(KeyCode::Down);
    screen.drawn();
    screen.keys("y");
    let text = screen.drawn();
    assert!(text.contains("FLT has been 1 since tick 2 (0.04 s), because A is 1."), "{text}");
    assert!(text.contains("The control shows the fault \"A IS ON\"."), "{text}");
    assert_eq!(screen.session.status().tick, 2);
}

#[test]
fn the_past_says_so() {
    let mut screen = Screen::new(Dialect::Pmi, PMI, "1,A,1\n", 9);
    let line = |screen: &mut Screen| {
        screen.drawn();
        screen.terminal.backend().to_string().lines().nth(1).unwrap().to_owned()
    };
    screen.key(KeyCode::Char(' '));
    assert!(!line(&mut screen).contains("PAST"));
    screen.key(KeyCode::Char(' '));
    for _ in 0..3 {
        screen.key(KeyCode::Left);
    }
    let past = line(&mut screen);
    assert!(past.contains("PAST tick "), "{past}");
    let cell = screen.terminal.backend().buffer()[(0, 1)].clone();
    assert_eq!(cell.bg, ratatui::style::Color::Yellow);
    // What is forced is said on each screen.
    screen.keys("3oy");
    assert!(screen.drawn().contains("is forced to 1"));
    screen.keys("2");
    assert!(screen.drawn().contains("forced: SOL1=1"));
}

#[test]
fn an_operator_sees_messages_and_presses_the_keys_that_the_program_uses() {
    let program = "$FAULT\nFLT=\"COOLANT LOW\"\n$END\n@CL103=@CP103\nFLT=@CP103\n@FRO=80\n";
    let name =
        GivenName { name: "@CP103".into(), text: "coolant 103".into(), ..GivenName::default() };
    let mut session = open_with_names(Dialect::Pmi, program, "", vec![name]);
    session.run_to(5);
    session.operator = true;
    let app = App::new(&session);
    let terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
    let mut screen = Screen { session, app, terminal };
    let text = screen.drawn();
    assert!(text.contains("no fault and no message"), "{text}");
    // Of the control's many keys the program uses one.
    assert!(!text.contains("104") && text.contains("@FRO % 80"), "{text}");
    assert!(text.contains(". coolant 103"), "{text}");
    screen.key(KeyCode::Enter);
    let next = screen.session.status().last_tick + 2;
    screen.session.operator = false;
    screen.session.apply(Command::Follow).unwrap();
    screen.session.run_to(next);
    screen.session.operator = true;
    let text = screen.drawn();
    assert!(text.contains("C O O L A N T   L O W"), "{text}");
    // Nothing else can be done, by no key and by no command.
    for keys in ["1", "3", "ez", "g", "y", "S"] {
        screen.keys(keys);
        assert_eq!(screen.app.page, super::app::Page::Operator);
        assert!(screen.app.prompt.is_none());
    }
    let set = |name: &str| Command::Change { name: name.into(), value: "1".into() };
    for command in [set("FLT"), set("@CP104"), set("@FRO"), Command::ReleaseAll, Command::Rollback]
    {
        let refused = screen.session.apply(command).unwrap_err();
        assert!(refused.message.contains("changes nothing else"), "{refused}");
    }
    let view = screen.session.view(&crate::view::Screen::Directory);
    assert!(matches!(view.body, crate::view::Body::Status { reason: Some(_) }));
}
