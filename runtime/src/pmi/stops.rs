//! Why the control stops its program.

use plcc_abi::{OutOfBoundsAccess, Trap, TrapCode};

use super::tick::PmiExecutive;
use crate::{Place, Stop};

impl PmiExecutive {
    /// Why the control stops after a trap.
    pub(super) fn stop(&self, Trap { code, statement, element }: Trap) -> Stop {
        let place = statement.and_then(|statement| Place::new(&self.files, statement));
        match code {
            TrapCode::ArrayBounds => {
                let at = place.as_ref().map_or_else(String::new, |place| format!(" in {place}"));
                let what = element.and_then(|element| self.missing(element));
                let what =
                    what.unwrap_or_else(|| "an array has no element that was accessed".into());
                Stop {
                    code: "NO PMI DATA".into(),
                    message: format!(
                        "{what}{at}; the control is in emergency stop and does not scan again"
                    ),
                    place,
                }
            }
            TrapCode::Watchdog => Stop {
                code: "WATCHDOG".into(),
                message: format!(
                    "the scan took longer than the watchdog allows{}; the control is in emergency \
                     stop and does not scan again",
                    Place::where_stopped(place.as_ref())
                ),
                place,
            },
            TrapCode::Internal | TrapCode::Timeout | TrapCode::CallDepth | TrapCode::HostPanic => {
                Stop::internal_error(code)
            }
        }
    }

    /// Says which array has not the element with which index; `None` if there is no such array.
    fn missing(&self, OutOfBoundsAccess { array, index }: OutOfBoundsAccess) -> Option<String> {
        let symbols = &self.names.symbols;
        let symbol = symbols.iter().find(|s| s.elements.is_some() && s.offset == array)?;
        let (name, last) = (&symbol.name, symbol.elements?.saturating_sub(1));
        Some(format!(
            "{name}[{index}] does not exist ({name} has the elements 0 to {last}); it was accessed"
        ))
    }
}
