//! From the first frame to the state in which terminals exchange process data, and back.

use std::time::Duration;

use ethercrab::error::Error;
use ethercrab::std::ethercat_now;
use ethercrab::subdevice_group::{Op, PreOp, SafeOp};
use ethercrab::{
    AlStatusCode, Command, DefaultLock, MainDevice, RegisterAddress, SubDeviceGroup, SubDeviceState,
};
use plcc_configuration::drivers::ethercat::ExpectedTerminal;

use super::expected;
use super::{ANSWER, Segment};

/// The most terminals of a segment.
const MAX_TERMINALS: usize = 128;
/// The most bytes of process data of a segment: they fit in one frame, so that the working counter of a poll is one number.
const MAX_BYTES: usize = 1024;

/// All terminals of a segment, in a state.
pub(super) type Group<State> = SubDeviceGroup<MAX_TERMINALS, MAX_BYTES, DefaultLock, State>;

/// A terminal that was found.
pub(super) struct Terminal {
    pub(super) name: String,
    /// The address that it was given.
    pub(super) address: u16,
    /// How many bytes of inputs and outputs it has.
    bytes: (usize, usize),
}

/// An error of the crate, for people.
pub(super) fn text(error: Error) -> String {
    match error {
        Error::Timeout(what) => format!("the terminals do not answer ({what})"),
        Error::WorkingCounter { expected, received } => {
            format!("a terminal does not answer (working counter {received}, not {expected})")
        }
        error => error.to_string(),
    }
}

/// A state of the application layer, as manuals name it.
fn state_name(state: SubDeviceState) -> String {
    match state {
        SubDeviceState::Init => "in the state INIT".into(),
        SubDeviceState::PreOp => "in the state PRE-OP".into(),
        SubDeviceState::SafeOp => "in the state SAFE-OP".into(),
        SubDeviceState::Op => "in the state OP".into(),
        SubDeviceState::None => "silent".into(),
        other => format!("in an unknown state ({other})"),
    }
}

/// What a working counter must be when every terminal has given its inputs (1) and taken its outputs (2).
pub(super) fn working_counter(terminals: &[Terminal]) -> u16 {
    let of =
        |terminal: &Terminal| u16::from(terminal.bytes.0 > 0) + 2 * u16::from(terminal.bytes.1 > 0);
    terminals.iter().map(of).sum()
}

/// Says which terminal is not in a state, and why, by its own words.
pub(super) async fn who_is_not(
    main_device: &MainDevice<'_>,
    terminals: &[Terminal],
    wanted: SubDeviceState,
) -> Option<String> {
    for (position, Terminal { name, address, .. }) in terminals.iter().enumerate() {
        let read = |register: RegisterAddress| Command::fprd(*address, register.into());
        let state = read(RegisterAddress::AlStatus).receive::<u16>(main_device).await;
        // The lowest four bits; the next one says that there is an error.
        let state = state.map_or(0, |state| (state & 0xF) as u8);
        if state == u8::from(wanted) {
            continue;
        }
        let code = read(RegisterAddress::AlStatusCode).receive::<AlStatusCode>(main_device).await;
        let code = match code {
            Ok(AlStatusCode::NoError) | Err(_) => String::new(),
            Ok(code) => format!(", since: {code}"),
        };
        let state = state_name(SubDeviceState::from(state));
        return Some(format!("terminal {position} ({name}) is {state}{code}"));
    }
    None
}

/// Sets all terminals to INIT, in which outputs are off, whatever state they are in. Nobody waits for them.
pub(super) async fn switch_off(main_device: &MainDevice<'_>) {
    // INIT, and the acknowledgement of errors.
    let init = 0x11_u16;
    let command = Command::bwr(RegisterAddress::AlControl.into()).ignore_wkc();
    let _ = tokio::time::timeout(ANSWER * 2, command.send(main_device, init)).await;
}

/// Takes all terminals from OP to INIT, as far as they follow in time.
pub(super) async fn bring_down(group: Group<Op>, main_device: &MainDevice<'_>) {
    let down = async {
        let group = group.into_safe_op(main_device).await?;
        let group = group.into_pre_op(main_device).await?;
        group.into_init(main_device).await.map(|_| ())
    };
    match tokio::time::timeout(Duration::from_secs(1), down).await {
        Ok(Ok(())) => {}
        _ => switch_off(main_device).await,
    }
}

impl Segment {
    /// Finds all terminals, compares them with the expected ones, and takes them to SAFE-OP.
    ///
    /// # Errors
    /// Why that is not possible, for people.
    pub(super) async fn bring_up(
        &self,
        main_device: &MainDevice<'_>,
        expected: &[ExpectedTerminal],
    ) -> Result<(Group<SafeOp>, Vec<Terminal>), String> {
        let group: Group<PreOp> =
            main_device.init_single_group(ethercat_now).await.map_err(|error| match error {
                Error::Capacity(_) => format!("there are more than {MAX_TERMINALS} terminals"),
                error => text(error),
            })?;
        let found = group.iter(main_device);
        let found: Vec<_> = found.map(|one| (one.name().to_owned(), one.identity())).collect();
        if found.is_empty() {
            return Err("no terminal answers".into());
        }
        expected::compare(expected, &found)?;
        let addresses = group.iter(main_device).map(|one| one.configured_address());
        let addresses: Vec<u16> = addresses.collect();
        let names = found.into_iter().map(|(name, _)| name).zip(addresses);
        let mut terminals: Vec<_> =
            names.map(|(name, address)| Terminal { name, address, bytes: (0, 0) }).collect();
        let group = match group.into_safe_op(main_device).await {
            Ok(group) => group,
            Err(error @ (Error::StateTransition | Error::SubDevice(_) | Error::Timeout(_))) => {
                let who = who_is_not(main_device, &terminals, SubDeviceState::SafeOp).await;
                return Err(who.unwrap_or_else(|| text(error)));
            }
            Err(error) => return Err(text(error)),
        };
        for (terminal, one) in terminals.iter_mut().zip(group.iter(main_device)) {
            terminal.bytes = (one.inputs_raw().len(), one.outputs_raw().len());
        }
        self.fits(&terminals)?;
        Ok((group, terminals))
    }

    /// Whether all points lie within the process data of the terminals.
    ///
    /// # Errors
    /// Which one does not.
    fn fits(&self, terminals: &[Terminal]) -> Result<(), String> {
        for (_, point) in self.inputs.iter().chain(&self.outputs) {
            let position = point.terminal;
            let Some(terminal) = terminals.get(usize::from(position)) else {
                return Err(format!(
                    "there is no terminal {position}: there are {}, counted from 0",
                    terminals.len()
                ));
            };
            let (has, what) = match point.is_output {
                false => (terminal.bytes.0, "inputs"),
                true => (terminal.bytes.1, "outputs"),
            };
            if point.end() > has {
                return Err(format!(
                    "terminal {position} ({}) has {has} bytes of {what}, and byte {} is wired",
                    terminal.name,
                    point.end() - 1
                ));
            }
        }
        Ok(())
    }
}
