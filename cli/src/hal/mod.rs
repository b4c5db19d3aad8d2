//! Components for LinuxCNC's hardware abstraction layer (HAL): a program with its control, as a real-time
//! module that `loadrt` loads (`plcc hal`).
//!
//! | file | holds |
//! | --- | --- |
//! | `NAME.plcx` | the artifact, which becomes part of the module |
//! | `NAME.c` | the component: pins, and the function that does the ticks |
//! | `plcrt.h` | the interface of libplcrt, which the component calls |
//! | `Makefile` | builds `NAME.so` by LinuxCNC's own rules |
//! | `NAME.hal` | an example: a thread, the component, and a sampler for its outputs |

pub(crate) mod component;
pub(crate) mod example;
pub(crate) mod pins;
