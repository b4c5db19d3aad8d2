//! The Modbus server, with clients that misbehave.

use std::cell::RefCell;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

use plcc_image::Number;
use plcc_tests::loader::wait_until;

use super::{Plant, free_port};

/// As many connections as are served at once.
const CONNECTIONS: usize = 16;

/// The door and the level are given by clients, the pump and the copy can be read.
fn start(name: &str, port: u16, more: &str) -> Plant {
    let point = |name: &str, at: &str| {
        format!(
            "[[io]]\nname = \"{name}\"\ndriver = \"modbus-server\"\naddress = \"{at}\"\nsafe = 1\n\
             timeout_ms = 400\n"
        )
    };
    let configuration = [
        &format!("modbus-server = \"127.0.0.1:{port}\"\n{more}"),
        &point("DOOR", "coil/0")[..],
        &point("LEVEL", "holding/0"),
        &point("PUMP", "coil/1"),
        &point("COPY", "holding/1"),
    ];
    Plant::with(name, &configuration.concat())
}

/// A client that does what it should, and connects again when its connection is over.
struct Client {
    port: u16,
    stream: RefCell<Option<TcpStream>>,
}

impl Client {
    fn new(port: u16) -> Self {
        Self { port, stream: RefCell::new(None) }
    }

    /// Sends a request and gives the answer; `None` where the server is not there, or does not serve it.
    fn ask(&self, request: &[u8]) -> Option<Vec<u8>> {
        let mut stream = self.stream.borrow_mut();
        if stream.is_none() {
            let new = TcpStream::connect(("127.0.0.1", self.port)).ok()?;
            new.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
            *stream = Some(new);
        }
        let answer = stream.as_mut().and_then(|stream| exchange(stream, request));
        if answer.is_none() {
            *stream = None;
        }
        answer
    }

    /// Says that the door is closed and the level is 9.
    fn give(&self) -> bool {
        let coil = self.ask(&[5, 0, 0, 0, 0]);
        let register = self.ask(&[6, 0, 0, 0, 9]);
        coil.is_some_and(|answer| answer[0] == 5) && register.is_some_and(|answer| answer[0] == 6)
    }

    /// Gives values until the program has them.
    fn works(&self, plant: &Plant) {
        wait_until("values come from the client", || {
            self.give()
                && (plant.line("PUMP"), plant.line("COPY")) == (Number::Int(1), Number::Int(9))
                && self.ask(&[1, 0, 1, 0, 1]) == Some(vec![1, 1, 1])
        });
    }
}

/// A request as it goes over the line.
fn frame(request: &[u8]) -> Vec<u8> {
    [&[0, 7, 0, 0, 0, request.len() as u8 + 1, 1], request].concat()
}

fn exchange(stream: &mut TcpStream, request: &[u8]) -> Option<Vec<u8>> {
    stream.write_all(&frame(request)).ok()?;
    let mut head = [0; 7];
    stream.read_exact(&mut head).ok()?;
    let mut answer = vec![0; usize::from(u16::from_be_bytes([head[4], head[5]])) - 1];
    stream.read_exact(&mut answer).ok()?;
    Some(answer)
}

fn connect(port: u16) -> TcpStream {
    TcpStream::connect(("127.0.0.1", port)).unwrap()
}

/// Waits until the server has closed a connection.
fn wait_for_end(mut stream: TcpStream) {
    stream.set_read_timeout(Some(Duration::from_secs(100))).unwrap();
    let mut bytes = [0; 4096];
    loop {
        match stream.read(&mut bytes) {
            Ok(0) => return,
            Err(error) if error.kind() != ErrorKind::WouldBlock => return,
            Err(error) => panic!("the connection has not ended: {error}"),
            Ok(_) => {}
        }
    }
}

#[test]
fn inputs_become_safe_when_a_client_is_gone_or_silent_and_come_again() {
    let port = free_port();
    let plant = start("modbus-client-gone", port, "idle_ms = 1000\n");
    let client = Client::new(port);
    client.works(&plant);
    // It goes away.
    client.stream.borrow_mut().take();
    plant.wait_for_safety();
    client.works(&plant);
    // It stays, and asks nothing: its connection is closed.
    plant.wait_for_safety();
    wait_for_end(client.stream.borrow_mut().take().unwrap());
    client.works(&plant);
    // It never comes to the end of a request, though it sends bytes all the time.
    let mut slow = connect(port);
    let ended = |slow: &mut TcpStream| {
        std::thread::sleep(Duration::from_millis(50));
        slow.write_all(&[0]).is_err()
    };
    slow.write_all(&[0, 7, 0, 0, 0, 200, 1, 16]).unwrap();
    wait_until("its connection is closed", || client.give() && ended(&mut slow));
    client.works(&plant);
    let control = plant.folder.read("log.jsonl");
    for change in ["late", "recovered"] {
        assert!(control.contains(&format!("\"change\":\"{change}\"")), "{change}: {control}");
    }
    let log = plant.end();
    assert!(log.contains("it has asked nothing for 1000 ms"), "{log}");
}

#[test]
fn a_value_that_does_not_fit_is_read_as_the_nearest_one() {
    let port = free_port();
    let point = |name: &str, at: &str| {
        format!("[[io]]\nname = \"{name}\"\ndriver = \"modbus-server\"\naddress = \"{at}\"\n")
    };
    let speed = point("SPEED", "holding/2") + "scale = -1\n" + &point("SPEED", "holding/3:bcd16");
    let program = "$OUTPUT\nCOPY = 3/0-3/B\n$INTEGER\nSPEED\n$END\nCOPY = 9\nSPEED = 20000\n";
    let points =
        format!("modbus-server = \"127.0.0.1:{port}\"\n{}{speed}", point("COPY", "holding/1"));
    let plant = Plant::of("modbus-nearest", program, "", &points);
    let client = Client::new(port);
    wait_until("the registers are read", || {
        client.ask(&[3, 0, 1, 0, 3]) == Some(vec![3, 6, 0, 9, 0, 0, 0x99, 0x99])
    });
    let log = plant.end();
    let told: Vec<&str> = log.lines().filter(|line| line.contains("\"refused\"")).collect();
    assert_eq!(told.len(), 2, "{log}");
    assert!(told[0].contains("SPEED") && told[0].contains("-20000 does not fit"), "{log}");
    assert!(told[1].contains("20000 does not fit its registers; clients read 9999"), "{log}");
}

#[test]
fn clients_that_lie_or_flood_disturb_nobody() {
    let port = free_port();
    let plant = start("modbus-client-floods", port, "idle_ms = 2000\n");
    let client = Client::new(port);
    client.works(&plant);
    for lie in [
        // Another protocol, no length, a length that is too long.
        &[0, 1, 9, 9, 0, 6, 1, 1, 0, 0, 0, 1][..],
        &[0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 1],
        &[0, 1, 0, 0, 0xFF, 0xFF, 1, 1, 0, 0, 0, 1],
        &[0xA5; 300],
        // No bits, all bits, an unknown function, more bytes than are said, fewer, none.
        &frame(&[1, 0, 0, 0, 0]),
        &frame(&[1, 0, 0, 0xFF, 0xFF]),
        &frame(&[0x55, 1, 2, 3]),
        &frame(&[16, 0, 0, 0, 1, 4, 0, 5, 0, 6]),
        &frame(&[16, 0, 0, 0, 2, 4, 0, 5]),
        &frame(&[15, 0, 0, 7, 0xFF, 1, 1]),
        &frame(&[]),
    ] {
        let mut liar = connect(port);
        liar.write_all(lie).unwrap();
        client.works(&plant);
    }
    // Requests without an end, whose answers nobody reads.
    let mut flood = connect(port);
    flood.set_nonblocking(true).unwrap();
    let requests = frame(&[3, 0, 0, 0, 2]).repeat(1000);
    let mut sent = 0;
    wait_until("much has been sent, or nothing more is taken", || {
        for _ in 0..100 {
            match flood.write(&requests) {
                Ok(count) => sent += count,
                Err(_) => return true,
            }
        }
        client.give() && sent > 10_000_000
    });
    client.works(&plant);
    // More connections than are served.
    let crowd: Vec<TcpStream> = (0..3 * CONNECTIONS).map(|_| connect(port)).collect();
    client.works(&plant);
    wait_until("some are refused", || plant.folder.read("plcio.jsonl").contains("client_refused"));
    drop((flood, crowd));
    // Another one is served again.
    Client::new(port).works(&plant);
    let log = plant.end();
    for kind in ["client_connected", "client_left", "client_refused"] {
        assert!(log.contains(&format!("\"kind\":\"{kind}\"")), "{kind}: {log}");
    }
    assert!(log.lines().count() < 300, "{log}");
}

#[test]
fn the_server_listens_as_soon_as_its_port_is_free() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let plant = start("modbus-port", port, "");
    let told = |kind: &str| {
        let log = std::fs::read_to_string(plant.folder.path("plcio.jsonl")).unwrap_or_default();
        log.contains(kind)
    };
    wait_until("it says that it can't listen", || told("server_off"));
    drop(taken);
    wait_until("it listens", || told("server_on"));
    Client::new(port).works(&plant);
    plant.end();
}

/// Four coils are a number in the program, and its lines go to coils and to bits of a register.
#[test]
fn the_lines_of_a_group_are_bits_of_a_client() {
    let port = free_port();
    let configuration = format!(
        "modbus-server = \"127.0.0.1:{port}\"\n\
         [[io]]\nname = \"LEVEL\"\ndriver = \"modbus-server\"\naddress = \"coil/10..13\"\nsafe = 5\ntimeout = \"off\"\n\
         [[io]]\nname = \"COPY\"\ndriver = \"modbus-server\"\naddress = \"coil/23,22,21,20\"\n\
         [[io]]\nname = \"COPY\"\ndriver = \"modbus-server\"\naddress = \"holding/7.4..7.7\"\n\
         [[io]]\nname = \"PORT0.0\"\ndriver = \"modbus-server\"\naddress = \"holding/8.3\"\n"
    );
    let plant = Plant::with("modbus-group", &configuration);
    let client = Client::new(port);
    // LEVEL is 9: its lines 0 and 3.
    wait_until("the number comes from its bits", || {
        client.ask(&[15, 0, 10, 0, 4, 1, 0b1001]).is_some_and(|answer| answer[0] == 15)
            && plant.line("COPY") == Number::Int(9)
    });
    // The list goes backwards: line 0 is coil 23.
    wait_until("the coils follow", || client.ask(&[1, 0, 20, 0, 4]) == Some(vec![1, 1, 0b1001]));
    assert_eq!(client.ask(&[3, 0, 7, 0, 1]), Some(vec![3, 2, 0, 0x90]));
    wait_until("the number comes from its bits", || {
        client.ask(&[15, 0, 10, 0, 4, 1, 0b0011]).is_some() && plant.line("COPY") == Number::Int(3)
    });
    wait_until("the coils follow", || client.ask(&[1, 0, 20, 0, 4]) == Some(vec![1, 1, 0b1100]));
    assert_eq!(plant.line("PUMP"), Number::Int(1), "the door is closed");
    client.ask(&[6, 0, 8, 0, 8]);
    wait_until("the door is open", || plant.line("PUMP") == Number::Int(0));
    plant.end();
}
