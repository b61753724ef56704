//! The jobs that wait, first come, first served, and no more than there are places for.
//!
//! Contract: one that comes wakes one thread, if any is idle, and no other. A channel behind a lock would wake two: the thread that takes what came, and the one that
//! then gets the lock, only to wait in its turn.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// What waits.
pub struct Queue<T> {
    waiting: Mutex<Waiting<T>>,
    came: Condvar,
    places: usize,
}

struct Waiting<T> {
    items: VecDeque<T>,
    closed: bool,
}

impl<T> Queue<T> {
    /// An empty one with so many places.
    pub fn new(places: usize) -> Self {
        let waiting = Waiting { items: VecDeque::new(), closed: false };
        Self { waiting: Mutex::new(waiting), came: Condvar::new(), places }
    }

    /// Puts an item last; whether there was a place.
    pub fn put(&self, item: T) -> bool {
        let mut waiting = self.lock();
        if waiting.items.len() >= self.places {
            return false;
        }
        waiting.items.push_back(item);
        drop(waiting);
        self.came.notify_one();
        true
    }

    /// Waits for the first item, and tells `taken` of it before anybody else sees the queue; `None` when it is closed and empty.
    pub fn take(&self, taken: impl FnOnce(&T)) -> Option<T> {
        let mut waiting = self.lock();
        while waiting.items.is_empty() && !waiting.closed {
            waiting = self.came.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
        let item = waiting.items.pop_front()?;
        taken(&item);
        Some(item)
    }

    /// Lets the threads go once it is empty.
    pub fn close(&self) {
        self.lock().closed = true;
        self.came.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Waiting<T>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
