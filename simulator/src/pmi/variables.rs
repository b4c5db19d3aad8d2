//! The executive variables that the simulated control reads and writes (PMI 3.4).

use crate::access::{Access, Handle, Use, Variable};
use crate::setup::Setup;

/// The variables of an axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisVariables {
    pub(super) active: Variable,
    pub(super) not_homed: Variable,
    pub(super) command: Variable,
    pub(super) actual: Variable,
    /// Read: what is requested by hand, and the goal of a jog.
    pub(super) request: Variable,
    pub(super) jog_position: Variable,
}

/// The variables of an auxiliary axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct AuxVariables {
    pub(super) acknowledge: Variable,
    pub(super) complete: Variable,
    pub(super) homed: Variable,
    pub(super) velocity_error: Variable,
    pub(super) command: Variable,
    pub(super) actual: Variable,
    pub(super) position: Variable,
    pub(super) velocity: Variable,
    /// Read: the mode, the request, where to and how fast, and whether to stop where it is.
    pub(super) mode: Variable,
    pub(super) request: Variable,
    pub(super) given_position: Variable,
    pub(super) given_velocity: Variable,
    pub(super) cancel: Variable,
}

/// A list of all: what is read, and what is written.
macro_rules! variables {
    (reads { $($read:ident: $read_name:literal,)* } writes { $($write:ident: $write_name:literal,)* }) => {
        /// All of them.
        #[derive(Clone, Debug)]
        pub(super) struct Variables {
            $(pub(super) $read: Variable,)*
            $(pub(super) $write: Variable,)*
            pub(super) axes: Vec<AxisVariables>,
            pub(super) aux: Vec<AuxVariables>,
            /// The codes that the program declares.
            pub(super) codes: Vec<Variable>,
            /// The faults that control reset clears: @FLTAC and @FLTRC.
            pub(super) faults: Vec<Variable>,
            /// For each touch button whether it repeats, and the button itself.
            pub(super) touch: Vec<(Variable, Variable)>,
        }

        impl Variables {
            pub(super) fn find(setup: &Setup, access: &mut dyn Access) -> Self {
                $(let $read = Variable::find(access, $read_name, Use::Read);)*
                $(let $write = Variable::find(access, $write_name, Use::Write);)*
                Self {
                    axes: axes(setup, access),
                    aux: aux(setup, access),
                    codes: codes(setup, access),
                    faults: faults(access),
                    touch: touch(access),
                    $($read,)*
                    $($write,)*
                }
            }

            /// Those that are written.
            pub(super) fn writes(&self) -> Vec<Handle> {
                let mut written = vec![$(self.$write,)*];
                for AxisVariables { active, not_homed, command, actual, .. } in &self.axes {
                    written.extend([*active, *not_homed, *command, *actual]);
                }
                for axis in &self.aux {
                    let AuxVariables {
                        acknowledge, complete, homed, velocity_error, command, actual, position, velocity, ..
                    } = *axis;
                    written.extend([acknowledge, complete, homed, velocity_error]);
                    written.extend([command, actual, position, velocity]);
                }
                written.extend(&self.codes);
                written.extend(&self.faults);
                written.extend(self.touch.iter().map(|(_, button)| *button));
                written.into_iter().filter_map(Variable::handle).collect()
            }
        }
    };
}

variables! {
    reads {
        machine_on_request: "@MONRQ",
        machine_ready: "@MCRDY",
        estop_button: "@ESTPB",
        control_reset_request: "@CRRQ",
        mode_request: "@MODRQ",
        feed_hold_request: "@FHRQ",
        cycle_request: "@CYCRQ",
        block_inhibit: "@BXINH",
        move_hold: "@MFHRQ",
        simulation: "@PSIM",
        spindle_voltage: "@SPDAC",
        simulated_spindle: "@ASIM",
        simulated_rpm: "@CSRPM",
        block_delete: "@BKDLT",
        optional_stop: "@OPSTP",
        jog_increment: "@JGINC",
        aux_feed_hold: "@AUXFH",
    }
    writes {
        estop: "@ESTOP",
        machine_request: "@MXRDY",
        mode: "@MODE",
        feed_hold: "@FHOLD",
        block_active: "@BKACT",
        cycle_in_progress: "@CYCIP",
        program_end: "@PGMSE",
        s_code: "@SCODE",
        t_code: "@TCODE",
        interpolation: "@INTRP",
        spindle_rpm: "@SSRPM",
        moves: "@MVACT",
        spindle_encoder: "@SPENC",
        inch: "@INCH",
        new_s_code: "@NEWSC",
        next_tool: "@NTOOL",
        tool: "@TOOL",
        reset_pulse: "@CRSET",
        feed_override: "@FRO",
        spindle_override: "@SSO",
        touched: "@TCHKY",
    }
}

fn axes(setup: &Setup, access: &mut dyn Access) -> Vec<AxisVariables> {
    let mut axis = |at: usize| {
        let mut find = |name, wanted| Variable::find(access, &format!("{name}[{at}]"), wanted);
        AxisVariables {
            active: find("@AXACT", Use::Write),
            not_homed: find("@NHOME", Use::Write),
            command: find("@CMDRG", Use::Write),
            actual: find("@POSRG", Use::Write),
            request: find("@AXRRQ", Use::Read),
            jog_position: find("@JGPOS", Use::Read),
        }
    };
    (0..setup.axes.len()).map(&mut axis).collect()
}

fn aux(setup: &Setup, access: &mut dyn Access) -> Vec<AuxVariables> {
    let mut axis = |at: usize| {
        let mut read = |name| Variable::find(access, &format!("{name}[{at}]"), Use::Read);
        let (mode, request) = (read("@AUMOD"), read("@AUREQ"));
        let (given_position, given_velocity) = (read("@AUPOS"), read("@AUVEL"));
        let cancel = read("@AUCNC");
        let mut find = |name| Variable::find(access, &format!("{name}[{at}]"), Use::Write);
        AuxVariables {
            mode,
            request,
            given_position,
            given_velocity,
            cancel,
            acknowledge: find("@AUACK"),
            complete: find("@AUCMP"),
            homed: find("@AUHOM"),
            velocity_error: find("@AUVER"),
            command: find("@AUCRG"),
            actual: find("@AUPRG"),
            position: find("@APPOS"),
            velocity: find("@APVEL"),
        }
    };
    (0..setup.table.aux.len()).map(&mut axis).collect()
}

fn codes(setup: &Setup, access: &mut dyn Access) -> Vec<Variable> {
    let codes = setup.rules.codes.iter();
    codes.map(|code| Variable::find(access, &code.name(), Use::Write)).collect()
}

fn faults(access: &mut dyn Access) -> Vec<Variable> {
    let mut found = vec![];
    for name in ["@FLTAC", "@FLTRC"] {
        for element in 0..32 {
            found.push(Variable::find(access, &format!("{name}[{element}]"), Use::Write));
        }
    }
    found
}

fn touch(access: &mut dyn Access) -> Vec<(Variable, Variable)> {
    let mut found = vec![];
    for window in ["@OPB", "@MPB"] {
        for button in 0..super::touch::BUTTONS {
            let repeats = Variable::find(access, &format!("@ORP{button:02}"), Use::Read);
            let itself = Variable::find(access, &format!("{window}{button:02}"), Use::Write);
            found.push((repeats, itself));
        }
    }
    found
}
