//! Motion programs with PLCs beside them, in all engines.
#![allow(clippy::unwrap_used, clippy::panic)]

use plcc_frontend::common::Controller;
use plcc_random::seeds;
use plcc_runtime::EventBody;
use plcc_tests::gen_motion::generate;
use plcc_tests::gen_motion_sequences::{self, Sequences};

use crate::engines::{goes_on_from_checkpoints, simulated};

#[test]
fn generated_motion_programs_agree_and_move_within_their_limits() {
    let (mut events, mut moved) = (0, false);
    for seed in seeds(8) {
        let turbo = seed % 4 == 3;
        let all_modes = seed % 2 == 1;
        let case = generate(seed, turbo, all_modes);
        let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
        let ticks = std::env::var("PLCC_TICKS").ok().and_then(|ticks| ticks.parse().ok());
        let ticks = ticks.unwrap_or(case.ticks);
        let found = simulated(&case.source, &case.stimulus, ticks, controller, &mut |value| {
            for motor in 1..=3 {
                let highest = [16, 22, 23].map(|i| value(&format!("I{motor}{i:02}")).abs());
                let highest = highest.into_iter().fold(0.0, f64::max);
                let speed = value(&format!("#{motor}.VEL")).abs();
                moved |= speed != 0.0;
                let held = value("&1.BASE") / 100.0;
                let allowed = highest * held.max(1.0) * 1.0001;
                assert!(
                    speed <= allowed || all_modes,
                    "seed {seed}: motor {motor} moves {speed}, over {allowed}"
                );
            }
            true
        });
        events += found.unwrap_or_else(|why| panic!("seed {seed}: {why}\n{}", case.source)).len();
    }
    // Eight programs of 500 ticks have about ninety.
    assert!(events > 60 && moved, "{events}");
}

/// No position jumps: in a cycle a motor goes no further than its limit allows, or, in modes without limits, than twice the
/// way of the cycles before and after: a PVT row may stop dead within a cycle. Each sequence ends exactly at its target.
#[test]
fn generated_sequences_are_continuous_and_end_at_their_targets() {
    for seed in seeds(6) {
        let turbo = seed % 2 == 1;
        let controller = if turbo { Controller::Turbo } else { Controller::Pmac };
        let Sequences { source, ends, scales, speed, ticks } =
            gen_motion_sequences::generate(seed, turbo);
        let mut cycles: Vec<[[f64; 3]; 2]> = vec![];
        let events = simulated(&source, "", ticks, controller, &mut |value| {
            let each = |name: &str| [1, 2, 3].map(|n| value(&name.replace('n', &n.to_string())));
            cycles.push([each("#n.CMD"), each("P20n")]);
            value("P204") == 0.0
        });
        let events = events.unwrap_or_else(|why| panic!("seed {seed}: {why}\n{source}"));
        let mut next = 0;
        for event in &events {
            if !matches!(event.body, EventBody::Send { .. }) {
                continue;
            }
            let [commanded, joints] = cycles[event.tick as usize];
            let ends = ends[next];
            let expected = match scales {
                Some(scales) => [0, 1, 2].map(|axis| scales[axis] * ends[axis]),
                None => joints,
            };
            assert_eq!(commanded, expected, "seed {seed}: sequence {next}\n{source}");
            next += 1;
        }
        assert_eq!(next, ends.len(), "seed {seed}: {events:?}\n{source}");
        for motor in 0..3 {
            let at = |tick: usize| cycles[tick][0][motor];
            let steps: Vec<f64> = (1..cycles.len()).map(|tick| at(tick) - at(tick - 1)).collect();
            for (tick, step) in steps.windows(3).enumerate() {
                let [before, step, after] = [step[0], step[1], step[2]].map(f64::abs);
                let limit = speed.map_or(0.0, |speed| speed * 0.442_7 * 1.000_1);
                let smooth = step <= (before + after) * 2.0 + 1e-6 || turns_round(&steps, tick + 1);
                assert!(
                    if speed.is_some() { step <= limit } else { smooth },
                    "seed {seed}: motor {} goes {step} in tick {}, {before} before and {after} behind\n{source}",
                    motor + 1,
                    tick + 2
                );
            }
        }
    }
}

/// Whether a step is as far as the cubic of the three steps before it goes, or that of the three behind it, but for what a
/// change of the acceleration within the cycle makes of it: so it is where a row of PVT turns round near its end. Where the row
/// stops dead in this cycle or in the next one, it goes no further than its cubic would have.
fn turns_round(steps: &[f64], at: usize) -> bool {
    let [.., c, b, a] = &steps[..at] else { return false };
    let [d, e, f] = [1, 2, 3].map(|behind| steps.get(at + behind).copied().unwrap_or(0.0));
    // How far the cubics go in this cycle, and what they add to a step from cycle to cycle.
    let (ahead, back) = (3.0 * (a - b) + c, 3.0 * (d - e) + f);
    if (d == 0.0 || e == 0.0) && steps[at].abs() <= ahead.abs() + 1e-6 {
        return true;
    }
    let change = ((ahead - a) - (d - back)).abs();
    let near = |cubic: f64| (steps[at] - cubic).abs() <= change * 0.5 + 1e-6;
    near(ahead) || near(back)
}

/// The cuts are in a homing search, the move behind it, blended lines, a DWELL, arcs, a PVT row, a spline and a jog.
#[test]
fn a_checkpoint_in_the_middle_of_a_motion_goes_on_to_the_bit() {
    let source = "I5=3 I8=1 I10=4194304 I12=2 I13=5\nI902=1\n\
        I100=1 I111=0 I116=100 I117=1 I119=1 I120=10 I121=5 I122=10 I123=5\n\
        I200=1 I211=0 I216=100 I217=1 I219=1 I220=10 I221=0 I222=10\n\
        I300=1 I311=0 I319=0.1 I320=10 I321=0 I322=10\n\
        I187=20 I188=5 I189=20 I190=1000\n&1 #1->100X #2->100Y\n\
        M1->Y:$FFC2,8,1\nM140->Y:$0814,0,1\nM145->Y:$0814,10,1\nOPEN PROG 1 CLEAR\nLINEAR ABS F50\nX2 Y2\nX5 M1==1\n\
        DWELL 30\nCIRCLE1 X7 Y4 R2\nLINEAR X8\nP1=P1+1\nPVT30\nX5:10 Y3\nX4:0\nTA20 SPLINE1\nX3\nX1 Y1\nX0 Y0\n\
        RAPID X1\nCLOSE\nOPEN PLC 1 CLEAR\nCMD\"#1HM\"\nWHILE (M145=0 OR M140=0)\nENDWHILE\nCMD\"&1B1R\"\n\
        CMD\"#3J=3000\"\nDISABLE PLC 1\nCLOSE\n";
    let cuts = [50, 1650, 1690, 1750, 1900, 2010, 2100, 2300, 2500, 2655];
    goes_on_from_checkpoints(source, 2900, Controller::Pmac, &cuts);
    // A Turbo PMAC with kinematics.
    let Sequences { source, .. } = gen_motion_sequences::generate(KINEMATIC_SEED, true);
    let cuts: Vec<u32> = (1..=10).map(|part| part * 50).collect();
    goes_on_from_checkpoints(&source, 600, Controller::Turbo, &cuts);
}

/// The sequences of this seed have kinematics.
const KINEMATIC_SEED: u64 = 1;
