//! The drivers, a file or a folder each. A new one is a module here and a name in the list below it.

pub mod ethercat;
pub mod gpio;
pub mod hal;
pub mod modbus;
pub mod mqtt;
pub mod opcua;
pub mod other;
pub mod zenoh;

use crate::{About, Driver, Keys, ReadSettings};

/// Makes [`DriverSettings`] and the list of all drivers from the names of their modules, each of which has `DRIVERS` and `Settings`.
macro_rules! drivers {
    ($($module:ident),*) => {
        /// The settings of all drivers, from the table `[plcio]`.
        #[derive(Clone, Debug)]
        pub struct DriverSettings {
            $(
                #[doc = concat!("Those of the module `", stringify!($module), "`.")]
                pub $module: $module::Settings,
            )*
        }

        impl DriverSettings {
            pub(crate) fn read(keys: &mut Keys<'_>, about: &About<'_>) -> Self {
                Self { $($module: ReadSettings::read(keys, about)),* }
            }
        }

        const MODULES: &[&[&dyn Driver]] = &[$($module::DRIVERS),*];
    };
}

drivers!(modbus, opcua, mqtt, zenoh, hal, gpio, ethercat, other);

/// All drivers.
pub fn all() -> impl Iterator<Item = &'static dyn Driver> {
    MODULES.iter().copied().flatten().copied()
}

/// Another program that uses the image file itself.
pub(crate) fn other() -> &'static dyn Driver {
    &other::Other
}

/// The settings of drivers that have none.
#[derive(Clone, Copy, Debug)]
pub struct NoSettings;

impl ReadSettings for NoSettings {
    fn read(_: &mut Keys<'_>, _: &About<'_>) -> Self {
        Self
    }
}
