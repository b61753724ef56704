//! Serving until told to stop.
//!
//! Contract: after the stop no connection is accepted and what was accepted is answered, within a bound on the time. A connection that brings
//! no whole request head for the idle time is closed, so that slow and half-open clients do not pile up; no more connections than
//! allowed are open, and those beyond wait at the listener.

use std::future::pending;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1::Builder;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::time::sleep;
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

use crate::routes::app;
use crate::state::AppState;

/// How long after the stop a connection may still hold the service: the default time limit of a request and a little.
const GRACE: Duration = Duration::from_secs(35);

/// How long to wait where the system gives no connection, out of descriptors perhaps.
const BREATH: Duration = Duration::from_millis(200);

/// Serves on `listener` until `shutdown`, then finishes what was accepted.
///
/// # Errors
/// None today: a listener that fails is asked again.
pub async fn run(listener: TcpListener, state: AppState, shutdown: CancellationToken) -> io::Result<()> {
    let connections = TaskTracker::new();
    let overdue = async {
        shutdown.cancelled().await;
        sleep(GRACE).await;
    };
    let served = async {
        tokio::select! {
            () = accept(&listener, &state, &connections, &shutdown) => {}
            () = shutdown.cancelled() => {}
        }
        drop(listener);
        connections.close();
        tokio::join!(state.end_streams(), connections.wait());
    };
    tokio::select! {
        () = served => {}
        () = overdue => tracing::warn!("connections were still open at the end"),
    }
    Ok(())
}

/// Takes connections for ever.
async fn accept(listener: &TcpListener, state: &AppState, connections: &TaskTracker, shutdown: &CancellationToken) {
    let (app, limits) = (app(Arc::clone(state)), state.connection_limits());
    loop {
        // The limit is never closed.
        let Ok(place) = Arc::clone(&limits.places).acquire_owned().await else { return pending().await };
        match listener.accept().await {
            Ok((stream, _)) => {
                let connection = serve(stream, app.clone(), limits.idle, shutdown.clone());
                connections.spawn(async move {
                    connection.await;
                    drop(place);
                });
            }
            Err(error) => {
                tracing::debug!(%error, "no connection");
                sleep(BREATH).await;
            }
        }
    }
}

/// Serves one connection until it ends, or until what it has begun is answered after the stop.
async fn serve(stream: TcpStream, app: Router, idle: Duration, shutdown: CancellationToken) {
    // An answer is one small write that nothing should hold back.
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!(%error, "a connection without TCP_NODELAY");
    }
    let mut builder = Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(idle);
    let connection = builder.serve_connection(TokioIo::new(stream), TowerToHyperService::new(app)).with_upgrades();
    tokio::pin!(connection);
    let ended = tokio::select! {
        ended = connection.as_mut() => ended,
        () = shutdown.cancelled() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
    if let Err(error) = ended {
        tracing::debug!(%error, "a connection broke off");
    }
}
