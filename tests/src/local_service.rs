//! A service in this process, as the program runs it: one thread that talks, numerical threads beside it.

use std::net::SocketAddr;
use std::sync::mpsc::{RecvError, channel};
use std::time::Duration;

use clap::Parser as _;
use retina_server::config::CommandLine;
use retina_server::{App, run};
use tokio_util::sync::CancellationToken;

/// How often it is asked whether it is ready.
const ASKED_EVERY: Duration = Duration::from_millis(10);

/// Starts a service with these settings (as on a command line, without the program's name) on a free port, and waits until it is ready. It ends with
/// the process.
///
/// # Errors
/// When it did not come up; its thread's panic on standard error says why.
pub fn start(settings: &[&str]) -> Result<SocketAddr, RecvError> {
    let words: Vec<String> = ["retina-server"].iter().chain(settings).map(|&word| word.to_owned()).collect();
    let (bound, address) = channel();
    std::thread::spawn(move || {
        let config = CommandLine::parse_from(words).config;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("runtime");
        runtime.block_on(async {
            let service = App::start(&config).expect("threads");
            while service.ready().is_err() {
                tokio::time::sleep(ASKED_EVERY).await;
            }
            let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("port");
            bound.send(listener.local_addr().expect("address")).expect("main thread");
            run(listener, service, CancellationToken::new()).await.expect("service");
        });
    });
    address.recv()
}
