//! The statement displays of the three languages.

use plcc_abi::Dialect;

use crate::testing::{drawn, open};
use crate::view::{Body, Screen, StatementLayout};
use crate::{Command, View};

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
? counts
N=N+1
SOL1=A& #
  /B
IF (N>2)
 X=N*10
ELSE
 X=-1
ENDIF
L1:
Y=/SOL1
";

fn all(dialect: Dialect, text: &str, stimulus: &str, tick: u64) -> Vec<String> {
    let mut session = open(dialect, text, stimulus);
    session.run_to(tick);
    session.statements().lines.iter().map(drawn).collect()
}

#[test]
fn pmi_shows_each_value_as_its_statement_saw_it() {
    let lines = all(Dialect::Pmi, PMI, "1,A,1\n", 1);
    assert_eq!(
        lines,
        [
            "N=2=N=1+1",
            "_SOL1_=_A_&_/B_",
            "IF (N=2>2)",
            "~ X=N*10",
            "ELSE",
            " X=-1=-1",
            "ENDIF",
            "L1:",
            "Y=/SOL1",
        ]
    );
    // A scan later the other branch is executed.
    let lines = all(Dialect::Pmi, PMI, "2,B,1\n", 2);
    assert_eq!(lines[1], "SOL1=A&/B");
    assert_eq!(lines[3], " X=30=N=3*10");
    assert_eq!(lines[5], "~ X=-1");
    assert_eq!(lines[8], "_Y_=_/SOL1_");
}

#[test]
fn views_and_commands_are_json() {
    let mut session = open(Dialect::Pmi, PMI, "");
    session.run_to(1);
    let view = session.view(&Screen::Statements { first: None, count: 3 });
    let text = serde_json::to_string(&view).unwrap();
    assert!(text.contains(r#""body":{"screen":"statements","layout":"values_above""#), "{text}");
    assert_eq!(serde_json::from_str::<View>(&text).unwrap(), view);
    let command: Command = serde_json::from_str(r#"{"command":"go_to_tick","tick":0}"#).unwrap();
    session.apply(command).unwrap();
    assert_eq!(session.status().tick, 0);
    let screen: Screen = serde_json::from_str(r#"{"screen":"statements","count":3}"#).unwrap();
    let Body::Statements(view) = session.view(&screen).body else { panic!() };
    assert_eq!(view.layout, StatementLayout::ValuesAbove);
    let refusal = session.apply(Command::GoToTick { tick: 999_999 }).unwrap_err();
    assert!(refusal.message.starts_with("the ticks from 0 to "), "{refusal}");
}

#[test]
fn statements_are_chosen_by_name_as_in_pmi_5_1() {
    let mut session = open(Dialect::Pmi, PMI, "");
    session.run_to(3);
    session.apply(Command::ClearStatements).unwrap();
    assert_eq!(session.statements().total, 0);
    let find = |names: &[&str], uses, all| Command::FindNames {
        names: names.iter().map(|name| (*name).into()).collect(),
        uses,
        all,
    };
    session.apply(find(&["SOL1", "L1:"], false, true)).unwrap();
    let numbers = |session: &mut crate::Session<'_>| -> Vec<String> {
        session.statements().lines.into_iter().map(|line| line.number).collect()
    };
    assert_eq!(numbers(&mut session), ["12", "19"]);
    session.apply(find(&["X"], false, false)).unwrap();
    assert_eq!(numbers(&mut session), ["12", "15", "19"]);
    session.apply(Command::FindNext).unwrap();
    assert_eq!(numbers(&mut session), ["12", "15", "17", "19"]);
    session.apply(Command::NextStatement).unwrap();
    assert_eq!(session.statements().last_number, "20");
    assert!(session.apply(Command::NextStatement).is_err());
    assert!(session.apply(find(&["NONE"], true, true)).is_err());
}

#[test]
fn a_change_is_found_with_its_statement() {
    let mut session = open(Dialect::Pmi, PMI, "5,A,1\n");
    session.run_to(9);
    session.apply(Command::PreviousChange { name: "SOL1".into() }).unwrap();
    assert_eq!(session.status().tick, 5);
    let view = session.statements();
    assert_eq!(view.lines[view.cursor].number, "12");
}
