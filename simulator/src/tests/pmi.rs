//! The control beside a PMI program, by hand-made handshakes.

use plcc_abi::Dialect;
use plcc_abi::pmi::DeclaredCode;

use super::{Desk, mistakes};
use crate::event::{Awaited, Refusal, Requested, Told};

const M3: DeclaredCode = DeclaredCode { letter: 'M', number: 3, delayed: false };
const M5: DeclaredCode = DeclaredCode { letter: 'M', number: 5, delayed: true };

/// A control whose machine is on, in automatic mode.
fn ready(machine: &str, part: &str) -> Desk {
    let mut desk = Desk::new(Dialect::Pmi, machine, &[M3, M5], Some(part));
    desk.set("@MONRQ", 1);
    desk.step();
    assert_eq!((desk.get("@MXRDY"), desk.get("@ESTOP")), (1, 1));
    desk.set("@MCRDY", 1);
    desk.set("@MODRQ", 2);
    desk.step();
    assert_eq!((desk.get("@ESTOP"), desk.get("@MODE")), (0, 2));
    desk
}

fn start(desk: &mut Desk) {
    desk.set("@CYCRQ", 1);
}

#[test]
fn machine_on_needs_the_request_to_be_held_and_the_machine_to_be_ready_in_time() {
    let mut desk = Desk::new(Dialect::Pmi, "", &[], None);
    desk.set("@MONRQ", 1);
    desk.step();
    for _ in 0..99 {
        assert_eq!(desk.see(["@MXRDY", "@ESTOP"]), [1, 1]);
    }
    assert_eq!(desk.see(["@MXRDY"]), [0], "after 2000 ms");
    desk.set("@MONRQ", 0);
    desk.step();
    desk.set("@MONRQ", 1);
    assert_eq!(desk.see(["@MXRDY"]), [1]);
    desk.set("@MONRQ", 0);
    assert_eq!(desk.see(["@MXRDY"]), [0]);
    // The button wins over a rising request.
    desk.set("@MONRQ", 1);
    desk.set("@ESTPB", 1);
    assert_eq!(desk.see(["@MXRDY"]), [0]);
    desk.set("@ESTPB", 0);
    assert_eq!(desk.see(["@MXRDY"]), [0], "unlatching starts nothing");
}

#[test]
fn prompt_codes_come_before_the_movement_and_delayed_ones_after_it() {
    let mut desk = ready("[simulator]\nunits = \"mm\"\n", "M3 M5 S500 G1 X0.5 F1500\nM30\n");
    start(&mut desk);
    assert_eq!(desk.see(["@M03", "@NEWSC", "@M05", "@AXACT[0]", "@BKACT"]), [1, 1, 0, 0, 1]);
    desk.set("@M03", 0);
    assert_eq!(desk.see(["@AXACT[0]"]), [0], "@NEWSC is still 1");
    desk.set("@NEWSC", 0);
    // 0.5 mm at 25 mm a second: one tick.
    assert_eq!(desk.see(["@AXACT[0]", "@M05", "@MVACT"]), [1, 0, 1]);
    assert_eq!(desk.see(["@AXACT[0]", "@M05", "@CMDRG[0]"]), [0, 1, 5000]);
    assert_eq!(desk.see(["@BKACT", "SIM"]), [1, 0]);
    desk.set("@M05", 0);
    let [active, end] = desk.see(["@BKACT", "@PGMSE"]);
    assert_eq!((active, end), (1, 0), "the next block begins in the same step");
    assert_eq!(desk.see(["@BKACT", "@PGMSE", "@CYCIP"]), [0, 2, 0]);
    assert_eq!(desk.told.last(), Some(&(desk.tick - 1, Told::End)));
}

#[test]
fn feed_hold_keeps_the_axes_where_they_are() {
    let mut desk = ready("[simulator]\nunits = \"mm\"\n", "G1 X10 F3000\nM30\n");
    start(&mut desk);
    desk.step();
    assert_eq!(desk.see(["@CMDRG[0]", "@CYCIP"]), [10_000, 1]);
    desk.set("@FHRQ", 1);
    assert_eq!(
        desk.see(["@CMDRG[0]", "@FHOLD", "@CYCIP", "@BKACT", "@AXACT[0]"]),
        [10_000, 1, 0, 1, 0]
    );
    desk.set("@CYCRQ", 0);
    desk.step();
    start(&mut desk);
    desk.step();
    let refused = Told::Refused(Requested::CycleStart, Refusal::FeedHoldRequest);
    assert_eq!(desk.told.last(), Some(&(desk.tick - 1, refused)));
    desk.set("@FHRQ", 0);
    desk.set("@CYCRQ", 0);
    desk.step();
    start(&mut desk);
    assert_eq!(desk.see(["@FHOLD", "@CMDRG[0]"]), [0, 20_000]);
    desk.set("@FRO", 50);
    assert_eq!(desk.see(["@CMDRG[0]"]), [25_000]);
    desk.set("@MFHRQ", 1);
    assert_eq!(desk.see(["@CMDRG[0]", "@AXACT[0]", "@CYCIP"]), [25_000, 0, 1]);
}

#[test]
fn single_block_and_manual_mode_count_at_the_end_of_a_block() {
    let mut desk = ready("", "G4 P0.06\nG4 P0.02\nM30\n");
    start(&mut desk);
    desk.step();
    desk.set("@MODRQ", 1);
    assert_eq!(desk.see(["@MODE", "@BKACT"]), [1, 1]);
    assert_eq!(desk.see(["@BKACT"]), [1]);
    assert_eq!(desk.see(["@BKACT"]), [0], "three ticks of G4 after the first step");
    desk.set("@CYCRQ", 0);
    desk.step();
    start(&mut desk);
    assert_eq!(desk.see(["@BKACT"]), [1]);
    desk.set("@MODRQ", 0);
    assert_eq!(desk.see(["@BKACT", "@MODE"]), [0, 0], "the block ends, and with it automatic mode");
    desk.set("@CYCRQ", 0);
    desk.step();
    start(&mut desk);
    desk.step();
    let refused = Told::Refused(Requested::CycleStart, Refusal::Manual);
    assert_eq!(desk.told.last(), Some(&(desk.tick - 1, refused)));
}

#[test]
fn emergency_stop_drops_the_block_with_its_codes() {
    let mut desk = ready("", "M3 S500 G0 X1\nM30\n");
    start(&mut desk);
    assert_eq!(desk.see(["@M03", "@NEWSC", "@BKACT"]), [1, 1, 1]);
    desk.set("@ESTPB", 1);
    let names = ["@ESTOP", "@MXRDY", "@M03", "@NEWSC", "@BKACT", "@MODE"];
    assert_eq!(desk.see(names), [1, 0, 0, 0, 0, 0]);
}

#[test]
fn what_a_block_waits_for_is_told_once() {
    let mut desk = ready("", "M3\nM30\n");
    start(&mut desk);
    desk.step();
    let began = desk.tick - 1;
    for _ in 0..1200 {
        desk.step();
    }
    let waits: Vec<_> =
        desk.told.iter().filter(|(_, told)| matches!(told, Told::Waits(_))).collect();
    assert_eq!(waits, [&(began + 500, Told::Waits(Awaited::Code(0)))]);
    assert_eq!(desk.simulator.notes(), ["line 1 of the part program still waits for @M03"]);
}

#[test]
fn the_spindle_follows_its_voltage_with_a_ramp() {
    let mut desk = ready("", "M30\n");
    desk.set("@SPDAC", -32_767);
    assert_eq!(desk.see(["@SSRPM"]), [55]);
    assert_eq!(desk.see(["@SSRPM"]), [110]);
    desk.set("@SPDAC", 0);
    assert_eq!(desk.see(["@SSRPM"]), [55]);
    desk.set("@ASIM", 1);
    desk.set("@CSRPM", 777);
    assert_eq!(desk.see(["@SSRPM"]), [777]);
}

#[test]
fn control_reset_clears_faults_and_gives_one_pulse() {
    let mut desk = Desk::new(Dialect::Pmi, "", &[], None);
    desk.set("@FLTAC[3]", 1);
    desk.set("@CRRQ", 1);
    assert_eq!(desk.see(["@CRSET", "@FLTAC[3]"]), [1, 0]);
    desk.set("@CRSET", 0);
    assert_eq!(desk.see(["@CRSET"]), [0]);
}

#[test]
fn mistakes_of_a_part_program_stand_at_their_places() {
    let of = |part: &str| mistakes(Dialect::Pmi, "", part);
    assert_eq!(
        of(
            "G1 X1 Q2 F5\nG0 X1 X2\nF0\nG72\nG0 G1 X1 F1\nM300\nX5 (open\nG4\nG61 X1\n%G\n/2 M8\n N5 M9\nM30 P1"
        ),
        [
            ("SIM-2", 1, 7),
            ("SIM-3", 2, 7),
            ("SIM-4", 3, 1),
            ("SIM-5", 4, 1),
            ("SIM-6", 5, 4),
            ("SIM-4", 6, 1),
            ("SIM-1", 7, 4),
            ("SIM-13", 8, 1),
            ("SIM-13", 9, 1),
            ("SIM-12", 11, 1),
            ("SIM-11", 12, 5),
            ("SIM-2", 13, 5),
            ("SIM-10", 13, 1),
        ]
    );
    // A wrong line leaves what is modal alone; skipped blocks count.
    assert_eq!(
        of("F100 Q\n/G1 X1\nM98 M30\nM30"),
        [("SIM-1", 1, 6), ("SIM-8", 2, 5), ("SIM-5", 3, 1)]
    );
    assert_eq!(of("/F100\nG1 X1\nX1 Y2 G4 P1\nM30"), [("SIM-6", 3, 7)]);
    assert_eq!(
        mistakes(Dialect::Nct, "", "M1 M2 M3 M4 M5 M6\n/9 S65536\n/0 M30"),
        [("SIM-7", 1, 16), ("SIM-4", 2, 4), ("SIM-12", 3, 1), ("SIM-10", 3, 1),]
    );
}

#[test]
fn axes_are_jogged_as_long_as_the_request_stays_and_by_increments() {
    let mut desk = ready("", "M30\n");
    desk.set("@MODRQ", 0);
    desk.step();
    desk.set("@JGINC", 1);
    desk.set("@AXRRQ[0]", 1);
    assert_eq!(desk.see(["@AXACT[0]", "@CMDRG[0]", "@MVACT"]), [1, 0, 1]);
    // 60 inches a minute: 0.02 in a tick.
    assert_eq!(desk.see(["@CMDRG[0]"]), [200]);
    assert_eq!(desk.see(["@CMDRG[0]"]), [400]);
    desk.set("@AXRRQ[0]", 0);
    assert_eq!(desk.see(["@CMDRG[0]", "@AXACT[0]"]), [400, 0]);
    // A tenth of an inch, which goes on without its request.
    desk.set("@JGINC", 5);
    desk.set("@AXRRQ[0]", 2);
    desk.step();
    desk.set("@AXRRQ[0]", 0);
    for counts in [200, 0, -200, -400, -600] {
        assert_eq!(desk.see(["@CMDRG[0]"]), [counts]);
    }
    assert_eq!(desk.see(["@CMDRG[0]", "@AXACT[0]"]), [-600, 0]);
    // Zero set: the part program begins there.
    desk.set("@AXRRQ[0]", 5);
    assert_eq!(desk.see(["@CMDRG[0]", "@AXACT[0]"]), [-600, 0]);
    desk.set("@AXRRQ[0]", 0);
    desk.step();
}

#[test]
fn an_axis_finds_its_reference_point_and_keeps_its_limits_then() {
    let machine = "[simulator]\nhome_ms = 60\n[[simulator.axis]]\nname = \"X\"\nhome = 0.03\nmax = 0.5\n\
                   [[simulator.axis]]\nname = \"Z\"\n";
    let mut desk = ready(machine, "M30\n");
    desk.set("@MODRQ", 0);
    desk.step();
    desk.set("@AXRRQ[0]", 3);
    assert_eq!(desk.see(["@NHOME[0]", "@CMDRG[0]"]), [1, 0]);
    for counts in [100, 200] {
        assert_eq!(desk.see(["@NHOME[0]", "@CMDRG[0]"]), [1, counts]);
    }
    assert_eq!(desk.see(["@NHOME[0]", "@CMDRG[0]", "@AXACT[0]"]), [0, 300, 0]);
    desk.set("@AXRRQ[0]", 0);
    desk.step();
    desk.set("@AXRRQ[0]", 1);
    for _ in 0..6 {
        desk.step();
    }
    assert_eq!(desk.get("@CMDRG[0]"), 5000);
    assert!(desk.told.iter().any(|(_, told)| *told == Told::Limit(0, true)));
    desk.set("@AXRRQ[1]", 1);
    desk.step();
    let refused = Told::Refused(Requested::Jog(1), Refusal::Limit);
    assert_eq!(desk.told.last(), Some(&(desk.tick - 1, refused)));
}

#[test]
fn arcs_stay_on_their_circle_and_end_exactly() {
    let machine = "[simulator]\nunits = \"mm\"\n[[simulator.axis]]\nname = \"X\"\ncounts = 1000000\n\
                   [[simulator.axis]]\nname = \"Y\"\ncounts = 1000000\n[[simulator.axis]]\nname = \"Z\"\n";
    let mut ways = vec![];
    for arc in ["G3 X-10 Y10 I-10 J0", "G3 X-10 Y10 R10"] {
        let mut desk = ready(machine, &format!("F3000 {arc}\nM30\n"));
        start(&mut desk);
        assert_eq!(desk.see(["@INTRP", "@AXACT[0]", "@AXACT[1]", "@AXACT[2]"]), [1, 1, 1, 0]);
        let mut way = vec![];
        // 15.7 mm at 1 mm a tick.
        while desk.see(["@BKACT"]) == [1] {
            let [x, y] = [desk.get("@CMDRG[0]") as f64, desk.get("@CMDRG[1]") as f64];
            assert!(((x + 1e7).hypot(y) - 1e7).abs() < 1.0, "{x} {y}");
            way.push((x as i64, y as i64));
        }
        assert_eq!(way.len(), 16, "{arc}");
        assert_eq!(way.last(), Some(&(-10_000_000, 10_000_000)));
        // 0.1 rad after the first tick.
        assert_eq!(way[0], (-49_958, 998_334));
        ways.push(way);
    }
    let near = |a: i64, b: i64| (a - b).abs() <= 1;
    assert!(ways[0].iter().zip(&ways[1]).all(|(a, b)| near(a.0, b.0) && near(a.1, b.1)));
    // A full circle clockwise, with a third axis.
    let mut desk = ready(machine, "G2 I5 Z1 F3000\nM30\n");
    start(&mut desk);
    assert_eq!(desk.see(["@INTRP", "@AXACT[0]", "@AXACT[2]"]), [2, 1, 1]);
    desk.step();
    assert!(desk.get("@CMDRG[1]") > 900_000, "clockwise from the left goes up");
}

#[test]
fn an_arc_needs_a_circle() {
    let of = |part: &str| mistakes(Dialect::Pmi, "[simulator]\nunits = \"mm\"\n", part);
    assert_eq!(
        of("F9\nG2 X10 I5 R5\nG3 X10 I4\nG3 X10 I5\nG1 X0 I5\nG18 G2 Z5 R9\nG2 R5\nX20 K9\nM30"),
        [("SIM-9", 2, 4), ("SIM-9", 3, 4), ("SIM-2", 5, 7), ("SIM-9", 7, 4), ("SIM-9", 8, 1)]
    );
}

#[test]
fn the_interpolation_is_that_of_the_block_that_is_executed() {
    let mut desk = ready("[simulator]\nunits = \"mm\"\n", "G2 X1 I0.5 F3000\nM3 G1\nM30\n");
    start(&mut desk);
    assert_eq!(desk.see(["@INTRP", "SIM"]), [1, 0]);
    while desk.see(["@M03"]) == [0] {
        assert_eq!(desk.get("@INTRP"), 1);
    }
    assert_eq!(desk.see(["@INTRP", "@BKACT"]), [0, 1], "the arc is over, and @M03 is waited for");
}

#[test]
fn a_search_for_the_reference_point_may_take_no_time() {
    let machine = "[simulator]\nhome_ms = 0\n[[simulator.axis]]\nname = \"X\"\nhome = 0.5\n";
    let mut desk = ready(machine, "M30\n");
    desk.set("@MODRQ", 0);
    desk.step();
    desk.set("@AXRRQ[0]", 3);
    assert_eq!(desk.see(["@AXACT[0]", "@NHOME[0]", "@CMDRG[0]"]), [1, 1, 0]);
    assert_eq!(desk.see(["@AXACT[0]", "@NHOME[0]", "@CMDRG[0]"]), [0, 0, 5000]);
}

#[test]
fn a_jog_that_is_held_or_has_no_way_shows_no_movement() {
    let mut desk = ready("", "M30\n");
    desk.set("@MODRQ", 0);
    desk.set("@MFHRQ", 1);
    desk.step();
    desk.set("@AXRRQ[0]", 1);
    assert_eq!(desk.see(["@AXACT[0]", "@MVACT", "@CMDRG[0]"]), [0, 0, 0]);
    desk.set("@MFHRQ", 0);
    assert_eq!(desk.see(["@AXACT[0]", "@MVACT", "@CMDRG[0]"]), [1, 1, 1000]);
    // @JGPOS[1] is where the axis stands.
    desk.set("@AXRRQ[1]", 6);
    assert_eq!(desk.see(["@AXACT[1]"]), [0]);
    assert_eq!(desk.see(["@AXACT[1]", "@CMDRG[1]"]), [0, 0]);
}
