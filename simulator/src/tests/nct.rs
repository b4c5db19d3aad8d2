//! The control beside an NCT program.

use plcc_abi::Dialect;

use super::Desk;
use crate::event::{Awaited, Told};

const SEEN: [&str; 7] = ["I546", "I550", "I551", "I553", "I547", "I610", "SIM"];

/// A control that is on, with 100 % everywhere, FIN and the feed's permission.
pub(super) fn ready(machine: &str, part: Option<&str>) -> Desk {
    let mut desk = Desk::new(Dialect::Nct, machine, &[], part);
    for name in ["Y540", "Y547", "Y650"] {
        desk.set(name, 1);
    }
    for (register, code) in [("RH078", 13), ("RH079", 5), ("RH089", 13)] {
        desk.set(register, code);
    }
    if part.is_some() {
        desk.set("Y406", 1);
    }
    desk.step();
    desk
}

#[test]
fn machine_on_follows_its_request_and_a_fault_takes_it_away() {
    let mut desk = Desk::new(Dialect::Nct, "", &[], None);
    assert_eq!(desk.see(["I540", "I541", "I542", "I550", "I560", "RH028"]), [0, 1, 0, 1, 1, 13]);
    desk.set("Y540", 1);
    assert_eq!(desk.see(["I540"]), [1]);
    desk.key("SERVO 2", 1);
    assert_eq!(desk.see(["I540", "I542", "I537", "RH020"]), [0, 1, 1, 1]);
    desk.key("SERVO 2", 0);
    assert_eq!(desk.see(["I540"]), [0], "until the run ends");
}

#[test]
fn functions_are_handed_over_by_strobes_of_one_slice_and_wait_for_fin() {
    let mut desk = ready("", Some("M3 S500 T7\nM30\n"));
    assert_eq!(desk.get("I546"), 1);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I520", "RH000", "I525", "RH005", "I526", "RH006"]), [1, 3, 1, 500, 1, 7]);
    desk.set("Y547", 0);
    assert_eq!(desk.see(["I520", "I525", "RH000", "I550"]), [0, 0, 3, 1]);
    for _ in 0..3 {
        assert_eq!(desk.see(["I520"]), [0]);
    }
    desk.set("Y547", 1);
    assert_eq!(desk.see(["I520", "RH000"]), [1, 30], "the next block starts with FIN");
    assert_eq!(desk.see(["I546", "I520"]), [0, 0], "FIN was never taken away");
    assert_eq!(desk.see(["I546"]), [0]);
    desk.set("Y470", 0);
    assert_eq!(desk.see(["I546"]), [1], "the program stands at its first block");
}

#[test]
fn a_way_sets_the_flags_of_interpolation_and_a_stop_takes_its_time() {
    let mut desk = ready("", Some("G1 X2 F3000\nM30\n"));
    desk.set("Y470", 1);
    // 1 mm in a tick of 20 ms.
    assert_eq!(desk.see(SEEN), [1, 0, 0, 1, 0, 1, 0]);
    assert_eq!(desk.see(["RH100"]), [0]);
    desk.set("Y470", 0);
    for _ in 0..5 {
        assert_eq!(desk.see(["I550", "I610"]), [0, 1]);
    }
    assert_eq!(
        desk.see(["I550", "I551", "I610", "I553"]),
        [1, 0, 0, 1],
        "100 ms after START was let go"
    );
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I550", "I610"]), [0, 1], "no movement in this step");
    desk.step();
    // The end: the last part is done, and with FIN the block.
    assert_eq!(desk.see(["I550", "I551", "I553", "I610", "RH000"]), [1, 1, 0, 0, 30]);
    desk.step();
    assert_eq!(desk.see(["RH100", "RH102"]), [2000, 0]);
}

#[test]
fn feed_waits_for_its_permission_and_axes_for_theirs() {
    let mut desk = ready("", Some("G1 X5 F3000\nG0 X0\nM30\n"));
    desk.set("Y650", 0);
    desk.set("Y470", 1);
    for _ in 0..501 {
        desk.step();
    }
    let waits = Told::Waits(Awaited::Feed);
    assert_eq!(desk.told.iter().filter(|(_, told)| *told == waits).count(), 1);
    assert_eq!(desk.get("RH102"), 0);
    desk.set("Y650", 1);
    desk.set("Y610", 1);
    assert_eq!(desk.see(["RH102", "I610"]), [0, 1]);
    desk.set("Y610", 0);
    assert_eq!(desk.see(["RH102", "I560"]), [1000, 0]);
}

#[test]
fn a_limit_switch_stops_the_way_and_holds_the_blocks() {
    let mut desk = ready("", Some("G1 X5 F3000\nM30\n"));
    desk.set("Y470", 1);
    desk.step();
    desk.set("Y560", 1);
    assert_eq!(desk.see(["I547", "I550", "RH020"]), [1, 0, 1340]);
    for _ in 0..5 {
        desk.step();
    }
    assert_eq!(desk.get("I550"), 1);
    desk.set("Y560", 0);
    assert_eq!(desk.see(["I550", "I547", "RH020"]), [0, 1, 0]);
}

#[test]
fn single_block_stops_between_two_blocks_until_start_comes_again() {
    let mut desk = ready("", Some("G4 P0.02\nG4 P0.02\nM30\n"));
    desk.set("Y447", 1);
    desk.set("Y470", 1);
    desk.step();
    assert_eq!(desk.see(["I547", "I551"]), [1, 1]);
    assert_eq!(desk.see(["I551"]), [1], "nothing starts");
    desk.set("Y470", 0);
    assert_eq!(desk.see(["I547"]), [0]);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I551", "I550"]), [0, 0]);
}

#[test]
fn reset_drops_the_block_and_a_second_one_the_interruption() {
    let mut desk = ready("", Some("G1 X50 F3000\nM30\n"));
    desk.set("Y470", 1);
    desk.step();
    desk.step();
    desk.set("I477", 1);
    assert_eq!(desk.see(["I511", "I550"]), [0, 0]);
    for _ in 0..4 {
        assert_eq!(desk.see(["I511"]), [0]);
    }
    assert_eq!(desk.see(["I511", "I550", "I551", "I553"]), [1, 1, 1, 0]);
    desk.set("I477", 0);
    desk.set("Y470", 0);
    desk.step();
    desk.set("I477", 1);
    assert_eq!(desk.see(["I511", "I546"]), [0, 1]);
}

#[test]
fn an_entered_block_is_executed_once() {
    let mut desk = ready("[simulator]\nblocks = [\"M8\", \"G4 P1\"]\n", None);
    assert_eq!(desk.get("I546"), 0);
    desk.key("BLOCK 1", 1);
    assert_eq!(desk.see(["I546"]), [1]);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I520", "RH000"]), [1, 8]);
    assert_eq!(desk.told.last(), Some(&(desk.tick - 1, Told::Entry(1))));
    assert_eq!(desk.see(["I546", "I520"]), [0, 0]);
    assert_eq!(desk.see(["I546", "I520"]), [0, 0]);
}

#[test]
fn the_spindle_is_reported_at_its_speed_and_standing() {
    let mut desk = ready("", None);
    desk.set("RH060", 600);
    assert_eq!(desk.see(["RH011", "I650", "I656", "I657", "RH010"]), [600, 1, 1, 1, 0]);
    desk.set("Y652", 1);
    desk.set("Y653", 1);
    // 60 a tick; the actual speed is five ticks behind.
    for tick in 1..=9 {
        let expected = (tick - 5).max(0) * 60;
        assert_eq!(desk.see(["I650", "RH010"]), [0, expected]);
    }
    assert_eq!(desk.see(["I650", "I656", "RH010"]), [1, 0, 300]);
    for _ in 0..4 {
        desk.step();
    }
    assert_eq!(desk.see(["I656", "RH010", "I657"]), [1, 600, 0]);
    desk.set("Y652", 0);
    assert_eq!(desk.see(["I656", "RH010"]), [0, 600]);
    for _ in 0..5 {
        desk.step();
    }
    assert_eq!(desk.see(["I656", "I657", "RH010"]), [1, 1, 0]);
}

#[test]
fn the_active_message_stays_until_the_program_takes_it_away() {
    let mut desk = ready("", None);
    desk.set("Y712", 1);
    assert_eq!(desk.see(["RH020", "I712", "I537"]), [2002, 1, 1]);
    desk.set("Y700", 1);
    assert_eq!(desk.see(["RH020", "I712", "I700"]), [2002, 1, 0]);
    desk.set("Y712", 0);
    assert_eq!(desk.see(["RH020", "I712", "I700"]), [2500, 0, 1]);
    desk.set("Y700", 0);
    assert_eq!(desk.see(["RH020", "I700", "I537"]), [0, 0, 0]);
}

#[test]
fn a_key_counts_only_where_the_program_selects_it() {
    let mut desk = ready("", None);
    desk.key("AUTO", 1);
    assert_eq!(desk.see(["I406"]), [0]);
    desk.set("Y532", 1);
    desk.key("AUTO", 1);
    assert_eq!(desk.see(["I406"]), [1]);
    let note = "KEY.AUTO did nothing in tick 1: the program does not select it by Y520 and Y532";
    assert_eq!(desk.simulator.notes(), [note]);
}

#[test]
fn an_interrupted_block_goes_on_after_two_starts_and_an_answer() {
    let mut desk = ready("", Some("M3 G1 X5 F3000\nM30\n"));
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I520"]), [1]);
    desk.step();
    assert_eq!(desk.see(["I550"]), [0]);
    // Two millimetres are done when automatic mode is left.
    desk.set("Y406", 0);
    for _ in 0..5 {
        assert_eq!(desk.see(["I511"]), [0]);
    }
    assert_eq!(desk.see(["I511", "I550", "I551", "I546"]), [1, 1, 0, 0]);
    desk.set("Y470", 0);
    desk.set("Y406", 1);
    assert_eq!(desk.see(["I546", "I511", "I547"]), [1, 1, 0]);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I547", "RH020"]), [1, 0]);
    desk.set("Y470", 0);
    assert_eq!(desk.see(["I547", "RH020"]), [0, 3549]);
    desk.key("Y", 1);
    assert_eq!(desk.see(["RH020", "I511"]), [0, 1]);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I511", "I550", "I553", "I520", "RH100"]), [0, 0, 1, 0, 2000]);
    for _ in 0..2 {
        assert_eq!(desk.see(["I551"]), [0]);
    }
    assert_eq!(desk.see(["I551", "RH000"]), [1, 30], "three millimetres were left");
}

#[test]
fn reset_ends_an_interruption_and_y443_begins_the_block_anew() {
    for anew in [0, 1] {
        let mut desk = ready("", Some("M3 G4 P0.1\nM30\n"));
        desk.set("Y470", 1);
        desk.step();
        desk.step();
        desk.set("Y540", 0);
        assert_eq!(desk.see(["I511", "I540", "I550"]), [1, 0, 1]);
        desk.set("Y540", 1);
        desk.set("Y443", anew);
        desk.step();
        desk.set("Y470", 0);
        desk.step();
        desk.key("N", 1);
        desk.set("Y470", 1);
        assert_eq!(desk.see(["I511", "I520"]), [0, anew]);
        // Five ticks of G4, of which one was done.
        let ticks = 4 + anew;
        for _ in 1..ticks {
            assert_eq!(desk.see(["I551"]), [0]);
        }
        assert_eq!(desk.see(["I551"]), [1]);
    }
}

#[test]
fn a_spindle_is_oriented_after_its_time_and_follows_the_other_one() {
    let mut desk = ready("", None);
    desk.set("RH061", -100);
    desk.set("Y652", 1);
    desk.set("Y651", 1);
    // 25 ticks from the first one with a speed.
    for _ in 0..25 {
        assert_eq!(desk.see(["I651"]), [0]);
    }
    assert_eq!(desk.see(["I651", "I652", "I650"]), [1, 0, 0]);
    for _ in 0..4 {
        assert_eq!(desk.see(["I652", "I650"]), [0, 1]);
    }
    assert_eq!(desk.see(["I651", "I652", "RH010"]), [1, 1, 0]);
    desk.set("Y651", 0);
    assert_eq!(desk.see(["I651", "I652"]), [0, 0]);

    let mut desk = ready("", None);
    for (name, value) in
        [("RH060", 300), ("Y652", 1), ("Y653", 1), ("Y662", 1), ("Y665", 1), ("Y666", 1)]
    {
        desk.set(name, value);
    }
    for _ in 0..80 {
        desk.step();
    }
    assert_eq!(desk.see(["RH010", "RH015", "I661", "I664"]), [300, 300, 1, 1]);
    desk.set("Y665", 0);
    assert_eq!(desk.see(["I661", "I664"]), [0, 0]);
}

#[test]
fn start_in_automatic_mode_is_held_at_once_while_a_block_is_put_aside() {
    let mut desk = ready("", Some("G1 X5 F3000\nM30\n"));
    desk.set("Y470", 1);
    desk.step();
    desk.set("Y540", 0);
    assert_eq!(desk.see(["I511", "I547"]), [1, 0]);
    // Neither the machine nor the buffer has to be ready for this answer to START.
    assert_eq!(desk.see(["I547", "I540"]), [1, 0]);
    desk.set("Y470", 0);
    assert_eq!(desk.see(["I547", "RH020"]), [0, 3549]);
    desk.set("Y406", 0);
    assert_eq!(desk.see(["RH020"]), [3549], "the question stays in every mode");
    desk.key("N", 1);
    assert_eq!(desk.see(["RH020"]), [0]);
}

#[test]
fn a_spindle_that_was_oriented_reaches_synchronism_anew() {
    let mut desk = ready("", None);
    for (name, value) in [("RH061", -100), ("Y652", 1), ("Y651", 1), ("Y655", 1)] {
        desk.set(name, value);
    }
    for _ in 0..30 {
        desk.step();
    }
    assert_eq!(desk.see(["I651", "I652", "I663"]), [1, 1, 0]);
    desk.set("Y651", 0);
    for _ in 0..25 {
        assert_eq!(desk.see(["I651", "I663"]), [0, 0]);
    }
    assert_eq!(desk.see(["I651", "I663"]), [1, 0]);
}

#[test]
fn reset_takes_the_question_away_beside_an_entered_block_too() {
    let mut desk = ready("[simulator]\nblocks = [\"G4 P1\"]\n", Some("G1 X5 F3000\nM30\n"));
    desk.set("Y470", 1);
    desk.step();
    desk.set("Y540", 0);
    desk.step();
    desk.step();
    desk.set("Y540", 1);
    desk.set("Y470", 0);
    desk.set("Y406", 0);
    desk.key("BLOCK 1", 1);
    assert_eq!(desk.see(["RH020", "I511", "I546"]), [3549, 1, 1]);
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I551", "RH020"]), [0, 3549], "the entered block is executed");
    desk.set("I477", 1);
    assert_eq!(desk.see(["RH020", "I511"]), [0, 1]);
}

#[test]
fn a_spindle_is_oriented_or_followed_at_once_where_that_takes_no_time() {
    let times = "ramp_ms = 0\nlag_ms = 0\norient_ms = 0\n";
    let machine = format!("[simulator.spindle]\n{times}[simulator.spindle2]\n{times}");
    let mut desk = ready(&machine, None);
    desk.set("RH061", -100);
    desk.set("Y652", 1);
    desk.set("Y651", 1);
    assert_eq!(desk.see(["I651", "I652", "I650", "RH010"]), [1, 1, 0, 0]);
    desk.set("Y651", 0);
    desk.set("RH060", 300);
    desk.set("Y653", 1);
    desk.set("Y662", 1);
    desk.set("Y665", 1);
    assert_eq!(desk.see(["RH010", "RH015", "I661", "I664"]), [300, 300, 1, 1]);
}

#[test]
fn serial_data_are_characters_and_wait_for_enough_of_them() {
    let mut desk = ready("[simulator]\nserial = \"\u{e4}B345\"\n", None);
    desk.set("RH054", 20);
    desk.set("RH055", 3);
    desk.set("Y605", 1);
    assert_eq!(desk.see(["I607", "F020"]), [0, 0]);
    assert_eq!(desk.see(["I607", "F020", "F021", "F022"]), [1, 0xE4, 0x42, 0x33]);
    desk.set("Y607", 1);
    assert_eq!(desk.see(["I607"]), [0]);
    desk.set("Y607", 0);
    for _ in 0..5 {
        assert_eq!(desk.see(["I607"]), [0], "two characters are left, and three are asked for");
    }
    // None at all are there at once.
    desk.set("RH055", 0);
    assert_eq!(desk.see(["I607"]), [1]);
}

#[test]
fn an_axis_that_the_interrupted_block_does_not_name_stays_where_it_was_moved() {
    let mut desk = ready("[simulator]\nblocks = [\"G0 Y1\"]\n", Some("G1 X5 F3000\nM30\n"));
    desk.set("Y470", 1);
    desk.step();
    desk.step();
    desk.set("Y540", 0);
    assert_eq!(desk.see(["I511"]), [1]);
    desk.set("Y540", 1);
    desk.step();
    // In another mode, an entered block moves Y.
    desk.set("Y406", 0);
    desk.key("BLOCK 1", 1);
    desk.set("Y470", 0);
    desk.step();
    desk.set("Y470", 1);
    while desk.see(["I546"]) == [1] {}
    assert_eq!(desk.get("I511"), 1);
    desk.set("Y406", 1);
    desk.set("Y470", 0);
    desk.key("N", 1);
    desk.step();
    desk.set("Y470", 1);
    assert_eq!(desk.see(["I511", "I610", "I611", "RH105"]), [0, 1, 0, 1000]);
    while desk.see(["I551"]) == [0] {}
    assert_eq!(desk.see(["RH107"]), [0]);
}
