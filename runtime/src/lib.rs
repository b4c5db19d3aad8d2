//! Loads programs and runs them: process image, executives, retained memory, events.
