//! Serving until told to stop.
//!
//! Contract: after the stop no connection is accepted and what was accepted is answered, within a bound on the time.

use std::future::pending;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::serve::ListenerExt as _;
use tokio::net::TcpListener;
use tokio::time::sleep;
use tokio_util::sync::CancellationToken;

use crate::routes::app;
use crate::state::AppState;

/// How long after the stop a connection may still hold the service: the default time limit of a request and a little.
const GRACE: Duration = Duration::from_secs(35);

/// Serves on `listener` until `shutdown`, then finishes what was accepted.
///
/// # Errors
/// If the listener fails.
pub async fn run(listener: TcpListener, state: AppState, shutdown: CancellationToken) -> io::Result<()> {
    // An answer is one small write that nothing should hold back.
    let listener = listener.tap_io(|connection| {
        if let Err(error) = connection.set_nodelay(true) {
            tracing::debug!(%error, "a connection without TCP_NODELAY");
        }
    });
    let serve =
        axum::serve(listener, app(Arc::clone(&state))).with_graceful_shutdown(shutdown.clone().cancelled_owned());
    let serve = async {
        // The streams hear of the end when it begins, and are waited for when all else is answered.
        let told = async {
            shutdown.cancelled().await;
            state.end_streams().await;
            pending().await
        };
        let result = tokio::select! {
            result = serve => result,
            result = told => result,
        };
        state.end_streams().await;
        result
    };
    let overdue = async {
        shutdown.cancelled().await;
        sleep(GRACE).await;
    };
    tokio::select! {
        result = serve => result,
        () = overdue => {
            tracing::warn!("connections were still open at the end");
            Ok(())
        }
    }
}
