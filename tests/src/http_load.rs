//! Clients that ask over HTTP/1.1, each on a connection of its own, and wait for every answer: how many come a second, and how long each takes.
//!
//! The client is a few lines over a socket, so that what is measured is the service: it writes a request in one piece and reads an answer by its
//! `content-length`.

use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use retina_core::comparison::quantile;

/// What came back in a turn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// Answers a second.
    pub per_second: f64,
    /// Half of them come within this time (ms).
    pub p50_ms: f64,
    /// 99 of 100 of them come within this time (ms).
    pub p99_ms: f64,
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

/// Asks for `turn` over so many connections; every request is the next of these, round and round.
///
/// # Errors
/// Those of the sockets, and an answer whose status is not 200.
pub fn measure(address: SocketAddr, requests: &[Vec<u8>], connections: usize, turn: Duration) -> io::Result<Measured> {
    let began = Instant::now();
    let one = |first: usize| -> io::Result<Vec<f64>> {
        let (mut client, mut body, mut times_ms) = (Client::connect(address)?, Vec::new(), Vec::new());
        for request in requests.iter().cycle().skip(first) {
            if began.elapsed() >= turn {
                break;
            }
            let sent = Instant::now();
            let status = client.ask(request, &mut body)?;
            if status != 200 {
                return Err(io::Error::other(format!("{status}: {}", String::from_utf8_lossy(&body))));
            }
            times_ms.push(sent.elapsed().as_secs_f64() * 1e3);
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
    Ok(Measured { per_second: times_ms.len() as f64 / seconds, p50_ms: at(0.5), p99_ms: at(0.99) })
}
