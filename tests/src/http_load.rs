//! Clients that ask over HTTP/1.1, each on a connection of its own, as fast as they are answered or on a schedule: how many answers come a second, and how
//! long each takes.
//!
//! The client is a few lines over a socket, so that what is measured is the service: it writes a request in one piece and reads an answer by its
//! `content-length`.

use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use retina_core::comparison::quantile;

use crate::machine_time::{MachineTime, cpu_seconds};

/// Until the first request, so that every connection is open by then.
const CONNECTING: Duration = Duration::from_millis(20);

/// What came back in a turn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// Answers a second.
    pub per_second: f64,
    /// Processor time of an answer, that of the client and of a service in this process together (µs); not a number where it is not known.
    pub cpu_us: f64,
    /// Half of them come within this time (ms).
    pub p50_ms: f64,
    /// 99 of 100 of them come within this time (ms).
    pub p99_ms: f64,
    /// Share of the machine's time that other programs had meanwhile; not a number where it is not known.
    pub others_share: f64,
    /// Share of the machine's time that the hypervisor gave to others; not a number where it is not known.
    pub stolen_share: f64,
}

/// The bytes of a `POST` of JSON to a path.
pub fn post(address: SocketAddr, path: &str, body: &str) -> Vec<u8> {
    let length = body.len();
    format!("POST {path} HTTP/1.1\r\nhost: {address}\r\ncontent-type: application/json\r\ncontent-length: {length}\r\n\r\n{body}")
        .into_bytes()
}

/// One connection.
pub struct Client {
    reader: BufReader<TcpStream>,
}

impl Client {
    /// Connects.
    ///
    /// # Errors
    /// Those of the socket.
    pub fn connect(address: SocketAddr) -> io::Result<Self> {
        let socket = TcpStream::connect(address)?;
        socket.set_nodelay(true)?;
        socket.set_read_timeout(Some(Duration::from_secs(60)))?;
        Ok(Self { reader: BufReader::new(socket) })
    }

    /// Sends a request and reads its answer: status and body.
    ///
    /// # Errors
    /// Those of the socket, and an answer without a length.
    pub fn ask(&mut self, request: &[u8], body: &mut Vec<u8>) -> io::Result<u16> {
        self.reader.get_mut().write_all(request)?;
        let (mut status, mut length, mut line) = (None, None, String::new());
        loop {
            line.clear();
            if self.reader.read_line(&mut line)? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            let text = line.trim_end();
            if text.is_empty() {
                break;
            }
            if status.is_none() {
                status = text.split(' ').nth(1).and_then(|word| word.parse().ok());
            } else if let Some((name, value)) = text.split_once(':')
                && name.eq_ignore_ascii_case("content-length")
            {
                length = value.trim().parse().ok();
            }
        }
        let (Some(status), Some(length)) = (status, length) else {
            return Err(io::Error::other("an answer without status or content-length"));
        };
        body.resize(length, 0);
        self.reader.read_exact(body)?;
        Ok(status)
    }
}

/// Starts a server that sends the same answer to every request as soon as it has come: what clients, sockets and the system's scheduling take by themselves.
/// A thread for each connection; they end with the process.
///
/// # Errors
/// Those of the socket.
pub fn start_empty(answer: &[u8]) -> io::Result<SocketAddr> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let address = listener.local_addr()?;
    let head = format!("HTTP/1.1 200 OK\r\ncontent-length: {}\r\n\r\n", answer.len());
    let answer: Arc<[u8]> = [head.as_bytes(), answer].concat().into();
    thread::spawn(move || {
        for socket in listener.incoming().flatten() {
            let answer = Arc::clone(&answer);
            // A client that goes ends its thread.
            thread::spawn(move || answer_all(socket, &answer));
        }
    });
    Ok(address)
}

/// Sends `answer` to every request of [`post`] that comes.
fn answer_all(socket: TcpStream, answer: &[u8]) -> io::Result<()> {
    socket.set_nodelay(true)?;
    let (mut reader, mut line, mut length, mut body) = (BufReader::new(socket), String::new(), 0, Vec::new());
    loop {
        line.clear();
        if reader.read_line(&mut line)? == 0 {
            return Ok(());
        }
        if let Some(value) = line.strip_prefix("content-length: ") {
            length = value.trim().parse().map_err(io::Error::other)?;
        }
        if line.trim_end().is_empty() {
            body.resize(length, 0);
            reader.read_exact(&mut body)?;
            reader.get_mut().write_all(answer)?;
        }
    }
}

/// When the next request of a connection is sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// When the answer before it is there: the service sets the pace, and each answer's time counts from its request.
    Answered,
    /// At its place in a schedule of so many a second over all connections, whatever is answered; where the answer before it is late, as soon as that is
    /// there. The time counts from the place in the schedule, so a service that stops for a moment is charged with every request that would have come
    /// in that moment.
    Scheduled(f64),
}

/// Asks for `turn` over so many connections; every request is the next of these, round and round.
///
/// # Errors
/// Those of the sockets, and an answer whose status is not 200.
pub fn measure(
    address: SocketAddr,
    requests: &[Vec<u8>],
    connections: usize,
    turn: Duration,
    pace: Pace,
) -> io::Result<Measured> {
    let (began, before, machine_before) = (Instant::now() + CONNECTING, cpu_seconds(), MachineTime::now());
    let one = |first: usize| -> io::Result<Vec<f64>> {
        let (mut client, mut body, mut times_ms) = (Client::connect(address)?, Vec::new(), Vec::new());
        thread::sleep(began.saturating_duration_since(Instant::now()));
        for (index, request) in requests.iter().cycle().skip(first).enumerate() {
            let due = match pace {
                Pace::Answered => began.elapsed(),
                Pace::Scheduled(a_second) => Duration::from_secs_f64((first + index * connections) as f64 / a_second),
            };
            if due >= turn {
                break;
            }
            thread::sleep(due.saturating_sub(began.elapsed()));
            let status = client.ask(request, &mut body)?;
            if status != 200 {
                return Err(io::Error::other(format!("{status}: {}", String::from_utf8_lossy(&body))));
            }
            times_ms.push((began.elapsed() - due).as_secs_f64() * 1e3);
        }
        Ok(times_ms)
    };
    let all: Vec<io::Result<Vec<f64>>> = thread::scope(|scope| {
        let clients: Vec<_> = (0..connections).map(|client| scope.spawn(move || one(client))).collect();
        clients
            .into_iter()
            .map(|client| client.join().unwrap_or_else(|_| Err(io::Error::other("a client panicked"))))
            .collect()
    });
    let seconds = began.elapsed().as_secs_f64();
    let mut times_ms: Vec<f64> = all.into_iter().collect::<io::Result<Vec<_>>>()?.concat();
    times_ms.sort_by(f64::total_cmp);
    let at = |share: f64| quantile(&times_ms, share);
    let cpu_s = cpu_seconds().zip(before).map_or(f64::NAN, |(after, before)| after - before);
    let (count, cpu_us) = (times_ms.len() as f64, 1e6 * cpu_s / times_ms.len() as f64);
    let machine = MachineTime::now().zip(machine_before);
    let (others_share, stolen_share) =
        machine.map_or((f64::NAN, f64::NAN), |(now, before)| now.shares_since(&before, cpu_s));
    Ok(Measured { per_second: count / seconds, cpu_us, p50_ms: at(0.5), p99_ms: at(0.99), others_share, stolen_share })
}
