//! The connections of OpenIGTLink clients.
//!
//! Contract: they share the places and the idle time of the streams, and end with them when the service stops.

use std::sync::Arc;
use std::time::Duration;

use tokio::io::AsyncWriteExt as _;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::sleep;
use tokio_util::codec::Framed;

use super::answer::problem;
use super::conversation::Conversation;
use super::frame::{Codec, Stamp};
use crate::problem::{Kind, Problem};
use crate::state::AppState;
use crate::stream;

/// How long to wait where the system gives no connection, out of descriptors perhaps.
const BREATH: Duration = Duration::from_millis(200);

/// Serves OpenIGTLink clients until the streams are told to end.
pub async fn listen(listener: TcpListener, app: AppState) {
    let stopping = app.streams.stopping.clone();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            () = stopping.cancelled() => return,
        };
        match accepted {
            Ok((socket, _)) => begin(socket, &app),
            Err(error) => {
                tracing::debug!(%error, "no connection");
                sleep(BREATH).await;
            }
        }
    }
}

fn begin(mut socket: TcpStream, app: &AppState) {
    // An answer is one write that nothing should hold back.
    if let Err(error) = socket.set_nodelay(true) {
        tracing::debug!(%error, "a connection without TCP_NODELAY");
    }
    let (app, open) = (Arc::clone(app), app.streams.open.token());
    let Ok(place) = Arc::clone(&app.streams.places).try_acquire_owned() else {
        let busy = Problem::new(Kind::Busy, "As many streams as the service serves are open; try again in a second.");
        let stamp = Stamp { version: 1, ..Stamp::default() };
        // A few bytes into the empty buffer of a new connection.
        tokio::spawn(async move { socket.write_all(&problem(&stamp, None, 0, &busy)).await });
        return;
    };
    tokio::spawn(async move {
        let conversation = Conversation::new(app.access().clone());
        let metrics = Arc::clone(app.metrics());
        metrics.streams.inc();
        stream::serve(Framed::new(socket, Codec::default()), conversation, app).await;
        metrics.streams.dec();
        drop((place, open));
    });
}
