//! RTU with a device that misbehaves, at the other end of a pseudo-terminal.

use std::fs::{self, File};
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use plcc_tests::loader::{Folder, wait_until};
use rustix::fs::OFlags;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use super::{CONDUCTS, Conduct, Plant, answer};

/// The checksum of RTU.
fn checksum(bytes: &[u8]) -> [u8; 2] {
    let mut sum = 0xFFFF_u16;
    for &byte in bytes {
        sum ^= u16::from(byte);
        for _ in 0..8 {
            sum = sum >> 1 ^ if sum & 1 == 1 { 0xA001 } else { 0 };
        }
    }
    sum.to_le_bytes()
}

fn frame(unit: u8, answer: &[u8]) -> Vec<u8> {
    let bytes = [&[unit], answer].concat();
    [&bytes[..], &checksum(&bytes)].concat()
}

/// A serial line with a device: unit 1, which is otherwise that of the tests with TCP. The line can be
/// pulled out, and put in again under the same name.
struct Line {
    folder: Folder,
    conduct: Arc<AtomicU8>,
    coil: Arc<AtomicBool>,
    pulled: Arc<AtomicBool>,
    device: Option<JoinHandle<()>>,
}

impl Line {
    fn start() -> Self {
        let mut line = Self {
            folder: Folder::new("modbus-line"),
            conduct: Arc::new(AtomicU8::new(0)),
            coil: Arc::new(AtomicBool::new(false)),
            pulled: Arc::new(AtomicBool::new(false)),
            device: None,
        };
        line.put_in();
        line
    }

    fn name(&self) -> String {
        self.folder.path("line").to_str().unwrap().to_owned()
    }

    fn behave(&self, conduct: Conduct) {
        let number = CONDUCTS.iter().position(|&other| other == conduct).unwrap();
        self.conduct.store(number as u8, Ordering::Relaxed);
    }

    fn put_in(&mut self) {
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&end).unwrap();
        unlockpt(&end).unwrap();
        symlink(ptsname(&end, vec![]).unwrap().to_str().unwrap(), self.name()).unwrap();
        let flags = rustix::fs::fcntl_getfl(&end).unwrap();
        rustix::fs::fcntl_setfl(&end, flags | OFlags::NONBLOCK).unwrap();
        self.pulled.store(false, Ordering::Relaxed);
        let (conduct, coil) = (Arc::clone(&self.conduct), Arc::clone(&self.coil));
        let (pulled, end) = (Arc::clone(&self.pulled), File::from(end));
        self.device = Some(std::thread::spawn(move || serve(end, &conduct, &coil, &pulled)));
    }

    fn pull_out(&mut self) {
        self.pulled.store(true, Ordering::Relaxed);
        self.device.take().unwrap().join().unwrap();
        fs::remove_file(self.name()).unwrap();
    }
}

/// Takes requests and does with them what the device does at present, until the line is pulled out.
fn serve(mut line: File, conduct: &AtomicU8, coil: &AtomicBool, pulled: &AtomicBool) {
    let mut request = vec![];
    while !pulled.load(Ordering::Relaxed) {
        let mut bytes = [0; 256];
        match line.read(&mut bytes) {
            Ok(count) => request.extend(&bytes[..count]),
            Err(error) => {
                // Nothing has come, or nobody has opened the line.
                if error.kind() != std::io::ErrorKind::WouldBlock {
                    request.clear();
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        let length = match request.get(1) {
            Some(15 | 16) => request.get(6).map(|&count| 9 + usize::from(count)),
            Some(_) => Some(8),
            None => None,
        };
        let Some(length) = length.filter(|&length| request.len() >= length) else { continue };
        let whole: Vec<u8> = request.drain(..length).collect();
        if whole[length - 2..] != checksum(&whole[..length - 2]) {
            request.clear();
            continue;
        }
        let right = answer(&whole[1..length - 2], coil);
        let function = whole[1];
        let half = |mut whole: Vec<u8>| {
            whole.truncate(whole.len() / 2);
            whole
        };
        let sent = match CONDUCTS[usize::from(conduct.load(Ordering::Relaxed))] {
            Conduct::Answers => frame(1, &right),
            // A line has nothing that could be closed.
            Conduct::SaysNothing | Conduct::Closes => continue,
            Conduct::AnswersLate => {
                std::thread::sleep(Duration::from_millis(250));
                frame(1, &right)
            }
            Conduct::SendsGarbage => vec![0xA5; 300],
            Conduct::SendsTooFewValues => frame(1, &[function, 0]),
            Conduct::AnswersAnotherRequest => frame(2, &right),
            Conduct::SendsHalf => half(frame(1, &right)),
            Conduct::SendsByteByByte => {
                for byte in frame(1, &right) {
                    std::thread::sleep(Duration::from_millis(50));
                    let _ = line.write(&[byte]);
                }
                continue;
            }
            Conduct::Refuses => frame(1, &[function | 0x80, 2]),
            Conduct::Floods => frame(1, &[0x83, 2]).repeat(2000),
        };
        // What the line does not take is lost.
        let _ = line.write(&sent);
    }
}

#[test]
fn inputs_become_safe_whatever_happens_on_a_line_and_come_again_without_a_restart() {
    let mut line = Line::start();
    let device = format!("{}@19200-8N1", line.name());
    let plant = Plant::start("modbus-line-faults", "modbus-rtu", &device, "");
    plant.wait_for_values();
    wait_until("the pump is written", || line.coil.load(Ordering::Relaxed));
    for conduct in &CONDUCTS[1..] {
        line.behave(*conduct);
        plant.wait_for_safety();
        line.behave(Conduct::Answers);
        plant.wait_for_values();
    }
    line.pull_out();
    plant.wait_for_safety();
    line.put_in();
    plant.wait_for_values();
    let log = plant.end();
    assert!(!line.coil.load(Ordering::Relaxed), "plcio has ended, so the pump is off: {log}");
    for kind in ["connected", "lost", "refused", "accepted", "control_left"] {
        assert!(log.contains(&format!("\"kind\":\"{kind}\"")), "{kind}: {log}");
    }
    // Nothing is reported again and again.
    assert!(log.lines().count() < 300, "{log}");
    line.pull_out();
}
